/* A phantom on the side: the traced fibers are drawn as a scan with the noise and the blur of the real one, and that is
 * reconstructed and compared with them. */
#include "geometry/reconstruct/reconstruct.h"

#include "geometry/grade/compare_directions.h"
#include "geometry/grade/compare_sections.h"
#include "geometry/grade/scan_noise.h"
#include "geometry/grade/trial_fibers.h"
#include "geometry/phantom/compare.h"
#include "geometry/phantom/phantom.h"
#include "geometry/volume/density_map.h"

#include <math.h>
#include <string.h>

enum { MIN_EDGE = 32 };
/* Variance of a voxel along an axis, in square voxels: a part of the fitted blur that drawing adds by itself. */
static const double VOXEL_VARIANCE = 1.0 / 12.0;

/* The part of the scan that is tried: all of its height, and as much of its middle as SCAN_TRIAL_VOXELS allows. */
static void choose_box(const size_t n[3], size_t from[3], size_t n_box[3])
{
    double over = (double)volume_n_voxel(n) / SCAN_TRIAL_VOXELS, scale = over > 1.0 ? sqrt(over) : 1.0;
    for (int a = 0; a < 3; a++) {
        size_t edge = a < 2 ? (size_t)((double)n[a] / scale) : n[a], least = n[a] < MIN_EDGE ? n[a] : MIN_EDGE;
        n_box[a] = edge < least ? least : edge;
        from[a] = (n[a] - n_box[a]) / 2;
    }
}

/* Returns the parts of the measured sections that the phantom has. A ratio x of filled voxels to material voxels makes
 * lumens of the area x / (1 + x). */
static struct trial_sections sections_of(const struct reconstruct_report *report)
{
    const double filled = report->lumen_share;
    return (struct trial_sections){
        .flat = report->axis_ratio > FIBER_RATIO_FLAT, .hollow = filled > 0.0, .lumen = sqrt(filled / (1.0 + filled))};
}

/* The noise and the blur of the scan. */
static void measure(const struct volume *v, const struct reconstruct_report *report, struct scan_trial *t)
{
    double blur = report->profile_blur_m / v->voxel_size_m[0];
    t->scan_noise_sd = report->noise.scan_sd;
    t->snr = report->noise.mapped_sd > 0.0 ? 1.0 / report->noise.mapped_sd : 0.0;
    t->noise_sd_voxel = scan_noise_blur(scan_noise_correlation(v, report->noise.mapped_sd));
    t->blur_sd_voxel = sqrt(fmax(0.0, blur * blur - VOXEL_VARIANCE));
}

/* The scan of a phantom with that noise and blur. */
static struct phantom_scan_option scan_of(const struct volume *v, const struct scan_trial *t)
{
    struct phantom_scan_option scan;
    phantom_scan_option_default(&scan);
    scan.voxel_size_m = v->voxel_size_m[0];
    scan.snr = t->snr;
    scan.noise_sd_voxel = t->noise_sd_voxel;
    scan.blur_sd_voxel = t->blur_sd_voxel;
    scan.own_sections = true;
    return scan;
}

/* The options of the job that hold for the phantom too, and whether lumens were filled. All others are chosen from
 * it. */
static struct reconstruct_option options_of(const struct reconstruct_option *job,
                                            const struct reconstruct_report *report)
{
    struct reconstruct_option o;
    reconstruct_option_default(&o);
    o.fiber_diameter_voxel = job->fiber_diameter_voxel;
    o.link_sigma_voxel = job->link_sigma_voxel;
    o.min_vertex = job->min_vertex;
    o.three_subvolumes = job->three_subvolumes;
    o.radius_rule = job->radius_rule;
    o.hollow_fibers = report->lumen_share > 0.0;
    return o;
}

static void take_figures(const struct compare_report *c, const struct section_compare *s,
                         const struct direction_compare *d, struct scan_trial *t)
{
    t->made = true;
    t->n_true = c->n_true;
    t->n_found = c->n_found;
    t->recall = c->center_recall;
    t->recall_se = c->center_recall_se;
    t->precision = c->center_precision;
    t->fragments = c->fragments_per_fiber;
    t->fragments_se = c->fragments_se;
    t->merges = c->merges_per_fiber;
    t->axis_rms_voxel = c->centerline_rms_voxel;
    t->direction_mean_deg = c->direction_mean_deg;
    t->direction_p95_deg = c->direction_p95_deg;
    t->radius_bias = 0.01 * c->radius_bias_percent;
    t->radius_rms = 0.01 * c->radius_rms_percent;
    t->lumen_rms = t->lumen > 0.0 ? s->lumen_rms : NAN;
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
    struct section_compare sections = {0};
    struct direction_compare voxels = {0};
    const struct progress inner = progress_of_part(part);
    const struct progress quiet = progress_silent(&inner);
    const struct compare_option compare = {.voxel_size_m = v->voxel_size_m[0]};
    fiber_set_init(&found);
    status s = density_modes_find(v, &m, err);
    if (s == STATUS_OK) s = density_map_apply(v, m.low, m.high, pool, err);
    if (s == STATUS_OK) report.noise.mapped_sd = density_noise_sd(v, 0.0, 1.0);
    if (s == STATUS_OK && o->hollow_fibers > 0) s = reconstruct_lumens(v, o, pool, &report, err);
    *part = (struct progress_part){part->outer, 0.1, 0.3};
    if (s == STATUS_OK) s = reconstruct_orientation(v, o, pool, &inner, &d, &report, err);
    report.noise.scan_sd = t->scan_noise_sd;
    if (s == STATUS_OK) s = reconstruct_redirect(v, &d, o, pool, &quiet, &report, err);
    *part = (struct progress_part){part->outer, 0.4, 0.6};
    if (s == STATUS_OK) s = reconstruct_fibers(v, &d, o, pool, &inner, &found, &report, err);
    if (s == STATUS_OK) s = reconstruct_transfer(&found, &d, pool, NULL, &report, err);
    if (s == STATUS_OK) s = compare_fibers(truth, &found, &compare, &lines, err);
    if (s == STATUS_OK) s = compare_sections(truth, &found, &sections, err);
    if (s == STATUS_OK) s = compare_directions(truth, &d, pool, &voxels, err);
    if (s == STATUS_OK) take_figures(&lines, &sections, &voxels, t);
    direction_volume_release(&d);
    fiber_set_release(&found);
    return s;
}

/* Draws the phantom of a trial. Thin walls of hollow fibers are not as dense in a blurred scan as their material, and
 * the mapping of densities makes up for that in scan and phantom alike. So where the phantom has lumens, it is drawn
 * again with the noise that becomes the scan's noise when it is mapped. */
static status draw(const struct volume *v, const struct fiber_set *truth, struct thread_pool *pool,
                   const struct progress *progress, struct scan_trial *t, struct volume *phantom, struct error *err)
{
    struct phantom_scan_option scan = scan_of(v, t);
    struct density_modes m;
    status s = phantom_scan_in(truth, t->n_voxel, &scan, v->space, pool, progress, phantom, err);
    if (s != STATUS_OK || !(t->lumen > 0.0) || !(t->snr > 0.0)) return s;
    s = density_modes_find(phantom, &m, err);
    volume_release(phantom);
    *phantom = (struct volume){0};
    if (s != STATUS_OK) return s;
    t->snr = scan.snr = scan.snr / (m.high - m.low);
    return phantom_scan_in(truth, t->n_voxel, &scan, v->space, pool, progress, phantom, err);
}

status reconstruct_trial(const struct volume *v, const struct fiber_set *f, const struct reconstruct_option *option,
                         struct thread_pool *pool, const struct progress *progress, struct reconstruct_report *report,
                         struct error *err)
{
    struct scan_trial *t = &report->trial;
    const struct trial_sections sections = sections_of(report);
    struct reconstruct_option o = options_of(option, report);
    struct progress_part part = {progress, 0.0, 0.1};
    const struct progress inner = progress_of_part(&part);
    struct volume phantom = {0};
    struct fiber_set truth;
    struct trial_box box = {.voxel_size_m = v->voxel_size_m[0]};
    *t = (struct scan_trial){.recall = 0.0};
    fiber_set_init(&truth);
    measure(v, report, t);
    choose_box(v->n, box.from, box.n);
    memcpy(t->n_voxel, box.n, sizeof t->n_voxel);
    status s = trial_fibers_cut(f, &box, &sections, &truth, err);
    if (s != STATUS_OK || truth.n_fiber == 0) goto out;
    trial_fibers_describe(&truth, t);
    s = draw(v, &truth, pool, &inner, t, &phantom, err);
    if (s == STATUS_OK) s = reconstruct(&phantom, &truth, &o, pool, &part, t, err);
    if (s == STATUS_INVALID) s = STATUS_OK; /* nothing can be found in such a scan: the trial is not made */
out:
    volume_release(&phantom);
    fiber_set_release(&truth);
    return s;
}
