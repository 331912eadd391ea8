#include "geometry/reconstruct/trace_diameter.h"

#include "geometry/diameter/fiber_diameter.h"
#include "geometry/fibers/lines/line_ends.h"
#include "geometry/filter/filter_choice.h"
#include "geometry/grade/scan_grade.h"
#include "geometry/reconstruct/reconstruct.h"
#include "geometry/reconstruct/trace_box.h"
#include "geometry/reconstruct/trace_grid.h"
#include "geometry/reconstruct/trace_job.h"

#include <math.h>

enum { N_ROUND = 3 };
/* Largest ratio of the lines' diameter to the peak's: neighbours that touch lower the scale of the peak by less than a
 * tenth, and lines that are thicker run through several fibers. Lines of thin fibers do so at once, and
 * never raise it. */
static const double MOST_RISE = 1.1;
/* Blur in voxels from which the peak is kept, because the reaches of tracing then fit the blurred width better, and
 * from which the filter is narrower (geometry/NOTES.md). */
static const double STRONG_BLUR = 1.2;
/* Diameters over the peak's that are tried where thin and thick fibers may lie side by side: centers and radii of
 * fibers of half of a diameter to one and a half are found. A thicker one where radii spread by SEVERAL_SPREAD or more:
 * the peak may be the thin fibers', with several lines in each thick one. A thinner one where lines of LEAST_SEVERAL of
 * the length hold several fibers: the peak may be the thick fibers', with one line in each yarn of thin ones. */
static const double SEVERAL_SPREAD = 0.22, THICKER = 1.4, LEAST_SEVERAL = 0.03, THINNER = 1.0 / 1.6;
/* Where fibers have two diameters, the tried one has lines that describe the box better by this score (scan_grade.h),
 * whose radii spread by so much, and with a thicker diameter more than before by this ratio. Fibers of one kind whose
 * radii spread by a quarter have 0.27, as before. */
static const double BETTER = 0.01, TWO_SPREAD = 0.25, THICKER_SPREAD = 0.35, MORE_SPREAD = 1.25;
/* Noise over the step from void to material from which a narrower filter sees noise. */
static const double MOST_NOISE = 0.3;
/* Lines are in pieces where this share of their ends or more is in the middle of material. */
static const double LEAST_LOST_ENDS = 0.15;
/* Ratio of the diameters of two rounds up to which they are the same. */
static const double SETTLED = 1.04;

/* Returns the mean diameter in voxels of the lines that a tracing has found, as the report states it. The fit has the
 * edge of a blurred plane (axis_profile.h): blur moves the edge of a single cylinder inwards by blur^2 / (2 radius),
 * while neighbours that touch it move it outwards along a part of its outline; on phantoms half of the shift is left.
 */
static double diameter_of_lines(const struct reconstruct_report *report, double voxel_m)
{
    const double radius = report->profile_radius_m, blur = report->profile_blur_m;
    return 2.0 * (radius + 0.25 * blur * blur / radius) / voxel_m;
}

/* A box of a scan, and how it is traced. report: of the scan; peak: its diameter; filled: lumens will be filled. */
struct boxed_scan {
    const struct volume *box;
    trace_orientation *find;
    struct thread_pool *pool;
    const struct progress *progress;
    const struct reconstruct_report *report;
    double peak;
    bool filled;
};

/* Lines of a tracing: mean diameter in voxels, NaN where no fibers are resolved. */
struct found {
    double diameter;
    double spread;         /* of the radii, relative */
    double score, several; /* scan_grade.h; share of the length in lines that hold several fibers */
    double n_end, n_lost;  /* ends, and ends in the middle of material */
    bool blurred;          /* strongly, and without strong noise */
    bool resolved;         /* scan_grade.h */
};

/* Grades lines against the box. report: of their tracing. */
static status grade_lines(const struct volume *box, const struct polyline_set *lines, struct thread_pool *pool,
                          const struct reconstruct_report *report, struct found *found, struct error *err)
{
    struct fiber_set f;
    struct scan_grade grade;
    if (lines->n_line == 0) return STATUS_OK;
    fiber_set_init(&f);
    status s = trace_fiber_set(box, lines, &f, err);
    const struct coverage_input in = reconstruct_coverage_input(box, &f, report);
    if (s == STATUS_OK) s = scan_grade_measure(box, &f, pool, NULL, &grade, NULL, err);
    if (s == STATUS_OK) s = scan_grade_explain(&in, pool, &grade, NULL, err);
    if (s == STATUS_OK) {
        found->score = grade.score;
        found->several = grade.section.several_share;
        found->resolved = grade.verdict != GRADE_UNRESOLVED;
    }
    fiber_set_release(&f);
    return s;
}

/* Traces lines by a diameter, with the filter that belongs to it whatever the job's is: then a job that is given the
 * filter another one has chosen finds the same fibers. again: in the directions of their own lines. */
static status trace_once(const struct boxed_scan *scan, double diameter, bool again, struct found *found,
                         struct error *err)
{
    const struct volume *box = scan->box;
    struct reconstruct_report report = *scan->report;
    struct direction_volume d = {0};
    struct reconstruct_option o;
    struct trace_job job = {
        .v = box, .d = &d, .o = &o, .pool = scan->pool, .report = &report, .part.outer = scan->progress};
    struct polyline_set lines;
    *found = (struct found){.diameter = NAN};
    polyline_set_init(&lines);
    reconstruct_option_default(&o);
    o.fiber_diameter_voxel = diameter;
    report.radius_spread = 0.0;
    status s = scan->find(box, &o, scan->pool, scan->progress, &d, &report, err);
    report.in_pieces = again;
    if (s == STATUS_OK && again) s = reconstruct_redirect(box, &d, &o, scan->pool, scan->progress, &report, err);
    if (s == STATUS_OK) {
        trace_job_start(&job);
        s = trace_scan(&job, false, &lines, err);
    }
    if (s == STATUS_OK) s = grade_lines(box, &lines, scan->pool, &report, found, err);
    if (s == STATUS_OK) found->n_lost = (double)polylines_count_lost_ends(&lines, box, o.eps_d, 0.5 * diameter);
    if (s == STATUS_OK) found->n_end = 2.0 * (double)lines.n_line + 1.0;
    if (scan->filled) found->several = 0.0; /* lumens that are not filled yet look like gaps between fibers */
    found->spread = report.radius_spread;
    const bool resolved = lines.n_line > 0 && report.radius_spread <= TRACE_MOST_SPREAD;
    const bool blurred = report.profile_blur_m >= STRONG_BLUR * box->voxel_size_m[0];
    if (s == STATUS_OK && resolved && blurred) found->blurred = report.noise.scan_sd < MOST_NOISE;
    if (s == STATUS_OK && resolved && !blurred) found->diameter = diameter_of_lines(&report, box->voxel_size_m[0]);
    direction_volume_release(&d);
    polyline_set_release(&lines);
    return s == STATUS_INVALID ? STATUS_OK : s;
}

/* Returns whether a thinner diameter than the peak is tried: not for fibers so thin that voxels are interpolated, in so
 * much noise that lines of noise are traced as well. */
static bool may_be_thinner(const struct boxed_scan *scan, const struct volume *v, const struct found *found)
{
    const bool in_noise = scan->report->noise.scan_sd >= MOST_NOISE;
    return found->several >= LEAST_SEVERAL && !(in_noise && trace_grid_edge(THINNER * scan->peak, v->n) < 1.0);
}

/* Tries a diameter between thin and thick fibers side by side. It is taken if its lines describe the box
 * better than the lines of `before`, and their radii spread, for a thicker diameter more than before. */
static status try_between(const struct boxed_scan *scan, double ratio, const struct found *before, double *diameter,
                          struct error *err)
{
    struct found found;
    const double spread = ratio < 1.0 ? TWO_SPREAD : fmax(THICKER_SPREAD, MORE_SPREAD * before->spread);
    status s = trace_once(scan, ratio * scan->peak, false, &found, err);
    if (s != STATUS_OK || !found.resolved) return s; /* the thinner lines are no fibers */
    if (found.spread >= spread && found.score >= before->score + BETTER) *diameter = ratio * scan->peak;
    return s;
}

/* Repeats the tracing by the diameter of its lines until that stays the same. found: of the last tracing. */
static status settle_diameter(const struct boxed_scan *scan, double most, double *diameter, struct found *found,
                              struct error *err)
{
    double ratio = INFINITY;
    status s = STATUS_OK;
    for (int round = 0; round < N_ROUND && fabs(log(ratio)) > log(SETTLED) && s == STATUS_OK; round++) {
        const double tried = *diameter;
        s = trace_once(scan, tried, false, found, err);
        const bool spread = round == 0 && found->spread >= SEVERAL_SPREAD && found->several < LEAST_SEVERAL;
        if (s == STATUS_OK && spread) s = try_between(scan, THICKER, found, diameter, err);
        if (*diameter != tried) break; /* one between the diameters of two kinds */
        if (!(found->diameter < most && found->diameter * FIBER_DIAMETER_FINER > scan->peak)) break;
        ratio = found->diameter / tried;
        *diameter = found->diameter;
    }
    return s;
}

/* Finds whether lines are in pieces, and longer if traced once more in their own directions: in the box, and in large
 * scans in two more, which tell a share near the limit better. found: in the box. */
static status find_pieces(const struct boxed_scan *scan, const struct volume *v, const struct volume *known,
                          double diameter, const struct found *found, struct reconstruct_report *report,
                          struct error *err)
{
    double n_end = found->n_end, n_lost = found->n_lost;
    struct found other = {0};
    status s = STATUS_OK;
    report->in_pieces = false;
    for (int i = 1; i < TRACE_N_BOX && s == STATUS_OK && n_lost >= LEAST_LOST_ENDS * n_end; i++) {
        struct volume box = {0};
        struct boxed_scan there = *scan;
        size_t from[3];
        there.box = &box;
        s = trace_box_copy(v, known, scan->peak, i, &box, from, err);
        if (s != STATUS_OK || box.n[0] == 0) break;
        s = trace_once(&there, diameter, false, &other, err);
        n_end += other.n_end;
        n_lost += other.n_lost;
        volume_release(&box);
    }
    report->lost_ends = n_end > 0.0 ? n_lost / n_end : 0.0;
    if (s != STATUS_OK || !(report->lost_ends >= LEAST_LOST_ENDS) || reconstruct_redirects(report)) return s;
    s = trace_once(scan, diameter, true, &other, err);
    report->in_pieces = s == STATUS_OK && other.score > found->score - BETTER;
    return s;
}

status trace_diameter(const struct volume *v, const struct volume *known, trace_orientation *find,
                      struct reconstruct_option *option, struct thread_pool *pool, const struct progress *progress,
                      struct reconstruct_report *report, struct error *err)
{
    struct volume box = {0};
    size_t from[3];
    const struct progress quiet = progress_silent(progress);
    const double peak = report->fiber_diameter_voxel;
    const double most = trace_grid_edge(peak, v->n) < 1.0 ? peak : MOST_RISE * peak;
    const struct boxed_scan scan = {&box, find, pool, &quiet, report, peak, v->filled.n > 0};
    struct found found = {.diameter = NAN};
    double diameter = peak;
    status s = trace_box_copy(v, known, peak, 0, &box, from, err);
    if (s == STATUS_OK) s = settle_diameter(&scan, most, &diameter, &found, err);
    if (s == STATUS_OK && may_be_thinner(&scan, v, &found)) s = try_between(&scan, THINNER, &found, &diameter, err);
    if (found.blurred) filter_choose_blurred(option, diameter);
    if (s == STATUS_OK) report->fiber_diameter_voxel = diameter;
    if (s == STATUS_OK) s = find_pieces(&scan, v, known, diameter, &found, report, err);
    volume_release(&box);
    return s;
}
