/* Warnings about a scan and its fibers from measured figures. None of them stops a job. */
#include "base/option_id.h"
#include "geometry/reconstruct/reconstruct.h"

#include <math.h>
#include <stdio.h>

static void warn_alignment(const struct warning_sink *warn, const struct reconstruct_option *o,
                           const struct reconstruct_report *r)
{
    const struct main_directions *m = &r->main;
    const double *u = m->n == 1 && m->direction[0][0] == 0.0 ? m->direction[1] : m->direction[0];
    if (o->align && r->align.outcome == ALIGN_NO_DIRECTION)
        warning_send(warn, OPTION_ALIGN, "the fibers have no clear main direction, so the volume was not aligned");
    if (o->align && r->align.outcome == ALIGN_OTHER_AXES && m->n == 0)
        warning_send(
            warn, OPTION_ALIGN,
            "%.0f %% of the fibers run along z and there is no clear weft or warp, so the volume was not aligned; "
            "check 'axes'",
            100.0 * m->share_z);
    else if (o->align && r->align.outcome == ALIGN_OTHER_AXES)
        warning_send(warn, OPTION_ALIGN,
                     "the fibers run along (%.2f, %.2f, %.2f)%s, which is too far from x and y, so the volume was not "
                     "aligned; correct 'axes' first",
                     u[0], u[1], u[2], m->n == 2 ? " and another direction" : "");
    if (r->aligned && r->align.se_deg > 1.0)
        warning_send(warn, OPTION_ALIGN, "the standard error of the directions of warp and weft is %.1f degrees",
                     r->align.se_deg);
    const size_t *valid = r->tile.valid, *box = o->crop_voxel; /* valid counts in the cropped box */
    double share = (double)(valid[2] - valid[0]) * (double)(valid[3] - valid[1]) / ((double)r->n[0] * (double)r->n[1]);
    if (r->is_all_padded)
        warning_send(warn, OPTION_CROP_BOX,
                     "every column of the tile meets voxels without a measurement (padding), so the tile is nowhere "
                     "complete: crop it in z");
    else if (!o->crop && valid[2] > 0 && share < 0.98)
        warning_send(
            warn, OPTION_CROP_BOX,
            "%s into the tile, so only %.0f %% of it is complete: crop to x %zu..%zu, y %zu..%zu, or give 'crop' as "
            "\"auto\"",
            r->has_padding ? "padding, which is no measurement, reaches"
                           : "the matrix brings corners from outside of the scan",
            100.0 * share, box[0] + valid[0], box[0] + valid[2], box[1] + valid[1], box[1] + valid[3]);
    for (int a = 0; a < 2; a++)
        if (o->crop && r->tile.mismatch[a] > TILE_MOST_MISMATCH)
            warning_send(warn, OPTION_CROP,
                         "no two places of the scan match across %c (mismatch %.2f, 0 is a repeat and 1 is "
                         "chance), so nothing was cropped and the tile has a seam",
                         "xy"[a], r -> tile.mismatch[a]);
}

/* Says that lumens were filled without being asked for, or that they may be there. */
static void warn_lumens(const struct warning_sink *warn, const struct reconstruct_option *o,
                        const struct reconstruct_report *r)
{
    const double percent = 100.0 * r->lumen.middle_share;
    const enum lumen_verdict verdict = lumen_evidence_judge(&r->lumen);
    if (r->lumens_found)
        warning_send(
            warn, OPTION_HOLLOW_FIBERS,
            "the fibers are hollow: voids in the middle of fibers are %.2f %% of the material, and traced lines "
            "are dark along their axes, so void that is enclosed was filled before tracing; give false if they are "
            "solid",
            percent);
    else if (o->hollow_fibers <= 0 && verdict != LUMENS_NOT_SEEN)
        warning_send(
            warn, OPTION_HOLLOW_FIBERS,
            "the fibers %s hollow: voids in the middle of fibers are %.2f %% of the material, and the walls of "
            "hollow fibers are traced as fibers; give true if they are hollow, as cotton",
            verdict == LUMENS_CLEAR ? "look" : "may be", percent);
}

void reconstruct_warn_volume(const struct reconstruct_option *o, const struct reconstruct_report *r,
                             const struct warning_sink *warn)
{
    warn_alignment(warn, o, r);
    if (r->separability < 0.7)
        warning_send(
            warn, OPTION_SCAN_FILES,
            "void and material cannot be distinguished (separability %.2f; noise alone has 0.64, a clear scan more "
            "than 0.8); check that this is the right file, and its type and byte order",
            r->separability);
    else if (r->noise.scan_sd > 0.5)
        warning_send(warn, OPTION_SCAN_FILES,
                     "the scan is very noisy: its standard deviation is %.2f of the step from void to material",
                     r->noise.scan_sd);
    warn_lumens(warn, o, r);
}

/* Says which of two diameters was taken. The tracing follows from it, so a wrong one makes wrong fibers. */
static void warn_diameter(const struct warning_sink *warn, const struct reconstruct_report *r)
{
    double chosen = r->fiber_diameter_voxel, other = r->other_diameter_voxel;
    const bool given = isnan(r->diameter_noise_share);
    if (given && isfinite(other))
        warning_send(warn, OPTION_FIBER_DIAMETER,
                     "the fiber diameter that was given, %.1f voxels, was taken over one of %.1f voxels that the scan "
                     "shows; leave it out if this is wrong",
                     chosen, other);
    else if (other < chosen)
        warning_send(warn, OPTION_FIBER_DIAMETER,
                     "a fiber diameter of %.1f voxels was chosen over one of %.1f, because %.0f %% of the response "
                     "there is noise; give the diameter if this is wrong",
                     chosen, other, 100.0 * r->other_diameter_noise_share);
    else if (other > chosen)
        warning_send(warn, OPTION_FIBER_DIAMETER,
                     "a fiber diameter of %.1f voxels was chosen over one of %.1f, which responds more strongly but "
                     "may be that of yarns; give the diameter if this is wrong",
                     chosen, other);
    else if (r->diameter_noise_share > 0.5)
        warning_send(warn, OPTION_FIBER_DIAMETER,
                     "the fiber diameter of %.1f voxels is uncertain, because %.0f %% of the response at its scale is "
                     "noise; give the diameter if it is known",
                     chosen, 100.0 * r->diameter_noise_share);
}

/* Says that lumens may have been missed, and walls traced. Walls of unseen lumens were 3.6 to 4.7 voxels wide; a clear
 * scan of fibers that are wider has no walls to trace, even if it is too coarse to show lumens. */
static void warn_unseen_lumens(const struct warning_sink *warn, const struct reconstruct_report *r)
{
    const bool as_walls = r->fiber_diameter_voxel < 5.0;
    const bool noisy = r->noise.scan_sd > 0.3;
    if (r->lumens == LUMENS_UNKNOWN && r->grade.verdict != GRADE_UNRESOLVED && (as_walls || noisy))
        warning_send(warn, OPTION_HOLLOW_FIBERS,
                     "the scan does not tell whether the fibers are hollow: lumens show from 6 voxels a diameter and a "
                     "signal-to-noise ratio of 3 on, and here it is %.1f voxels and %.1f; where hollow fibers are not "
                     "seen, their walls are traced: give true if they are hollow, as cotton, and false if they are not",
                     r->fiber_diameter_voxel, 1.0 / fmax(1e-3, r->noise.scan_sd));
}

static void warn_grade(const struct warning_sink *warn, const struct scan_grade *g)
{
    char what[200] = "take them as guesses, and use a volume model, which needs directions and density alone";
    if (g->n_dropped > 0)
        snprintf(what, sizeof what, "%zu of them were left out, and directions and density stand for their material",
                 g->n_dropped);
    if (g->verdict == GRADE_UNRESOLVED)
        warning_send(warn, OPTION_SCAN_FILES,
                     "the scan does not resolve single fibers: around the traced fibers it has %.0f %% of the contrast "
                     "that such fibers would have, and only %.0f %% of their length is sure; %s, or scan with smaller "
                     "voxels",
                     100.0 * fmax(0.0, g->contrast), 100.0 * g->safe_share, what);
    if (g->verdict == GRADE_PARTLY)
        warning_send(warn, OPTION_SCAN_FILES,
                     "the scan resolves single fibers in part: %.0f %% of the traced length is sure, elsewhere the "
                     "density hardly shows the fibers",
                     100.0 * g->safe_share);
}

/* Says how many lines hold several fibers, if they can be told one by one. */
static void warn_yarns(const struct warning_sink *warn, const struct section_misfit *m)
{
    if (m->several_share > GRADE_MOST_SEVERAL)
        warning_send(warn, OPTION_FIBER_DIAMETER,
                     "%.0f %% of the traced length is in lines that hold several fibers, or a yarn: give the diameter "
                     "of the fibers (of thick and thin ones, one between both), or scan with smaller voxels",
                     100.0 * m->several_share);
    else
        warning_send(warn, OPTION_FIBER_DIAMETER,
                     "the traced lines do not have the sections of single fibers (densities around their axes vary by "
                     "%.0f %%): each line may hold several fibers, or a yarn; give the diameter of the fibers, or scan "
                     "with smaller voxels",
                     100.0 * m->surface);
}

/* Says which material no line explains, and which lines may be no fibers. */
static void warn_faults(const struct warning_sink *warn, const struct scan_grade *g)
{
    const struct scan_coverage *c = &g->coverage;
    if (g->faults & GRADE_UNEXPLAINED)
        warning_send(
            warn, OPTION_SCAN_FILES,
            "no traced fiber explains %.0f %% of the material, whose density is about %.2f of the densest; most "
            "of it lies in slices x %zu, y %zu, z %zu: %s",
            100.0 * (1.0 - c->explained_share), c->unexplained_density, c->slice[0], c->slice[1], c->slice[2],
            scan_coverage_has_particles(c) ? "it is mostly compact, as particles are"
                                           : "if it is a lighter kind of fiber, give a lower 'density_high'; if fibers "
                                             "of other diameters, give 'fiber_diameter_voxel'");
    if (g->faults & GRADE_PARTICLES)
        warning_send(warn, OPTION_SCAN_FILES,
                     "%.0f %% of the traced length is in lines that are shorter than %.0f diameters and end inside of "
                     "the scan at both ends: they may be particles",
                     100.0 * g->likeness.particle_share, FIBER_LEAST_DIAMETERS);
    if (g->faults & GRADE_DOUBLED)
        warning_send(warn, OPTION_FIBER_DIAMETER,
                     "%.0f %% of the traced length lies within another traced fiber, so thick fibers may hold several "
                     "lines: give the diameter of the thickest fibers",
                     100.0 * g->double_share);
    if (g->faults & GRADE_SEVERAL) warn_yarns(warn, &g->section);
    if (g->faults & GRADE_PIECES)
        warning_send(
            warn, OPTION_SCAN_FILES,
            "fibers are traced in about %.1f pieces each: %zu of %zu ends inside of the scan lie in the middle "
            "of material",
            g->likeness.fragments, g->likeness.n_lost_end, g->likeness.n_end);
}

void reconstruct_warn_fibers(const struct reconstruct_report *r, const struct fiber_set *f,
                             const struct warning_sink *warn)
{
    double radius = 0.0, longest = 0.0;
    for (size_t i = 0; i < f->n_fiber; i++) {
        radius += (double)f->radius_m[i] / (double)f->n_fiber;
        longest = fmax(longest, (double)f->radius_m[i]);
    }
    if (f->n_fiber < 5)
        warning_send(warn, OPTION_NONE, "fibers: the cloth has only %zu fiber%s", f->n_fiber,
                     f->n_fiber == 1 ? "" : "s");
    if (radius < 1e-6 || longest > 250e-6)
        warning_send(warn, OPTION_NONE,
                     "fibers: a mean radius of %.3g um is not that of a textile fiber (2 to 100 um); check "
                     "the voxel size of the scan, or the unit of the fiber file",
                     radius * 1e6);
    warn_diameter(warn, r);
    if (r->fiber_diameter_voxel > 0.0 && r->fiber_diameter_voxel < 4.0)
        warning_send(
            warn, OPTION_NONE,
            "fibers: they are only %.1f voxels thick; touching fibers are distinguished reliably from 7 voxels "
            "on, and hardly below 4",
            r->fiber_diameter_voxel);
    warn_grade(warn, &r->grade);
    warn_faults(warn, &r->grade);
    warn_unseen_lumens(warn, r);
    if (r->n[0] > 0 && r->dice > 0.0 && r->dice < 0.5)
        warning_send(warn, OPTION_NONE,
                     "fibers: they explain little of the material (Dice %.2f, where 1 is all of it); check the slices",
                     r->dice);
}
