/* A phantom on the side: the traced fibers are drawn as a scan with the noise and the blur of the real one, and that is
 * reconstructed and compared with them. */
#include "geometry/reconstruct.h"

#include "geometry/grade/compare_directions.h"
#include "geometry/grade/scan_noise.h"
#include "geometry/phantom/compare.h"
#include "geometry/phantom/phantom.h"
#include "geometry/volume/density_map.h"

#include <math.h>
#include <string.h>

enum { MAX_VOXEL = 1 << 24, MIN_EDGE = 32 };
/* Variance of a voxel along an axis, in square voxels: a part of the fitted blur that drawing adds by itself. */
static const double VOXEL_VARIANCE = 1.0 / 12.0;

/* The part of the scan that is tried: all of its height, and as much of its middle as MAX_VOXEL allows. */
static void choose_box(const size_t n[3], size_t from[3], size_t n_box[3])
{
    double over = (double)volume_n_voxel(n) / MAX_VOXEL, scale = over > 1.0 ? sqrt(over) : 1.0;
    for (int a = 0; a < 3; a++) {
        size_t edge = a < 2 ? (size_t)((double)n[a] / scale) : n[a], least = n[a] < MIN_EDGE ? n[a] : MIN_EDGE;
        n_box[a] = edge < least ? least : edge;
        from[a] = (n[a] - n_box[a]) / 2;
    }
}

/* Share of the way from a to b that lies in the box 0 .. size, if a is inside. */
static double way_inside(const double a[3], const double b[3], const double size[3])
{
    double share = 1.0;
    for (int k = 0; k < 3; k++) {
        if (b[k] < 0.0) share = fmin(share, a[k] / (a[k] - b[k]));
        if (b[k] > size[k]) share = fmin(share, (size[k] - a[k]) / (b[k] - a[k]));
    }
    return share;
}

static bool is_inside(const double p[3], const double size[3])
{
    for (int k = 0; k < 3; k++)
        if (!(p[k] >= 0.0 && p[k] <= size[k])) return false;
    return true;
}

struct cutter {
    const struct fiber_set *from;
    double origin_m[3], size_m[3];
    struct fiber_set *to;
};

static void position(const struct cutter *c, size_t i_vertex, double p[3])
{
    for (size_t k = 0; k < 3; k++) p[k] = (double)c->from->position_m[3 * i_vertex + k] - c->origin_m[k];
}

static void add_vertex(struct fiber_set *f, const double p[3])
{
    for (size_t k = 0; k < 3; k++) f->position_m[3 * f->n_vertex + k] = (float)p[k];
    f->n_vertex++;
}

/* Ends a piece. It is removed again if it has less than two vertices. */
static void end_piece(const struct cutter *c, size_t i_fiber)
{
    struct fiber_set *f = c->to;
    size_t first = f->first_vertex[f->n_fiber];
    if (f->n_vertex < first + 2) {
        f->n_vertex = first;
        return;
    }
    f->radius_m[f->n_fiber] = c->from->radius_m[i_fiber];
    f->axis_class[f->n_fiber] = c->from->axis_class[i_fiber];
    f->first_vertex[++f->n_fiber] = f->n_vertex;
}

/* Adds the parts of a fiber that lie in the box, cut at its faces. */
static void cut_fiber(const struct cutter *c, size_t i)
{
    const size_t begin = c->from->first_vertex[i], end = c->from->first_vertex[i + 1];
    for (size_t v = begin; v < end; v++) {
        double p[3], q[3], cut[3];
        position(c, v, p);
        bool here = is_inside(p, c->size_m), before = false;
        if (v > begin) {
            position(c, v - 1, q);
            before = is_inside(q, c->size_m);
        }
        if (v > begin && here != before) {
            double share = here ? way_inside(p, q, c->size_m) : way_inside(q, p, c->size_m);
            const double *a = here ? p : q, *b = here ? q : p;
            for (int k = 0; k < 3; k++) cut[k] = a[k] + share * (b[k] - a[k]);
            if (share > 0.01) add_vertex(c->to, cut);
        }
        if (!here && before) end_piece(c, i);
        if (here) add_vertex(c->to, p);
    }
    end_piece(c, i);
}

/* Copies the fibers in the box, whose corner becomes the origin. */
static status cut_fibers(const struct fiber_set *f, const size_t from[3], const size_t n[3], double voxel_m,
                         struct fiber_set *out, struct error *err)
{
    struct cutter c = {.from = f, .to = out};
    /* at most every second vertex begins a piece, and a piece has two cut ends */
    status s = fiber_set_reserve(out, f->n_fiber + f->n_vertex / 2, 2 * (f->n_vertex + f->n_fiber), err);
    if (s != STATUS_OK) return s;
    for (int a = 0; a < 3; a++) {
        c.origin_m[a] = (double)from[a] * voxel_m;
        c.size_m[a] = (double)n[a] * voxel_m;
    }
    for (int a = 0; a < 2; a++) out->tile_size_m[a] = c.size_m[a];
    out->n_fiber = out->n_vertex = 0;
    for (size_t i = 0; i < f->n_fiber; i++) cut_fiber(&c, i);
    return STATUS_OK;
}

/* The noise and the blur of the scan. */
static void measure(const struct volume *v, const struct reconstruct_report *report, struct scan_trial *t)
{
    double blur = report->profile_blur_m / v->voxel_size_m[0];
    t->snr = report->noise.mapped_sd > 0.0 ? 1.0 / report->noise.mapped_sd : 0.0;
    t->noise_sd_voxel = scan_noise_blur(scan_noise_correlation(v, report->noise.mapped_sd));
    t->blur_sd_voxel = sqrt(fmax(0.0, blur * blur - VOXEL_VARIANCE));
}

/* The options of the job that hold for the phantom too. All others are chosen from it. */
static struct reconstruct_option options_of(const struct reconstruct_option *job)
{
    struct reconstruct_option o;
    reconstruct_option_default(&o);
    o.fiber_diameter_voxel = job->fiber_diameter_voxel;
    o.link_sigma_voxel = job->link_sigma_voxel;
    o.min_vertex = job->min_vertex;
    o.radius_rule = job->radius_rule;
    return o;
}

static void take_figures(const struct compare_report *c, const struct direction_compare *d, struct scan_trial *t)
{
    t->made = true;
    t->n_true = c->n_true;
    t->n_found = c->n_found;
    t->recall = c->center_recall;
    t->precision = c->center_precision;
    t->fragments = c->fragments_per_fiber;
    t->merges = c->merges_per_fiber;
    t->axis_rms_voxel = c->centerline_rms_voxel;
    t->direction_mean_deg = c->direction_mean_deg;
    t->direction_p95_deg = c->direction_p95_deg;
    t->radius_bias = 0.01 * c->radius_bias_percent;
    t->radius_rms = 0.01 * c->radius_rms_percent;
    t->voxel_direction_mean_deg = d->inside.mean_deg;
    t->voxel_direction_p95_deg = d->inside.p95_deg;
}

/* Reconstructs the phantom v and compares it with the truth. */
static status reconstruct(struct volume *v, const struct fiber_set *truth, struct reconstruct_option *o,
                          struct thread_pool *pool, struct progress_part *part, struct scan_trial *t, struct error *err)
{
    struct reconstruct_report report = {0};
    struct direction_volume d = {0};
    struct fiber_set found;
    struct density_modes m;
    struct compare_report lines = {0};
    struct direction_compare voxels = {0};
    const struct progress inner = progress_of_part(part);
    const struct compare_option compare = {.voxel_size_m = v->voxel_size_m[0]};
    fiber_set_init(&found);
    status s = density_modes_find(v, &m, err);
    if (s == STATUS_OK) s = density_map_apply(v, m.low, m.high, pool, err);
    if (s == STATUS_OK) report.noise.mapped_sd = density_noise_sd(v, 0.0, 1.0);
    *part = (struct progress_part){part->outer, 0.1, 0.3};
    if (s == STATUS_OK) s = reconstruct_orientation(v, o, pool, &inner, &d, &report, err);
    *part = (struct progress_part){part->outer, 0.4, 0.6};
    if (s == STATUS_OK) s = reconstruct_fibers(v, &d, o, pool, &inner, &found, &report, err);
    if (s == STATUS_OK) s = reconstruct_transfer(&found, &d, pool, NULL, &report, err);
    if (s == STATUS_OK) s = compare_fibers(truth, &found, &compare, &lines, err);
    if (s == STATUS_OK) s = compare_directions(truth, &d, pool, &voxels, err);
    if (s == STATUS_OK) take_figures(&lines, &voxels, t);
    direction_volume_release(&d);
    fiber_set_release(&found);
    return s;
}

status reconstruct_trial(const struct volume *v, const struct fiber_set *f, const struct reconstruct_option *option,
                         struct thread_pool *pool, const struct progress *progress, struct reconstruct_report *report,
                         struct error *err)
{
    struct scan_trial *t = &report->trial;
    struct reconstruct_option o = options_of(option);
    struct phantom_scan_option scan;
    struct progress_part part = {progress, 0.0, 0.1};
    const struct progress inner = progress_of_part(&part);
    struct volume phantom = {0};
    struct fiber_set truth;
    size_t from[3];
    *t = (struct scan_trial){.recall = 0.0};
    fiber_set_init(&truth);
    measure(v, report, t);
    choose_box(v->n, from, t->n_voxel);
    status s = cut_fibers(f, from, t->n_voxel, v->voxel_size_m[0], &truth, err);
    if (s != STATUS_OK || truth.n_fiber == 0) goto out;
    phantom_scan_option_default(&scan);
    scan.voxel_size_m = v->voxel_size_m[0];
    scan.snr = t->snr;
    scan.noise_sd_voxel = t->noise_sd_voxel;
    scan.blur_sd_voxel = t->blur_sd_voxel;
    s = phantom_scan_in(&truth, t->n_voxel, &scan, v->space, pool, &inner, &phantom, err);
    if (s == STATUS_OK) s = reconstruct(&phantom, &truth, &o, pool, &part, t, err);
    if (s == STATUS_INVALID) s = STATUS_OK; /* nothing can be found in such a scan: the trial is not made */
out:
    volume_release(&phantom);
    fiber_set_release(&truth);
    return s;
}
