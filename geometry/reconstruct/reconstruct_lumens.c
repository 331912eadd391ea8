/* Part of the step "volume": the lumens of hollow fibers are filled, so that their fibers are traced as solid ones.
 *
 * Void that is enclosed is filled first (lumen_fill.h, lumen_filter.h), and emptied again where lines that are traced
 * in it show no hollow fibers (lumen_lines.h). Where diameters differ, that leaves most lumens
 * of the thinnest fibers open: their walls are blurred to 0.6 to 0.8 of the density, and noise opens them somewhere.
 * Such fibers look like the background of touching fibers beside those that were filled. Once most others are traced
 * and subtracted (trace_leftover.c), they are seen. Lines are therefore traced here, the inner parts of their fibers
 * are filled, and the step "fibers" traces them again in the volume that results. Where the lines that have judged
 * whether there are lumens have radii that are alike, nothing is traced. */
#include "geometry/diameter/fiber_diameter.h"
#include "geometry/diameter/lumen_fill.h"
#include "geometry/diameter/lumen_filter.h"
#include "geometry/grade/scan_noise.h"
#include "geometry/reconstruct/lumen_lines.h"
#include "geometry/reconstruct/reconstruct.h"
#include "geometry/reconstruct/trace_job.h"

#include <math.h>
#include <string.h>

enum { N_REFILL = 3, ENCLOSED = 1, CORE = 2 };

/* Fills enclosed void, at the scale of the fibers as they are once all of it is filled. *diameter_voxel: of the
 * fibers; NaN: it is measured. */
static status fill_enclosed(struct volume *v, double *diameter_voxel, struct thread_pool *pool,
                            struct reconstruct_report *report, struct error *err)
{
    struct fiber_diameter d = {.voxel = *diameter_voxel};
    status s = lumens_fill(v, report->noise.mapped_sd, pool, &report->lumen_share, err);
    if (s == STATUS_OK && isnan(*diameter_voxel)) s = fiber_diameter_measure(v, pool, NULL, &d, err);
    *diameter_voxel = d.voxel;
    if (s == STATUS_OK) s = lumens_filter(v, d.voxel, pool, &report->lumen_share, err);
    return s;
}

/* Gives all voxels the densities that they had before they were filled. */
static status empty_all(struct volume *v, struct reconstruct_report *report, struct error *err)
{
    void *mark = NULL;
    report->lumen_share = 0.0;
    if (v->filled.n == 0) return STATUS_OK;
    status s = scratch_new(v->space, volume_n_voxel(v->n), "the lumens of fibers", &mark, err);
    if (s != STATUS_OK) return s;
    memset(mark, 0, volume_n_voxel(v->n));
    s = volume_fill_marked(v, mark, ENCLOSED, err);
    scratch_release(v->space, mark);
    return s;
}

/* Share of the time of a tracing that its directions take. */
static const double orientation_share = 0.4;

/* The volume that is traced, and the options. */
struct refill {
    struct volume *v;
    const struct reconstruct_option *o;
    struct thread_pool *pool;
    struct progress_part tracing; /* progress of the present tracing */
    uint8_t *mark;                /* of the voxels: ENCLOSED where void was enclosed */
};

/* Traces lines in the volume as it is filled. report: a copy. None where voxels would be interpolated, or where nothing
 * looks like a fiber. */
static status trace_filled(struct refill *r, struct reconstruct_report *report, struct polyline_set *lines,
                           struct error *err)
{
    struct reconstruct_option option = *r->o;
    struct direction_volume d = {0};
    const struct progress tracing = progress_of_part(&r->tracing);
    struct progress_part part;
    const struct progress inner = progress_begin_part(&part, &tracing, 0.0, orientation_share);
    struct trace_job job = {.v = r->v, .d = &d, .o = &option, .pool = r->pool, .report = report, .part.outer = &inner};
    status s = reconstruct_orientation(r->v, &option, r->pool, &inner, &d, report, err);
    part = (struct progress_part){&tracing, orientation_share, (1.0 - orientation_share) / TRACE_SETTLED_END};
    if (s == STATUS_OK && report->trace_edge_voxel >= 1.0) {
        trace_job_start(&job);
        s = trace_scan(&job, false, lines, err);
    }
    direction_volume_release(&d);
    return s == STATUS_INVALID ? STATUS_OK : s;
}

/* Fills the inner parts of traced fibers besides the void that was enclosed. *again: whether the diameters of the
 * fibers differ, so that lines were found that the next tracing may improve. */
static status refill_once(struct refill *r, const struct reconstruct_report *report, bool *again, struct error *err)
{
    uint8_t *mark = r->mark;
    struct reconstruct_report look = *report;
    struct polyline_set lines;
    polyline_set_init(&lines);
    look.radius_spread = 0.0;
    status s = trace_filled(r, &look, &lines, err);
    *again = s == STATUS_OK && lines.n_line > 0 && look.radius_spread >= TRACE_LEAST_SPREAD &&
             look.radius_spread <= TRACE_MOST_SPREAD;
    if (*again) {
        for (size_t i = 0; i < volume_n_voxel(r->v->n); i++) mark[i] = mark[i] == ENCLOSED ? ENCLOSED : 0;
        trace_mark_cores(&lines, look.fiber_diameter_voxel, r->v->n, CORE, mark);
        s = volume_fill_marked(r->v, mark, ENCLOSED, err);
    }
    polyline_set_release(&lines);
    return s;
}

/* Fills enclosed void where the job says that the fibers are hollow, or where lines that are traced say so. */
static status judge_lumens(struct volume *v, int hollow_fibers, double diameter_voxel, struct thread_pool *pool,
                           struct reconstruct_report *report, struct error *err)
{
    const bool ask = hollow_fibers <= 0;
    if (ask && lumen_evidence_judge(&report->lumen) == LUMENS_NOT_SEEN) return STATUS_OK;
    status s = fill_enclosed(v, &diameter_voxel, pool, report, err);
    if (s == STATUS_OK && ask) s = lumen_lines_measure(v, diameter_voxel, pool, report, &report->lumen, err);
    if (s != STATUS_OK || !ask) return s;
    report->lumens_found = hollow_fibers < 0 && lumen_evidence_judge(&report->lumen) == LUMENS_CLEAR;
    return report->lumens_found ? STATUS_OK : empty_all(v, report, err);
}

status reconstruct_lumens(struct volume *v, struct reconstruct_option *o, struct thread_pool *pool,
                          struct reconstruct_report *report, struct error *err)
{
    report->lumen_share = 0.0;
    report->lumens_found = false;
    status s = lumen_evidence_measure(v, report->noise.mapped_sd, pool, &report->lumen, err);
    if (s == STATUS_OK) s = judge_lumens(v, o->hollow_fibers, o->fiber_diameter_voxel, pool, report, err);
    report->lumens = o->hollow_fibers >= 0                                     ? LUMENS_GIVEN
                     : report->lumens_found                                    ? LUMENS_FILLED
                     : lumen_evidence_judge(&report->lumen) == LUMENS_POSSIBLE ? LUMENS_DOUBTFUL
                                                                               : LUMENS_NONE;
    if (o->hollow_fibers < 0) o->hollow_fibers = report->lumens_found;
    return s;
}

bool reconstruct_refills(const struct volume *v, const struct reconstruct_report *report)
{
    return v->filled.n > 0 && !(report->lumen.radius_spread < TRACE_LEAST_SPREAD);
}

status reconstruct_refill_lumens(struct volume *v, const struct reconstruct_option *o, struct thread_pool *pool,
                                 const struct progress *progress, struct reconstruct_report *report, struct error *err)
{
    void *mark = NULL;
    bool again = true;
    if (!reconstruct_refills(v, report)) return STATUS_OK;
    status s = scratch_new(v->space, volume_n_voxel(v->n), "the lumens of fibers", &mark, err);
    if (s != STATUS_OK) return s;
    memset(mark, 0, volume_n_voxel(v->n));
    for (size_t i = 0; i < v->filled.n; i++) ((uint8_t *)mark)[v->filled.voxel[i]] = ENCLOSED;
    struct refill r = {.v = v, .o = o, .pool = pool, .mark = mark};
    for (int round = 0; round < N_REFILL && again && s == STATUS_OK; round++) {
        r.tracing = (struct progress_part){progress, (double)round / N_REFILL, 1.0 / N_REFILL};
        s = refill_once(&r, report, &again, err);
    }
    scratch_release(v->space, mark);
    if (s != STATUS_OK) return s;
    seam_density_measure(v, &report->seam_density);
    progress_report(progress, 1.0);
    return s;
}

const char *lumen_answer_name(enum lumen_answer a)
{
    static const char *const name[] = {"given", "filled", "possible", "none", "unknown"};
    return name[a];
}

void reconstruct_tell_lumens(const struct volume *v, struct reconstruct_report *report)
{
    const struct scan_noise *n = &report->noise;
    const double blur = scan_noise_blur(scan_noise_correlation(v, n->mapped_sd));
    const double of_scan = sqrt(fmax(0.0, blur * blur - n->smooth_voxel * n->smooth_voxel));
    if (report->lumens != LUMENS_NONE) return;
    if (report->grade.verdict == GRADE_UNRESOLVED ||
        !lumen_evidence_would_show(report->fiber_diameter_voxel, n->scan_sd, of_scan))
        report->lumens = LUMENS_UNKNOWN;
}
