/* A second look at the material that no line explains.
 *
 * Thin fibers between thicker ones are missed at first: filters have the scale of the typical fiber, so thin fibers get
 * the directions of their neighbours. Once whole lines are fitted, their fibers are subtracted from the scan (matching
 * pursuit, Mallat and Zhang 1993), and the rest is filtered and traced like a scan of thinner fibers. Flat fibers are
 * subtracted with their sections, because the part outside of a disc looks like thin fibers at their sides. The lines
 * found there join the others before ends grow and touching lines are compared. */
#include "geometry/reconstruct/trace_job.h"

#include "geometry/fibers/axes/model/fiber_section.h"
#include "geometry/filter/filter_directions.h"
#include "geometry/volume/volume_rescale.h"
#include "geometry/volume/volume_slabs.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Diameter of the fibers looked for, over the typical one; centers are found from 0.55 to 1.5 times this diameter. */
static const double THINNER = 0.72;
static const float PAD = 0.3f; /* voxels added to subtracted radii, so that no rims are left */
/* Material that is left over all material below which there is nothing to look for, as where radii spread by less than
 * TRACE_LEAST_SPREAD: only rims of fibers are left (up to 0.05). */
static const double LEAST_LEFT = 0.03;
/* Fibers so thin that voxels are interpolated are missed where they touch, also where they are alike; lines on missed
 * neighbours then spread their radii by 0.09 to 0.15. */
static const double LEAST_SPREAD_THIN = 0.05;
static const double LEAST_DIAMETERS = 1.5; /* length of the lines that are added */
enum { SLAB = 16 };                        /* slices whose densities are held while the grid has what is left */
/* Density of thin hollow fibers whose lumens were not filled: blurred walls have 0.75 at most, and the middle 0.55. */
static const float HOLLOW_DENSITY = 0.62f;

/* A piece of a fiber around a vertex, one voxel to either side of it. section: NULL for a ball. */
struct piece {
    const float *x;
    float t[3], radius, reach;
    const struct section_view *section;
};

/* Distance of a point beyond the surface of a piece; d: from the vertex. */
static float depth_in(const struct piece *p, const float d[3])
{
    if (p->section == NULL) return sqrtf(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]) - p->radius;
    const float along = d[0] * p->t[0] + d[1] * p->t[1] + d[2] * p->t[2];
    const float across[3] = {d[0] - along * p->t[0], d[1] - along * p->t[1], d[2] - along * p->t[2]};
    if (fabsf(along) > 1.0f) return INFINITY;
    if (!(across[0] * across[0] + across[1] * across[1] + across[2] * across[2] > 0.0f)) return -p->radius;
    return fiber_section_place(p->section, p->radius, across).depth;
}

/* Slices from .. to - 1 of the scan, from which fibers are subtracted. */
struct slab {
    size_t from, to;
    const float *density; /* of the scan, beginning with slice `from` */
};

/* Lowers the density around a vertex by a piece of a fiber. width: of its blurred edge. */
static void subtract_piece(const struct slab *slab, const struct piece *p, float width, struct volume *left)
{
    size_t from[3], to[3];
    for (int a = 0; a < 3; a++) {
        const float lo = floorf(p->x[a] - p->reach), hi = ceilf(p->x[a] + p->reach), last = (float)left->n[a];
        from[a] = (size_t)fminf(fmaxf(lo, 0.0f), last);
        to[a] = (size_t)fminf(fmaxf(hi, 0.0f), last);
    }
    if (from[2] < slab->from) from[2] = slab->from;
    if (to[2] > slab->to) to[2] = slab->to;
    const size_t before = volume_index(left->n, 0, 0, slab->from);
    for (size_t k = from[2]; k < to[2]; k++)
        for (size_t j = from[1]; j < to[1]; j++)
            for (size_t i = from[0]; i < to[0]; i++) {
                const float d[3] = {(float)i + 0.5f - p->x[0], (float)j + 0.5f - p->x[1], (float)k + 0.5f - p->x[2]};
                const float share = fminf(1.0f, 0.5f - depth_in(p, d) / width);
                const size_t at = volume_index(left->n, i, j, k);
                const float scan = slab->density[at - before];
                if (share > 0.0f) left->density[at] = fmaxf(0.0f, fminf(left->density[at], scan - share));
            }
}

/* Subtracts the fiber around vertex i of a line. */
static void subtract_vertex(const struct trace_job *job, const struct polyline_set *lines, size_t line, size_t i,
                            const struct slab *slab, struct volume *left)
{
    const float width = (float)(sqrt(2.0 * M_PI) * job->profile.blur), origin[3] = {0.0f, 0.0f, 0.0f};
    const float radius = lines->radius[line] > 0.0f ? lines->radius[line] : (float)(0.5 * job->diameter);
    struct piece p = {.x = lines->vertex[i], .radius = radius + PAD};
    struct section_view view;
    p.reach = p.radius + 0.5f * width; /* width: one over the slope of the edge */
    if (lines->shape != NULL) {
        polyline_tangent(lines, line, i, 1, p.t);
        struct fiber_section section = {{0.0f, 0.0f, 0.0f}, 0.0f, 0.0f};
        fiber_section_take_shape(&lines->shape[i], p.t, &section);
        view = fiber_section_view(&section, &section, origin, p.t);
        p.section = &view;
        p.reach = p.radius * view.stretch + 0.5f * width;
    }
    subtract_piece(slab, &p, width, left);
}

static void subtract_all(const struct trace_job *job, const struct polyline_set *lines, const struct slab *slab,
                         struct volume *left)
{
    for (size_t l = 0; l < lines->n_line; l++) {
        for (size_t i = lines->first[l]; i < lines->first[l + 1]; i++) subtract_vertex(job, lines, l, i, slab, left);
        scratch_keep_within(left->space);
    }
}

static size_t count_material(const struct volume *v, double eps_d)
{
    size_t n = 0, n_slice = v->n[0] * v->n[1];
    for (size_t k = 0; k < v->n[2]; k++) {
        for (size_t i = 0; i < n_slice; i++) n += (double)v->density[k * n_slice + i] >= eps_d;
        scratch_keep_within(v->space);
    }
    return n;
}

/* Subtracts the lines from a copy of the scan. */
static status subtract_from_copy(const struct trace_job *job, const struct polyline_set *lines, struct volume *left,
                                 struct error *err)
{
    const struct volume *v = job->v;
    const size_t n_slice = v->n[0] * v->n[1];
    const struct slab all = {0, v->n[2], v->density};
    status s = volume_init_in(left, v->n, v->voxel_size_m, v->space, err);
    for (size_t k = 0; k < v->n[2] && s == STATUS_OK; k++) {
        memcpy(left->density + k * n_slice, v->density + k * n_slice, n_slice * sizeof *v->density);
        scratch_keep_within(v->space);
    }
    if (s == STATUS_OK) subtract_all(job, lines, &all, left);
    return s;
}

/* Subtracts the lines from the densities of the grid, slab by slab. */
static status subtract_in_place(const struct trace_job *job, const struct polyline_set *lines, struct volume *left,
                                struct error *err)
{
    const size_t *n = left->n, n_slice = n[0] * n[1];
    float *scan = malloc(SLAB * n_slice * sizeof *scan);
    if (scan == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot look for more fibers: out of memory");
    for (size_t k = 0; k < n[2]; k += SLAB) {
        const struct slab slab = {k, k + SLAB < n[2] ? k + SLAB : n[2], scan};
        memcpy(scan, left->density + k * n_slice, (slab.to - slab.from) * n_slice * sizeof *scan);
        subtract_all(job, lines, &slab, left);
    }
    free(scan);
    return STATUS_OK;
}

/* Makes the volume of the scan without the lines: of a copy, or of the grid itself, which its owner then restores.
 * *share: its material over the material of the scan. */
static status subtract_lines(const struct trace_job *job, const struct polyline_set *lines, struct volume *left,
                             double *share, struct error *err)
{
    const size_t n_material = count_material(job->v, job->o->eps_d);
    status s;
    if (job->grid != NULL) {
        *left = *job->grid->v;
        left->slabs = NULL;
        s = subtract_in_place(job, lines, left, err);
    } else {
        s = subtract_from_copy(job, lines, left, err);
    }
    if (s == STATUS_OK && n_material > 0) *share = (double)count_material(left, job->o->eps_d) / (double)n_material;
    return s;
}

/* Ends the use of the volume without the lines. */
static status release_left(const struct trace_job *job, struct volume *left, struct error *err)
{
    const struct trace_grid *g = job->grid;
    const struct progress quiet = progress_silent(&job->inner);
    if (g != NULL) return volume_rescale_again(g->scan, g->edge, job->pool, &quiet, g->v, err);
    volume_release(left);
    return STATUS_OK;
}

/* In a scan with lumens, gives the thin hollow fibers that are left the density of solid ones. */
static void raise_hollow(const struct trace_job *job, struct volume *left)
{
    const size_t n_slice = left->n[0] * left->n[1];
    for (size_t k = 0; k < left->n[2] && job->hollow; k++) {
        float *slice = left->density + k * n_slice;
        for (size_t i = 0; i < n_slice; i++) slice[i] = fminf(1.0f, slice[i] / HOLLOW_DENSITY);
        scratch_keep_within(left->space);
    }
}

/* Traces the fibers of the volume that is left, and adds them. */
static status add_lines(const struct trace_job *job, const struct volume *left, struct polyline_set *lines,
                        struct error *err)
{
    struct trace_job look = *job;
    struct reconstruct_option option = *job->o;
    struct reconstruct_report report = *job->report;
    struct direction_volume d = {0};
    struct polyline_set part[3];
    struct join_counts counts = {0};
    look.inner = progress_silent(&job->inner);
    option.s = option.t = option.eps_j = NAN;
    option.h = 0;
    look.v = left;
    look.d = &d;
    look.o = &option;
    look.report = &report;
    look.diameter = THINNER * job->diameter;
    for (int i = 0; i < 3; i++) polyline_set_init(&part[i]);
    status s = filter_directions_kept(left, look.diameter, &option, job->pool, &look.inner, &d, &report, err);
    const bool nothing = s == STATUS_INVALID; /* no voxel looks like a part of a fiber */
    if (nothing) s = STATUS_OK;
    if (s == STATUS_OK && !nothing) s = trace_chains(&look, &part[0], err);
    if (s == STATUS_OK && !nothing) s = trace_repair(&look, &part[0], false, 0.0, &part[1], &counts, err);
    if (s == STATUS_OK && !nothing) s = trace_repair(&look, &part[1], true, 0.0, &part[2], &counts, err);
    for (size_t l = 0; l < part[2].n_line && s == STATUS_OK; l++)
        if ((double)polyline_length(&part[2], l) >= LEAST_DIAMETERS * job->diameter)
            s = polyline_add_part(lines, &part[2], l, part[2].first[l], part[2].first[l + 1], err);
    for (int i = 0; i < 3; i++) polyline_set_release(&part[i]);
    direction_volume_release(&d);
    return s;
}

/* Sections and the lines that are added do not belong together. */
static void forget_sections(struct polyline_set *lines)
{
    free(lines->shape);
    lines->shape = NULL;
}

status trace_leftover(struct trace_job *job, struct polyline_set *lines, struct error *err)
{
    struct volume left = {0};
    const size_t n_before = lines->n_line;
    double share = 0.0;
    const double spread = job->report->radius_spread;
    status s = STATUS_OK;
    const bool look =
        spread >= (job->independent < 1.0 ? LEAST_SPREAD_THIN : TRACE_LEAST_SPREAD) && spread <= TRACE_MOST_SPREAD;
    if (look) s = subtract_lines(job, lines, &left, &share, err);
    forget_sections(lines);
    if (!look) return STATUS_OK;
    if (s == STATUS_OK) raise_hollow(job, &left);
    if (s == STATUS_OK && share >= LEAST_LEFT) s = add_lines(job, &left, lines, err);
    const status released = release_left(job, &left, s == STATUS_OK ? err : NULL);
    if (s == STATUS_OK) s = released;
    if (s == STATUS_OK && share >= LEAST_LEFT && job->v->slabs != NULL)
        s = volume_slabs_send(job->v->slabs, job->v,
                              err); /* ranks have one slab at a time: a slab of `left` until here */
    if (s != STATUS_OK || lines->n_line == n_before) return s;
    trace_classify(lines);
    return trace_center(job, lines, 1, err);
}
