/* Step "orientation": the fiber diameter, and the direction of the fiber through every voxel of material. */
#include "base/option_id.h"
#include "geometry/reconstruct/reconstruct.h"

#include "geometry/diameter/fiber_diameter.h"
#include "geometry/filter/filter_choice.h"
#include "geometry/filter/filter_directions.h"
#include "geometry/reconstruct/trace_diameter.h"
#include "geometry/reconstruct/trace_grid.h"
#include "geometry/volume/volume_rescale.h"
#include "geometry/volume/volume_unknown.h"

#include <math.h>

/* Diameters of textile fibers. */
static const double LEAST_FIBER_UM = 2.0, MOST_FIBER_UM = 60.0;
/* Ratio of diameters that are the same peak. */
static const double SAME_PEAK = 1.3;
/* Noise over the step from void to material from which on thin fibers get the usual filter: a narrow one sees more of
 * it. It lies between a half, at which some cloths gain by the narrow one and others lose, and a fifth, at which all
 * that touch gain (geometry/NOTES.md, "Thin fibers: the filter was too wide"). */
static const double MOST_NOISE = 1.0 / 3.0;

/* Share of noise in a peak up to which lines are traced by its diameter. */
static const double MOST_PEAK_NOISE = 0.5;

/* Takes the diameter of the fibers that noise hid in the scan, if only their yarns are left since it was smoothed. */
static void prefer_hidden(const struct scan_noise *noise, struct fiber_diameter *d)
{
    const double hidden = noise->hidden_diameter_voxel;
    if (!(hidden > 0.0) || hidden * FIBER_DIAMETER_FINER > d->voxel) return;
    d->other_voxel = d->voxel;
    d->other_noise_share = d->noise_share;
    d->voxel = hidden;
    d->noise_share = noise->hidden_noise_share;
    d->hidden = true;
}

/* Measures the diameter beside one that the job gives, and states it where it is another. Fibers that noise hides are
 * not looked for. */
static status check_given(const struct volume *v, struct thread_pool *pool, const struct progress *progress,
                          struct fiber_diameter *d, struct error *err)
{
    struct fiber_diameter measured;
    status s = fiber_diameter_measure(v, pool, progress, &measured, err);
    if (s == STATUS_OK && measured.noise_share < 0.5 &&
        fabs(log(measured.voxel / d->voxel)) > log(FIBER_DIAMETER_FINER))
        d->other_voxel = measured.voxel;
    return s;
}

/* Takes the fiber diameter of the job, or measures it. */
static status find_diameter(const struct volume *v, const struct reconstruct_option *option, struct thread_pool *pool,
                            const struct progress *progress, struct reconstruct_report *report, struct error *err)
{
    struct fiber_diameter d = {.voxel = option->fiber_diameter_voxel, .noise_share = NAN, .other_voxel = NAN};
    status s = STATUS_OK;
    d.other_noise_share = NAN;
    if (isnan(d.voxel)) {
        s = fiber_diameter_measure(v, pool, progress, &d, err);
        if (s == STATUS_OK) prefer_hidden(&report->noise, &d);
    } else {
        s = check_given(v, pool, progress, &d, err);
    }
    report->fiber_diameter_voxel = d.voxel;
    report->diameter_noise_share = d.noise_share;
    report->other_diameter_voxel = d.other_voxel;
    report->other_diameter_noise_share = d.other_noise_share;
    return s;
}

/* Asks about the scale of a scan whose fibers are none of a textile. Who states their diameter has answered. */
static status ask_scale(const struct volume *v, const struct reconstruct_option *option,
                        const struct reconstruct_report *report, struct error *err)
{
    const double voxel_um = 1e6 * v->voxel_size_m[0], voxel = report->fiber_diameter_voxel;
    const double um[2] = {voxel * voxel_um, report->other_diameter_voxel * voxel_um};
    for (int i = 0; i < 2; i++)
        if (um[i] >= LEAST_FIBER_UM && um[i] <= MOST_FIBER_UM) return STATUS_OK;
    if (!isnan(option->fiber_diameter_voxel)) return STATUS_OK;
    return error_set_field(
        err, STATUS_INVALID, OPTION_VOXEL_SIZE,
        "fibers of %.1f voxels are %.3g um thick with voxels of %.3g um, and textile fibers are 2 to "
        "60 um: correct the voxel size, or state 'fiber_diameter_voxel' if both are right",
        voxel, um[0], voxel_um);
}

/* Returns whether fibers are so thin and the scan so noisy that lines of noise are traced as well. */
static bool is_thin_in_noise(const struct reconstruct_report *report, double edge)
{
    return edge < 1.0 && report->noise.scan_sd >= MOST_NOISE;
}

/* Returns whether lines of fibers can be told from lines of noise at the measured diameter. */
static bool lines_tell_diameter(const struct volume *v, const struct reconstruct_report *report)
{
    const double diameter = report->fiber_diameter_voxel;
    return report->diameter_noise_share <= MOST_PEAK_NOISE && diameter != report->noise.hidden_diameter_voxel &&
           !is_thin_in_noise(report, trace_grid_edge(diameter, v->n));
}

/* Measures the diameter once more in the rescaled volume, where lines would be no better. A peak far from the first one
 * is another one. */
static status measure_again(const struct volume *grid, double edge, struct thread_pool *pool,
                            const struct progress *progress, struct reconstruct_report *report, struct error *err)
{
    struct fiber_diameter d;
    status s = fiber_diameter_measure(grid, pool, progress, &d, err);
    if (s == STATUS_OK && fabs(log(d.voxel * edge / report->fiber_diameter_voxel)) < log(SAME_PEAK))
        report->fiber_diameter_voxel = d.voxel * edge;
    return s;
}

/* Filters a rescaled volume, and gives its directions to the voxels of the scan. */
static status filter_rescaled(const struct volume *v, double edge, struct reconstruct_option *option,
                              struct thread_pool *pool, const struct progress *progress, struct direction_volume *d,
                              struct reconstruct_report *report, struct error *err)
{
    struct volume grid = {0};
    struct direction_volume on_grid = {0};
    const struct progress quiet = progress_silent(progress);
    status s = volume_rescale(v, edge, pool, &quiet, &grid, err);
    if (s == STATUS_OK && isnan(option->fiber_diameter_voxel) && is_thin_in_noise(report, edge))
        s = measure_again(&grid, edge, pool, &quiet, report, err);
    trace_grid_rescale_option(option, edge);
    if (edge < 1.0 && !is_thin_in_noise(report, edge)) filter_choose_thin(option, report->fiber_diameter_voxel / edge);
    if (s == STATUS_OK)
        s = filter_directions_kept(&grid, report->fiber_diameter_voxel / edge, option, pool, progress, &on_grid, report,
                                   err);
    trace_grid_rescale_option(option, 1.0 / edge);
    volume_release(&grid);
    if (s == STATUS_OK)
        s = direction_volume_rescale(&on_grid, v, option->eps_d, pool, d, &report->n_material_voxel,
                                     &report->n_kept_voxel, err);
    direction_volume_release(&on_grid);
    return s;
}

/* known: v before its densities were continued into unknown voxels; NULL: the options have a diameter that is not
 * compared with the scan's. */
static status find_directions(const struct volume *v, const struct volume *known, struct reconstruct_option *option,
                              struct thread_pool *pool, const struct progress *progress, struct direction_volume *d,
                              struct reconstruct_report *report, struct error *err)
{
    struct progress_part part = {progress, 0.0, 0.1};
    const struct progress inner = progress_of_part(&part);
    *d = (struct direction_volume){0};
    status s = STATUS_OK;
    const bool is_known_noisy = reconstruct_redirects(report);
    if (known != NULL) report->in_pieces = false;
    if (known == NULL)
        report->fiber_diameter_voxel = option->fiber_diameter_voxel;
    else
        s = find_diameter(v, option, pool, &inner, report, err);
    if (s == STATUS_OK) s = ask_scale(v, option, report, err);
    if (s == STATUS_OK && isnan(option->fiber_diameter_voxel) && lines_tell_diameter(v, report))
        s = trace_diameter(v, known, reconstruct_orientation_again, option, pool, &inner, report, err);
    if (s != STATUS_OK) return s;
    const double edge = trace_grid_edge(report->fiber_diameter_voxel, v->n);
    report->trace_edge_voxel = edge;
    const bool is_redirected = known != NULL && !is_known_noisy && reconstruct_redirects(report);
    part = (struct progress_part){progress, 0.1, is_redirected ? RECONSTRUCT_FILTER_SHARE - 0.1 : 0.9};
    if (edge == 1.0) return filter_directions(v, report->fiber_diameter_voxel, option, pool, &inner, d, report, err);
    return filter_rescaled(v, edge, option, pool, &inner, d, report, err);
}

/* Leaves out the voxels without a measurement, which a copy has filled. */
static void empty_unknown(const struct volume *v, double eps_d, struct direction_volume *d,
                          struct reconstruct_report *report)
{
    const size_t n = volume_n_voxel(v->n), n_slice = v->n[0] * v->n[1];
    volume_unknown_empty(v, d);
    report->n_material_voxel = report->n_kept_voxel = 0;
    for (size_t i = 0; i < n; i++) {
        if (i % n_slice == 0) scratch_keep_within(v->space);
        report->n_material_voxel += v->density[i] >= (float)eps_d;
        report->n_kept_voxel += d->density[i] > 0;
    }
}

/* is_sure: the options have a diameter that is not compared with the scan's. */
static status orient(const struct volume *v, bool is_sure, struct reconstruct_option *option, struct thread_pool *pool,
                     const struct progress *progress, struct direction_volume *d, struct reconstruct_report *report,
                     struct error *err)
{
    struct volume continued = {0};
    const struct volume *known = is_sure ? NULL : v;
    if (v->unknown.n == 0) return find_directions(v, known, option, pool, progress, d, report, err);
    *d = (struct direction_volume){0};
    status s = volume_continue(v, &continued, err);
    if (s == STATUS_OK) s = find_directions(&continued, known, option, pool, progress, d, report, err);
    if (s == STATUS_OK) empty_unknown(v, option->eps_d, d, report);
    volume_release(&continued);
    return s;
}

status reconstruct_orientation(const struct volume *v, struct reconstruct_option *option, struct thread_pool *pool,
                               const struct progress *progress, struct direction_volume *d,
                               struct reconstruct_report *report, struct error *err)
{
    return orient(v, false, option, pool, progress, d, report, err);
}

status reconstruct_orientation_again(const struct volume *v, struct reconstruct_option *option,
                                     struct thread_pool *pool, const struct progress *progress,
                                     struct direction_volume *d, struct reconstruct_report *report, struct error *err)
{
    return orient(v, true, option, pool, progress, d, report, err);
}
