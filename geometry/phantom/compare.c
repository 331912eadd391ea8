#include "geometry/phantom/compare.h"
#include "base/angle.h"

#include "geometry/phantom/segment_grid.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

static const double along_limit = 0.86602540378443865; /* cosine of 30 degrees */

/* One voxel of a fiber, and the place that it matches in the other set. */
struct sample {
    uint32_t fiber;              /* number of its own fiber */
    uint32_t other;              /* number of the matched fiber; NONE if unmatched */
    uint32_t voxel;              /* matched place on the other fiber, in voxels from its start */
    uint32_t piece, other_piece; /* parts between faces, of its own and the other fiber */
    float distance_m, cosine;
};

static const uint32_t NONE = UINT32_MAX;

struct walk {
    struct sample *sample;
    size_t n;
    double tensor[9];
    size_t n_tensor, n_piece;
};

struct job {
    const struct fiber_set *own, *other;
    const struct segment_grid *grid;
    const double *tile_m;
    const struct compare_option *o;
    const double *arc_m;                 /* arc length at the vertices of the other set */
    const uint32_t *piece, *other_piece; /* one per vertex */
    bool own_is_truth;
    double limit_m;
};

static bool near_face(const struct job *j, const double p[3])
{
    for (int a = 0; a < 2; a++) {
        double x = p[a] - j->tile_m[a] * floor(p[a] / j->tile_m[a]);
        if (x < j->o->margin_m || x > j->tile_m[a] - j->o->margin_m) return true;
    }
    return false;
}

static void add_sample(const struct job *j, size_t i_fiber, size_t i_vertex, const double p[3], const double d[3],
                       struct walk *w)
{
    if (near_face(j, p)) return;
    struct segment_hit hit;
    struct sample s = {.fiber = (uint32_t)i_fiber, .other = NONE, .piece = j->piece[i_vertex]};
    double limit_m = j->own_is_truth ? (double)j->own->radius_m[i_fiber] : j->limit_m;
    if (segment_grid_nearest(j->grid, p, limit_m, &hit) &&
        (j->own_is_truth || hit.distance_m <= (double)j->other->radius_m[hit.i_fiber])) {
        s.other = (uint32_t)hit.i_fiber;
        s.other_piece = j->other_piece[hit.i_vertex];
        s.distance_m = (float)hit.distance_m;
        s.cosine = (float)fmin(1.0, fabs(d[0] * hit.direction[0] + d[1] * hit.direction[1] + d[2] * hit.direction[2]));
        double arc = j->arc_m[hit.i_vertex] + hit.t * (j->arc_m[hit.i_vertex + 1] - j->arc_m[hit.i_vertex]);
        s.voxel = (uint32_t)(arc / j->o->voxel_size_m);
    }
    for (int k = 0; k < 9; k++) w->tensor[k] += d[k / 3] * d[k % 3];
    w->n_tensor++;
    w->sample[w->n++] = s;
}

/* A sample lies in the middle of each voxel of arc length. */
static void walk_fiber(const struct job *j, size_t i, struct walk *w)
{
    const struct fiber_set *f = j->own;
    double step = j->o->voxel_size_m, to_next = 0.5 * step;
    for (size_t v = f->first_vertex[i]; v + 1 < f->first_vertex[i + 1]; v++) {
        double a[3], d[3], length = 0.0;
        for (size_t k = 0; k < 3; k++) {
            a[k] = f->position_m[3 * v + k];
            d[k] = (double)f->position_m[3 * v + 3 + k] - a[k];
            length += d[k] * d[k];
        }
        length = sqrt(length);
        if (!(length > 0.0)) continue;
        for (int k = 0; k < 3; k++) d[k] /= length;
        for (; to_next <= length; to_next += step) {
            double p[3] = {a[0] + to_next * d[0], a[1] + to_next * d[1], a[2] + to_next * d[2]};
            add_sample(j, i, v, p, d, w);
        }
        to_next -= length;
    }
}

static double *arc_lengths(const struct fiber_set *f)
{
    double *arc = calloc(f->n_vertex + 1, sizeof *arc);
    if (arc == NULL) return NULL;
    for (size_t i = 0; i < f->n_fiber; i++)
        for (size_t v = f->first_vertex[i] + 1; v < f->first_vertex[i + 1]; v++) {
            double d2 = 0.0;
            for (size_t k = 0; k < 3; k++) {
                double d = (double)f->position_m[3 * v + k] - (double)f->position_m[3 * v - 3 + k];
                d2 += d * d;
            }
            arc[v] = arc[v - 1] + sqrt(d2);
        }
    return arc;
}

static bool in_tile(const float p[3], const double corner[2], const double tile_m[2], double beyond)
{
    for (int a = 0; a < 2; a++)
        if (!((double)p[a] >= corner[a] - beyond && (double)p[a] <= corner[a] + tile_m[a] + beyond)) return false;
    return true;
}

/* The scan is one tile and ends at its faces, so a fiber that leaves it by more than its radius is cut at the face.
 * Returns the number of the piece for each vertex; *n_piece is the number of pieces. */
static uint32_t *cut_at_faces(const struct fiber_set *f, const double tile_m[2], size_t *n_piece)
{
    uint32_t *piece = malloc((f->n_vertex + 1) * sizeof *piece);
    *n_piece = 0;
    for (size_t i = 0; i < f->n_fiber && piece != NULL; i++) {
        double corner[2] = {NAN, NAN};       /* of the tile in which the fiber is */
        size_t outside = f->first_vertex[i]; /* the first vertex since the fiber left that tile */
        for (size_t v = f->first_vertex[i]; v < f->first_vertex[i + 1]; v++) {
            const float *p = f->position_m + 3 * v;
            if (!in_tile(p, corner, tile_m, (double)f->radius_m[i])) {
                for (int a = 0; a < 2; a++) corner[a] = tile_m[a] * floor((double)p[a] / tile_m[a]);
                for (; outside < v; outside++) piece[outside] = (uint32_t)*n_piece;
                ++*n_piece;
            }
            piece[v] = (uint32_t)(*n_piece - 1);
            if (in_tile(p, corner, tile_m, 0.0)) outside = v + 1;
        }
    }
    return piece;
}

static double largest_radius_m(const struct fiber_set *f)
{
    double r = 0.0;
    for (size_t i = 0; i < f->n_fiber; i++) r = fmax(r, (double)f->radius_m[i]);
    return r;
}

static status walk_all(const struct fiber_set *own, const struct fiber_set *other, const struct fiber_set *truth,
                       const struct compare_option *o, struct walk *w, struct error *err)
{
    size_t n_other_piece;
    uint32_t *piece = cut_at_faces(own, truth->tile_size_m, &w->n_piece);
    uint32_t *other_piece = cut_at_faces(other, truth->tile_size_m, &n_other_piece);
    struct segment_grid *grid = NULL;
    double *arc = arc_lengths(other), limit_m = largest_radius_m(truth);
    size_t n = (size_t)(fiber_set_length_m(own) / o->voxel_size_m) + own->n_fiber + 1;
    w->sample = calloc(n, sizeof *w->sample);
    status st = STATUS_OK;
    if (arc == NULL || w->sample == NULL || piece == NULL || other_piece == NULL) {
        st = error_set(err, STATUS_NO_MEMORY, "cannot compare fibers: out of memory");
        goto out;
    }
    st = segment_grid_new(other, truth->tile_size_m, limit_m, &grid, err);
    if (st != STATUS_OK) goto out;
    struct job job = {own, other, grid, truth->tile_size_m, o, arc, piece, other_piece, own == truth, limit_m};
    for (size_t i = 0; i < own->n_fiber; i++) walk_fiber(&job, i, w);
out:
    segment_grid_free(grid);
    free(arc);
    free(piece);
    free(other_piece);
    return st;
}

static int by_float(const void *a, const void *b)
{
    float x = *(const float *)a, y = *(const float *)b;
    return x < y ? -1 : x > y;
}

/* Smallest value that 95 % of the values do not exceed. Sorts the values. */
static double percentile_95(float *value, size_t n)
{
    if (n == 0) return NAN;
    qsort(value, n, sizeof *value, by_float);
    size_t at = (size_t)ceil(0.95 * (double)n);
    return (double)value[at > 0 ? at - 1 : 0];
}

/* Sorts by true fiber, place, distance and found fiber, so that the nearest match of a voxel comes first. */
static int by_place(const void *a, const void *b)
{
    const struct sample *x = a, *y = b;
    if (x->other != y->other) return x->other < y->other ? -1 : 1;
    if (x->voxel != y->voxel) return x->voxel < y->voxel ? -1 : 1;
    if (x->distance_m != y->distance_m) return x->distance_m < y->distance_m ? -1 : 1;
    return x->fiber < y->fiber ? -1 : x->fiber > y->fiber;
}

static int by_pair(const void *a, const void *b)
{
    const struct sample *x = a, *y = b;
    if (x->piece != y->piece) return x->piece < y->piece ? -1 : 1;
    if ((x->other == NONE) != (y->other == NONE)) return x->other == NONE ? 1 : -1;
    return x->other_piece < y->other_piece ? -1 : x->other_piece > y->other_piece;
}

/* Computes the figures of the found samples. Changes their order. */
static status from_found(const struct fiber_set *truth, const struct fiber_set *found, double voxel_size_m,
                         struct walk *w, struct compare_report *r, struct error *err)
{
    float *distance = calloc(w->n + 1, sizeof *distance), *angle = calloc(w->n + 1, sizeof *angle);
    size_t n = 0, n_second = 0;
    double sum2 = 0.0, angle_sum = 0.0, ratio_sum = 0.0, ratio2_sum = 0.0;
    if (distance == NULL || angle == NULL) {
        free(distance);
        free(angle);
        return error_set(err, STATUS_NO_MEMORY, "cannot compare fibers: out of memory");
    }
    qsort(w->sample, w->n, sizeof *w->sample, by_place);
    uint32_t nearest = NONE;
    for (size_t i = 0; i < w->n; i++) {
        const struct sample *s = &w->sample[i];
        if (s->other == NONE) continue;
        if (i == 0 || s[-1].other != s->other || s[-1].voxel != s->voxel) nearest = s->fiber;
        n_second += s->fiber != nearest;
        distance[n] = (float)((double)s->distance_m / voxel_size_m);
        angle[n] = (float)angle_to_deg(acos((double)s->cosine));
        sum2 += (double)distance[n] * (double)distance[n];
        angle_sum += (double)angle[n];
        double ratio = (double)found->radius_m[s->fiber] / (double)truth->radius_m[s->other] - 1.0;
        ratio_sum += ratio;
        ratio2_sum += ratio * ratio;
        n++;
    }
    r->center_precision = w->n > 0 ? (double)(n - n_second) / (double)w->n : NAN;
    r->centerline_rms_voxel = n > 0 ? sqrt(sum2 / (double)n) : NAN;
    r->centerline_p95_voxel = percentile_95(distance, n);
    r->direction_mean_deg = n > 0 ? angle_sum / (double)n : NAN;
    r->direction_p95_deg = percentile_95(angle, n);
    r->radius_bias_percent = n > 0 ? 100.0 * ratio_sum / (double)n : NAN;
    r->radius_rms_percent = n > 0 ? 100.0 * sqrt(ratio2_sum / (double)n) : NAN;
    free(distance);
    free(angle);
    return STATUS_OK;
}

/* Fragments and merges: pairs (found, true) with enough samples. */
static status count_fragments(const struct walk *of_truth, struct walk *w, size_t run_min, struct compare_report *r,
                              struct error *err)
{
    uint32_t *seen = calloc(of_truth->n_piece, sizeof *seen); /* fragments of each true fiber */
    uint32_t *length = calloc(of_truth->n_piece, sizeof *length);
    size_t n_pair = 0, n_with_pair = 0, n_seen = 0;
    uint32_t last_found = NONE;
    if (seen == NULL || length == NULL) {
        free(seen);
        free(length);
        return error_set(err, STATUS_NO_MEMORY, "cannot compare fibers: out of memory");
    }
    for (size_t i = 0; i < of_truth->n; i++) length[of_truth->sample[i].piece]++;
    for (size_t i = 0; i < of_truth->n_piece; i++) r->n_true_piece += length[i] >= run_min;
    qsort(w->sample, w->n, sizeof *w->sample, by_pair);
    for (size_t i = 0, end; i < w->n; i = end) {
        const struct sample *s = &w->sample[i];
        for (end = i + 1; end < w->n && by_pair(s, &w->sample[end]) == 0; end++) {
        }
        if (s->other == NONE || end - i < run_min || length[s->other_piece] < run_min) continue;
        n_pair++;
        if (s->piece != last_found) n_with_pair++;
        last_found = s->piece;
        n_seen += seen[s->other_piece]++ == 0;
    }
    r->merges_per_fiber = (double)(n_pair - n_with_pair) / (double)r->n_true_piece;
    r->fragments_per_fiber = n_seen > 0 ? (double)n_pair / (double)n_seen : NAN;
    double square = 0.0;
    for (size_t i = 0; i < of_truth->n_piece; i++)
        if (seen[i] > 0)
            square += ((double)seen[i] - r->fragments_per_fiber) * ((double)seen[i] - r->fragments_per_fiber);
    r->fragments_se = n_seen > 1 ? sqrt(square / ((double)n_seen * (double)(n_seen - 1))) : NAN;
    r->missed = 1.0 - (double)n_seen / (double)r->n_true_piece;
    free(seen);
    free(length);
    return STATUS_OK;
}

/* Computes the figures of the true samples, which are still in order along their fibers. */
static void from_truth(const struct walk *w, struct compare_report *r)
{
    size_t n_match = 0, n_along = 0, n_gap = 0, n_fiber = 0;
    double run_sum = 0.0, lost2 = 0.0, lost_length = 0.0, length2 = 0.0; /* squares and products of the fibers */
    for (size_t i = 0, end; i < w->n; i = end) {
        size_t longest = 0, run = 0, since_match = 0, n_before = n_match;
        bool any = false;
        for (end = i; end < w->n && w->sample[end].fiber == w->sample[i].fiber; end++) {
            const struct sample *s = &w->sample[end];
            bool match = s->other != NONE;
            n_match += match;
            n_along += match && (double)s->cosine >= along_limit;
            n_gap += match && any && since_match > 0;
            since_match = match ? 0 : since_match + 1;
            any = any || match;
            run = !match ? 0 : end > i && s[-1].other == s->other ? run + 1 : 1;
            longest = run > longest ? run : longest;
        }
        const double length = (double)(end - i), lost = length - (double)(n_match - n_before);
        lost2 += lost * lost;
        lost_length += lost * length;
        length2 += length * length;
        run_sum += (double)longest / length;
        n_fiber++;
    }
    r->center_recall = w->n > 0 ? (double)n_match / (double)w->n : NAN;
    /* of a ratio of sums over fibers */
    const double share = 1.0 - r->center_recall, square = lost2 - 2.0 * share * lost_length + share * share * length2;
    r->center_recall_se =
        n_fiber > 1 ? sqrt(fmax(0.0, square) * (double)n_fiber / (double)(n_fiber - 1)) / (double)w->n : NAN;
    r->length_recovered = w->n > 0 ? (double)n_along / (double)w->n : NAN;
    r->gaps_per_fiber = n_fiber > 0 ? (double)n_gap / (double)n_fiber : NAN;
    r->longest_run = n_fiber > 0 ? run_sum / (double)n_fiber : NAN;
}

static double mean_diameter_voxel(const struct fiber_set *f, const double *arc, double voxel_size_m)
{
    double sum = 0.0, length = 0.0;
    for (size_t i = 0; i < f->n_fiber; i++) {
        double own = arc[f->first_vertex[i + 1] - 1];
        sum += own * 2.0 * (double)f->radius_m[i];
        length += own;
    }
    return sum / length / voxel_size_m;
}

status compare_fibers(const struct fiber_set *truth, const struct fiber_set *found, const struct compare_option *o,
                      struct compare_report *report, struct error *err)
{
    struct walk of_truth = {0}, of_found = {0};
    struct compare_report r = {0};
    double *arc = NULL;
    if (!(o->voxel_size_m > 0.0) || !(o->margin_m >= 0.0))
        return error_set(err, STATUS_INVALID, "the voxel size must be positive and the margin not negative");
    status st = fiber_set_validate(truth, err);
    if (st != STATUS_OK) return error_prefix(err, st, "true fibers");
    struct fiber_set tiled = *found; /* shares the arrays of found */
    memcpy(tiled.tile_size_m, truth->tile_size_m, sizeof tiled.tile_size_m);
    st = fiber_set_validate(&tiled, err);
    if (st != STATUS_OK) return error_prefix(err, st, "found fibers");
    st = walk_all(truth, found, truth, o, &of_truth, err);
    if (st == STATUS_OK) st = walk_all(found, truth, truth, o, &of_found, err);
    if (st != STATUS_OK) goto out;
    arc = arc_lengths(truth);
    if (arc == NULL) {
        st = error_set(err, STATUS_NO_MEMORY, "cannot compare fibers: out of memory");
        goto out;
    }
    r.n_true = truth->n_fiber;
    r.n_found = found->n_fiber;
    r.length_true_m = fiber_set_length_m(truth);
    r.length_found_m = fiber_set_length_m(found);
    r.fiber_diameter_voxel = mean_diameter_voxel(truth, arc, o->voxel_size_m);
    double frobenius2 = 0.0;
    for (int k = 0; k < 9; k++) {
        double d = of_truth.tensor[k] / (double)of_truth.n_tensor - of_found.tensor[k] / (double)of_found.n_tensor;
        frobenius2 += d * d;
    }
    r.orientation_frobenius = sqrt(frobenius2);
    from_truth(&of_truth, &r);
    st = from_found(truth, found, o->voxel_size_m, &of_found, &r, err);
    if (st == STATUS_OK)
        st = count_fragments(&of_truth, &of_found, (size_t)ceil(o->run_min_voxel > 0.0 ? o->run_min_voxel : 5.0), &r,
                             err);
    if (st == STATUS_OK) *report = r;
out:
    free(arc);
    free(of_truth.sample);
    free(of_found.sample);
    return st;
}
