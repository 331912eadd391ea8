/* Lines on one grid, from chains of centers to the last fit. */
#include "geometry/reconstruct/trace_job.h"
#include "geometry/reconstruct/trace_kinds.h"

#include "geometry/fibers/axes/axis_fit.h"
#include "geometry/fibers/axes/flat_fit.h"
#include "geometry/fibers/lines/disagreement.h"
#include "geometry/fibers/lines/kinks.h"
#include "geometry/fibers/lines/line_ends.h"
#include "geometry/fibers/lines/weak_lines.h"
#include "geometry/fibers/shape/smoothing.h"

#include <math.h>
#include <stdlib.h>

enum {
    N_REPAIR = 2,      /* rounds of growing, joining and cutting */
    N_CENTER = 2,      /* rounds of fitting pieces of lines to the scan */
    N_FIT = 4,         /* rounds of fitting whole lines, and of all fits of flat fibers */
    N_LAST_FIT = 2,    /* rounds of the last fit, whose lines have been fitted before */
    N_SETTLE = 3,      /* most rounds of fitting, cutting and joining before the last fit beyond the first one */
    N_SETTLE_THIN = 2, /* the same where voxels are interpolated: a third round loses length there */
    N_SETTLE_FIT = 6   /* rounds of fitting in each of them */
};

/* Lines are repaired once more while more than this share of their ends lies in the middle of material, and the last
 * round has joined more than that share of the lines. Where too many are lost, lines are so wrong that rounds lose
 * length, but not in interpolated voxels (geometry/NOTES.md, "Rounds of fitting, cutting and joining"). */
#define LOST_SHARE 0.03
#define MOST_LOST_SHARE 0.4
#define JOINED_SHARE 0.02
/* Turn of a kink relative to the usual turn. Less cuts fibers of plain weaves into pieces; more keeps jumps between
 * fibers. */
#define OVER_USUAL_TURN 2.1
/* Distance of the axes of neighbours over the sum of their radii, below which one of two fitted lines is wrong: fibers
 * do not pass through each other. */
#define TOUCHING 0.85
/* Radius over the least one of a fit up to which a fit has found no edge, and density over a fiber's below which such a
 * line is on noise: lines beside fibers and on a bright background have 0.4 to 0.75, thin fibers 0.85 and more. */
#define NO_EDGE 1.02
#define WEAK 0.75

/* Smooths every line, and drops those with fewer than min_vertex vertices. */
static status smooth_and_drop(struct trace_job *job, const struct polyline_set *in, struct polyline_set *out,
                              struct error *err)
{
    size_t longest = 0;
    for (size_t l = 0; l < in->n_line; l++)
        if (polyline_length(in, l) > longest) longest = polyline_length(in, l);
    double *work = malloc(4 * (longest + 1) * sizeof *work);
    if (work == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot smooth fibers: out of memory");
    status s = STATUS_OK;
    for (size_t l = 0; l < in->n_line && s == STATUS_OK; l++) {
        size_t n = polyline_length(in, l);
        if (n < job->o->min_vertex || n < 3) {
            job->report->n_short_dropped[in->axis[l]]++;
            continue;
        }
        polyline_smooth(in->vertex + in->first[l], n, job->o->smooth_alpha, work);
        s = polyline_add_part(out, in, l, in->first[l], in->first[l + 1], err);
    }
    free(work);
    return s;
}

/* Mean radius of the lines by length, and the spread of the radii without the part of their errors. */
static void measure_radii(const struct polyline_set *lines, struct axis_profile *profile)
{
    double length = 0.0, sum = 0.0, square = 0.0;
    for (size_t l = 0; l < lines->n_line; l++) {
        const double n = (double)polyline_length(lines, l), r = (double)lines->radius[l];
        length += n;
        sum += n * r;
        square += n * r * r;
    }
    if (!(length > 0.0)) return;
    profile->radius = sum / length;
    const double spread = square / length / (profile->radius * profile->radius) - 1.0;
    profile->radius_spread = sqrt(fmax(0.0, spread - profile->radius_se * profile->radius_se));
}

/* Leaves out the lines on noise, whose fit has found no edge. */
static status drop_weak(const struct trace_job *job, struct axis_profile *profile, struct polyline_set *lines,
                        struct error *err)
{
    struct polyline_set kept;
    polyline_set_init(&kept);
    status s = polylines_drop_weak(lines, job->v, NO_EDGE * AXIS_RADIUS_LEAST * job->diameter, WEAK * profile->high,
                                   &kept, err);
    if (s == STATUS_OK && kept.n_line < lines->n_line) measure_radii(&kept, profile);
    polyline_set_release(lines);
    *lines = kept;
    return s;
}

/* Moves lines to where they explain the scan best. `last`: as smoothly as fibers are, with errors for the report. */
static status fit_axes(struct trace_job *job, struct polyline_set *lines, bool last, struct error *err)
{
    /* lines and profile of the last fit are nearly right from the rounds before, but sections begin as discs */
    const bool soon = last && !job->flat;
    struct axis_profile profile = soon ? job->profile : trace_start_profile(job);
    profile.measured_curvature = last;
    if (last) profile.independent = job->independent;
    struct section_ratio ratio;
    struct polyline_set even, inside;
    polyline_set_init(&even);
    polyline_set_init(&inside);
    /* the piece that is missing up to a face follows the density, and not only the tangent of the end */
    if (last) polylines_reach_faces(lines, job->v, job->o->eps_d, TRACE_END_DIAMETERS * job->diameter);
    status s = polylines_resample(lines, &even, err);
    struct shape_measure measure;
    const struct flat_fit fit = {job->v,    job->diameter, soon ? N_LAST_FIT : N_FIT, TRACE_MIN_PIECE,
                                 job->pool, &job->inner,   last ? &measure : NULL,    job->independent < 1.0};
    if (s == STATUS_OK) s = polylines_fit_flat(&even, &fit, &profile, &ratio, err);
    if (!last) job->flat = even.shape != NULL;
    if (s == STATUS_OK)
        s = polylines_keep_inside(&even, job->v->n, job->o->min_vertex, &inside, job->report->n_short_dropped, err);
    if (s == STATUS_OK) s = drop_weak(job, &profile, &inside, err);
    if (s == STATUS_OK) {
        trace_state_profile(job, &profile);
        job->report->axis_ratio = ratio.mean;
        job->report->axis_ratio_spread = ratio.sd;
        polyline_set_release(lines);
        *lines = inside;
        polyline_set_init(&inside);
    }
    polyline_set_release(&even);
    polyline_set_release(&inside);
    return s;
}

/* Cuts lines at kinks, where they change to another fiber; in the last pass also removes ends that lie in other
 * fibers. Ends of fibers so thin that voxels are interpolated must lie deeper in others: the directions that they are
 * compared with are off by 19 degrees in the mean there, and the lines by 7. */
static status straighten(struct trace_job *job, struct polyline_set *lines, bool last, size_t min_vertex,
                         struct error *err)
{
    struct polyline_set out;
    size_t n_cut;
    const struct disagreement_option trim = {TRACE_DISAGREEMENT_RAD,
                                             (size_t)(TRACE_END_DIAMETERS * job->diameter + 0.5), min_vertex, job->pool,
                                             job->independent < 1.0 ? TOUCHING : 0.0};
    polyline_set_init(&out);
    status s = polylines_cut_kinks(lines, job->diameter, OVER_USUAL_TURN, min_vertex, last, &out, &n_cut, err);
    if (s == STATUS_OK) {
        polyline_set_release(lines);
        *lines = out;
        polyline_set_init(&out);
    }
    if (s == STATUS_OK && last) s = polylines_trim_disagreeing(lines, job->d, &trim, &out, err);
    if (s == STATUS_OK && last) {
        polyline_set_release(lines);
        *lines = out;
        polyline_set_init(&out);
    }
    polyline_set_release(&out);
    return s;
}

status trace_lines(struct trace_job *job, struct polyline_set *lines, struct error *err)
{
    struct polyline_set part[3];
    struct join_counts counts = {0};
    for (int i = 0; i < 3; i++) polyline_set_init(&part[i]);
    status s = trace_chains(job, &part[0], err);
    trace_enter_part(job, 0.12, 0.14);
    if (s == STATUS_OK) s = trace_repair(job, &part[0], false, 0.0, &part[1], &counts, err);
    for (int round = 0; round < N_REPAIR && s == STATUS_OK; round++) { /* grow and join, then cut wrong parts */
        const double from = 0.14 + 0.2 * round / N_REPAIR;
        trace_enter_part(job, from, from + 0.14 / N_REPAIR);
        s = trace_center(job, &part[1], N_CENTER, err);
        if (s == STATUS_OK) s = trace_repair(job, &part[1], true, 0.0, &part[2], &counts, err);
        trace_enter_part(job, from + 0.14 / N_REPAIR, from + 0.2 / N_REPAIR);
        if (s == STATUS_OK) s = trace_center(job, &part[2], N_CENTER, err);
        if (s == STATUS_OK) s = trace_repair(job, &part[2], false, 0.0, &part[1], &counts, err);
    }
    if (s == STATUS_OK) s = trace_repair(job, &part[1], true, 0.0, &part[0], &counts, err);
    if (s == STATUS_OK) {
        trace_classify(&part[0]); /* from classes of subvolumes to axis classes */
        trace_enter_part(job, 0.34, 0.35);
        s = smooth_and_drop(job, &part[0], lines, err);
    }
    trace_enter_part(job, 0.35, 0.4);
    if (s == STATUS_OK) s = trace_center(job, lines, N_CENTER, err);
    trace_enter_part(job, 0.4, 0.5);
    if (s == STATUS_OK) s = fit_axes(job, lines, false, err);
    if (s == STATUS_OK) s = straighten(job, lines, false, TRACE_MIN_PIECE, err);
    trace_enter_part(job, 0.5, 0.52);
    if (s == STATUS_OK) s = trace_leftover(job, lines, err);
    /* lines on the fibers' axes are easier to distinguish and to join, and their radii are known */
    if (s == STATUS_OK) s = trace_repair(job, lines, true, TOUCHING, &part[1], &counts, err);
    trace_enter_part(job, 0.52, 0.54);
    if (s == STATUS_OK) s = smooth_and_drop(job, &part[1], &part[2], err);
    if (s == STATUS_OK) s = trace_repair(job, &part[2], true, TOUCHING, lines, &counts, err);
    job->report->n_gap_bridged = counts.n_gap_bridged;
    job->report->n_joined = counts.n_joined;
    for (int i = 0; i < 3; i++) polyline_set_release(&part[i]);
    return s;
}

/* Where fibers are so thin that voxels are interpolated, and where they are hollow and traced in the scan's own voxels,
 * looks once more at the material that no line explains: cuts have freed fibers that others had grown into, and lines
 * on them keep the others from growing back. Flat fibers are left alone, because their sections are not known any
 * more. */
static status look_again(struct trace_job *job, struct polyline_set *lines, struct error *err)
{
    const size_t n_before = lines->n_line;
    struct join_counts counts = {.n_gap_bridged = job->report->n_gap_bridged, .n_joined = job->report->n_joined};
    struct polyline_set out;
    const bool hollow = job->hollow && job->report->trace_edge_voxel == 1.0;
    if (!(hollow || job->independent < 1.0) || job->flat) return STATUS_OK;
    status s = trace_leftover(job, lines, err);
    if (s != STATUS_OK || lines->n_line == n_before) return s;
    polyline_set_init(&out);
    s = trace_repair(job, lines, false, TOUCHING, &out, &counts, err);
    *lines = out;
    job->report->n_gap_bridged = counts.n_gap_bridged;
    job->report->n_joined = counts.n_joined;
    return s;
}

/* One round of the last repair: fits the lines by n_round rounds, cuts them where they change to another fiber, and
 * lets the ends that this frees grow and join. first: looks again before they grow. *n_join: number of joins. */
static status settle_once(struct trace_job *job, struct polyline_set *lines, int n_round, bool first, size_t *n_join,
                          struct error *err)
{
    const struct reconstruct_report *r = job->report;
    const size_t n_before = r->n_gap_bridged + r->n_joined;
    job->profile.at_rest = true;
    status s = trace_center(job, lines, n_round, err);
    if (s == STATUS_OK) s = straighten(job, lines, true, TRACE_MIN_PIECE, err);
    if (s == STATUS_OK && first) s = look_again(job, lines, err);
    if (s == STATUS_OK) s = trace_join(job, lines, true, err);
    *n_join = r->n_gap_bridged + r->n_joined - n_before;
    return s;
}

/* Finds whether another round may join fibers that are in pieces. Lines of a scan that does not resolve its fibers
 * are left alone, and so are flat fibers: fitted as discs, they would get second lines at their sides. */
static status has_lost_ends(const struct trace_job *job, const struct polyline_set *lines, bool *lost,
                            struct error *err)
{
    struct trace_kinds kinds;
    status s = trace_find_kinds(lines, job->report->radius_spread, &kinds, err);
    const double n_lost = (double)polylines_count_lost_ends(lines, job->v, job->o->eps_d, 0.5 * job->diameter);
    const double share = n_lost / (2.0 * (double)lines->n_line + 1.0);
    const bool fits = !job->flat && kinds.spread <= TRACE_MOST_SPREAD;
    *lost = fits && share > LOST_SHARE && (share < MOST_LOST_SHARE || job->independent < 1.0);
    return s;
}

status trace_settle(struct trace_job *job, struct polyline_set *lines, struct error *err)
{
    size_t n_join;
    trace_enter_part(job, 0.54, TRACE_SETTLED_END);
    return settle_once(job, lines, N_CENTER, true, &n_join, err);
}

/* Where fibers have two diameters, some thick ones hold two lines, whose radii have grown since they were compared
 * last: removes the shorter one, and lets the other move to the middle. */
static status merge_within(struct trace_job *job, struct polyline_set *lines, struct error *err)
{
    struct trace_kinds kinds;
    struct join_counts counts = {0};
    struct polyline_set out;
    size_t n_join;
    status s = trace_find_kinds(lines, job->report->radius_spread, &kinds, err);
    if (s != STATUS_OK || !(kinds.thin_diameter > 0.0)) return s;
    const size_t *n = job->v->n;
    const struct duplicate_option one = {{n[0], n[1], n[2]}, job->diameter, TOUCHING, job->pool};
    polyline_set_init(&out);
    s = polylines_remove_duplicates(lines, &one, TRACE_MIN_PIECE, &out, &counts, err);
    polyline_set_release(lines);
    *lines = out;
    return s == STATUS_OK && counts.n_duplicate > 0 ? settle_once(job, lines, N_SETTLE_FIT, false, &n_join, err) : s;
}

status trace_finish(struct trace_job *job, struct polyline_set *lines, struct error *err)
{
    size_t n_join = 0;
    const int n_settle = job->independent < 1.0 ? N_SETTLE_THIN : N_SETTLE;
    trace_enter_part(job, 0.54, TRACE_SETTLED_END);
    status s = settle_once(job, lines, N_CENTER, true, &n_join, err);
    if (s == STATUS_OK) s = merge_within(job, lines, err);
    for (int k = 0; k < n_settle && s == STATUS_OK; k++) {
        bool lost = false;
        s = has_lost_ends(job, lines, &lost, err);
        if (s != STATUS_OK || !lost) break;
        if (k > 0 && (double)n_join <= JOINED_SHARE * (double)lines->n_line) break; /* nothing moves any more */
        s = settle_once(job, lines, N_SETTLE_FIT, false, &n_join, err);
    }
    trace_enter_part(job, TRACE_SETTLED_END, TRACE_FINISHED_END);
    if (s == STATUS_OK) s = fit_axes(job, lines, true, err);
    if (s == STATUS_OK) s = straighten(job, lines, true, job->o->min_vertex, err);
    return s == STATUS_OK ? trace_join(job, lines, false, err) : s;
}

status trace_refit(struct trace_job *job, struct polyline_set *lines, struct error *err)
{
    return fit_axes(job, lines, true, err);
}
