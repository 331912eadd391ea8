/* Lines of a scan some voxels of which are unknown, such as those outside of a round field of view. */
#include "geometry/reconstruct/trace_job.h"

#include "geometry/volume/volume_unknown.h"

/* Returns whether no vertex of a part of a line has only known voxels within a radius: such a line only touches the
 * border of the field of view, where fibers that are cut lengthwise look like thin ones. */
static bool is_fragment(const struct trace_job *job, const struct volume *v, const struct polyline_set *lines,
                        size_t first, size_t end)
{
    for (size_t i = first; i < end; i++)
        if (!volume_unknown_near(v, lines->vertex[i], (float)(0.5 * job->diameter))) return false;
    return true;
}

/* Adds the parts of lines that lie in known voxels, if they have at least min_vertex vertices and are no fragments. */
static status keep_known(const struct trace_job *job, const struct volume *v, const struct polyline_set *lines,
                         size_t min_vertex, struct polyline_set *known, struct error *err)
{
    status s = STATUS_OK;
    for (size_t l = 0; l < lines->n_line; l++) {
        size_t first = lines->first[l];
        for (size_t i = first; i <= lines->first[l + 1] && s == STATUS_OK; i++) {
            if (i < lines->first[l + 1] && !volume_unknown_near(v, lines->vertex[i], 0.0f)) continue;
            if (i - first >= min_vertex && !is_fragment(job, v, lines, first, i))
                s = polyline_add_part(known, lines, l, first, i, err);
            first = i + 1;
        }
    }
    return s;
}

status trace_known(struct trace_job *job, bool finish, trace_find *find, struct polyline_set *lines, struct error *err)
{
    const struct volume *v = job->v;
    struct volume copy;
    struct polyline_set found;
    status s = volume_continue(v, &copy, err);
    if (s != STATUS_OK) return s;
    polyline_set_init(&found);
    job->v = &copy;
    s = find(job, finish, &found, err);
    if (s == STATUS_OK) s = keep_known(job, v, &found, finish ? job->o->min_vertex : TRACE_MIN_PIECE, lines, err);
    volume_unknown_ignore(v, &copy);
    if (s == STATUS_OK && finish && lines->n_line > 0 && job->report->trace_edge_voxel >= 1.0)
        s = trace_refit(job, lines, err);
    job->v = v;
    polyline_set_release(&found);
    volume_release(&copy);
    return s;
}
