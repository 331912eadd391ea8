/* Lines of a scan, traced in its own voxels or in others (trace_grid.h). */
#include "geometry/reconstruct/trace_job.h"

#include "geometry/reconstruct/trace_grid.h"
#include "geometry/volume/volume_rescale.h"
#include "geometry/volume/volume_slabs.h"

#include <math.h>

void trace_job_start(struct trace_job *job)
{
    job->inner = progress_of_part(&job->part);
    job->hollow = job->v->filled.n > 0;
    job->diameter = job->report->fiber_diameter_voxel;
    job->independent = 1.0;
    job->profile = trace_start_profile(job);
}

static status end_lines(struct trace_job *job, bool finish, struct polyline_set *lines, struct error *err)
{
    return finish ? trace_finish(job, lines, err) : trace_settle(job, lines, err);
}

/* Gives the voxels of a grid their directions. */
static status take_directions(const struct trace_job *job, double edge, const struct volume *grid,
                              struct direction_volume *direction, struct error *err)
{
    size_t n_material, n_kept;
    if (edge < 1.0) return direction_volume_refine(job->d, grid, job->o->eps_d, job->pool, direction, err);
    return direction_volume_rescale(job->d, grid, job->o->eps_d, job->pool, direction, &n_material, &n_kept, err);
}

/* Finds lines in voxels whose edge is `edge` voxels of the scan. The last fit is to the finer of both grids. The lines
 * are in voxels of the scan. */
static status trace_rescaled(const struct trace_job *job, double edge, bool finish, struct polyline_set *lines,
                             struct error *err)
{
    struct volume grid = {0};
    struct direction_volume direction = {0};
    struct trace_job on_grid = *job;
    struct volume_slabs slabs = {0};
    const struct trace_grid made = {job->v, &grid, edge};
    on_grid.inner = progress_of_part(&on_grid.part);
    const struct progress quiet = progress_silent(&on_grid.inner);
    status s = volume_rescale(job->v, edge, job->pool, &quiet, &grid, err);
    if (s == STATUS_OK) s = take_directions(job, edge, &grid, &direction, err);
    on_grid.v = &grid;
    on_grid.grid = &made;
    on_grid.d = &direction;
    on_grid.diameter = job->diameter / edge;
    on_grid.independent = fmin(1.0, edge * edge * edge);
    on_grid.profile = trace_start_profile(&on_grid);
    if (s == STATUS_OK) s = volume_slabs_share(&slabs, thread_pool_team(job->pool), &grid, err);
    if (s == STATUS_OK) s = trace_lines(&on_grid, lines, err);
    if (s == STATUS_OK && edge < 1.0) s = end_lines(&on_grid, finish, lines, err);
    trace_grid_rescale_lines(lines, edge);
    direction_volume_release(&direction);
    volume_slabs_release(&slabs);
    volume_release(&grid);
    return s;
}

/* Traces lines in the scan itself, or those that were found in larger voxels only to their end. The other ranks have
 * slabs of the scan meanwhile. */
static status trace_on_scan(struct trace_job *job, bool all, bool finish, struct polyline_set *lines, struct error *err)
{
    const struct volume *v = job->v;
    struct volume scan = *v;
    struct volume_slabs slabs = {0};
    status s = volume_slabs_share(&slabs, thread_pool_team(job->pool), &scan, err);
    job->v = &scan;
    if (s == STATUS_OK && all) s = trace_lines(job, lines, err);
    if (s == STATUS_OK) s = end_lines(job, finish, lines, err);
    job->v = v;
    volume_slabs_release(&slabs);
    return s;
}

static status find_lines(struct trace_job *job, bool finish, struct polyline_set *lines, struct error *err)
{
    const double edge = job->report->trace_edge_voxel;
    status s = edge == 1.0 ? STATUS_OK : trace_rescaled(job, edge, finish, lines, err);
    if (s == STATUS_OK && edge >= 1.0) s = trace_on_scan(job, edge == 1.0, finish, lines, err);
    return s;
}

status trace_scan(struct trace_job *job, bool finish, struct polyline_set *lines, struct error *err)
{
    if (job->v->unknown.n == 0) return find_lines(job, finish, lines, err);
    return trace_known(job, finish, find_lines, lines, err);
}
