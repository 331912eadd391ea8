#include "geometry/fibers/lines/kinks.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>

static const double QUANTILE = 0.95, LEAST_LIMIT = 1.2; /* LEAST_LIMIT in radians per diameter */
/* The limit is lower near ends, where lines often deviate and a cut costs only a few vertices. */
static const double END_DIAMETERS = 1.5, END_SHARE = 0.7;

/* Number of vertices on either side over which the turn is measured. */
static size_t span(double diameter_voxel) { return (size_t)fmax(2.0, 0.5 * diameter_voxel + 0.5); }

/* Angle between the chords to and from vertex i, per voxel of their mean length; 0 near the ends. */
static float turn_at(const struct polyline_set *p, size_t line, size_t i, size_t reach)
{
    if (i < p->first[line] + reach || i + reach >= p->first[line + 1]) return 0.0f;
    const float *x = p->vertex[i - reach], *y = p->vertex[i], *z = p->vertex[i + reach];
    float uu = 0.0f, ww = 0.0f, uw = 0.0f;
    for (int a = 0; a < 3; a++) {
        float u = y[a] - x[a], w = z[a] - y[a];
        uu += u * u;
        ww += w * w;
        uw += u * w;
    }
    if (!(uu > 0.0f && ww > 0.0f)) return 0.0f;
    return acosf(fmaxf(-1.0f, fminf(1.0f, uw / sqrtf(uu * ww)))) / (0.5f * (sqrtf(uu) + sqrtf(ww)));
}

static int ascending(const void *a, const void *b)
{
    float x = *(const float *)a, y = *(const float *)b;
    return (x > y) - (x < y);
}

status polylines_kink_limit(const struct polyline_set *lines, double diameter_voxel, double over_usual,
                            double *limit_per_voxel, struct error *err)
{
    float *turn = malloc((lines->n_vertex + 1) * sizeof *turn);
    size_t n = 0, reach = span(diameter_voxel);
    if (turn == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot look for kinks: out of memory");
    for (size_t l = 0; l < lines->n_line; l++)
        for (size_t i = lines->first[l] + reach; i + reach < lines->first[l + 1]; i++)
            turn[n++] = turn_at(lines, l, i, reach);
    qsort(turn, n, sizeof *turn, ascending);
    double usual = n > 0 ? (double)turn[(size_t)(QUANTILE * (double)(n - 1))] : 0.0;
    *limit_per_voxel = fmax(LEAST_LIMIT / diameter_voxel, over_usual * usual);
    free(turn);
    return STATUS_OK;
}

/* Turns from which on the vertices of a line are kinks. */
struct kink_limit {
    double middle, end; /* radians per voxel; end: within `near` vertices of an end */
    size_t near, reach;
};

static bool is_kink(const struct polyline_set *p, size_t line, size_t i, const struct kink_limit *k)
{
    bool near_end = i < p->first[line] + k->near || i + k->near >= p->first[line + 1];
    return (double)turn_at(p, line, i, k->reach) > (near_end ? k->end : k->middle);
}

/* Marks the vertices within reach of a kink, or of a run of kinks only the one with the largest turn. */
static void mark_kinks(const struct polyline_set *p, size_t line, const struct kink_limit *k, bool only_sharpest,
                       bool *mark)
{
    size_t sharpest = SIZE_MAX;
    for (size_t i = p->first[line] + k->reach; i + k->reach < p->first[line + 1]; i++) {
        bool kink = is_kink(p, line, i, k);
        for (size_t m = i - k->reach; kink && !only_sharpest && m <= i + k->reach; m++) mark[m] = true;
        if (!kink || !only_sharpest) {
            sharpest = SIZE_MAX;
            continue;
        }
        if (sharpest != SIZE_MAX && turn_at(p, line, i, k->reach) <= turn_at(p, line, sharpest, k->reach)) continue;
        if (sharpest != SIZE_MAX) mark[sharpest] = false;
        mark[i] = true;
        sharpest = i;
    }
}

status polylines_cut_kinks(const struct polyline_set *lines, double diameter_voxel, double over_usual,
                           size_t min_vertex, bool only_sharpest, struct polyline_set *result, size_t *n_cut,
                           struct error *err)
{
    struct kink_limit k = {.near = (size_t)(END_DIAMETERS * diameter_voxel + 0.5), .reach = span(diameter_voxel)};
    bool *kink = calloc(lines->n_vertex + 1, sizeof *kink);
    *n_cut = 0;
    if (kink == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot look for kinks: out of memory");
    status s = polylines_kink_limit(lines, diameter_voxel, over_usual, &k.middle, err);
    k.end = END_SHARE * k.middle;
    for (size_t l = 0; l < lines->n_line && s == STATUS_OK; l++) {
        size_t begin = lines->first[l], end = lines->first[l + 1], piece = begin;
        mark_kinks(lines, l, &k, only_sharpest, kink);
        for (size_t i = begin; i <= end && s == STATUS_OK; i++) {
            if (i < end && !kink[i]) continue;
            if (i - piece >= min_vertex) s = polyline_add_part(result, lines, l, piece, i, err);
            *n_cut += i < end;
            piece = i + 1;
        }
    }
    free(kink);
    return s;
}
