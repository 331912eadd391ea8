/* Woven cloth: the paths of its yarns from the draft, with crimp and disorder. */
#include "base/rng.h"
#include "geometry/cloth/cloth_work.h"

#include <math.h>
#include <stdlib.h>

/* A path may bend until its radius of curvature is this share of the yarn's half height; fibers on the inner side
 * would run backwards beyond. */
static const double SHARPEST_BEND = 0.5;
/* Range of the cover that follows from given threads per cm. */
static const double LEAST_COVER = 0.2, MOST_COVER = 1.7;

/* Length of the longest waves of a yarn about its place, in yarns that it crosses. It is one length for all tiles,
 * so that disorder means the same cloth in each of them. */
static const double WAVE_YARNS = 16.0;

struct weave {
    struct cloth_work *w;
    double border_m[2][CLOTH_MAX_YARN + 1]; /* of the yarns' slots: wefts along y, warps along x */
    double nominal_tile_m[2];
    struct wave aside[2][CLOTH_MAX_YARN]; /* of each yarn, over its length */
    double disorder, crimp, compression;
};

static size_t kind_of(const struct cloth_description *d, int direction, size_t i)
{
    return d->order[direction][i % d->n_order[direction]];
}

static bool weft_over(const struct cloth_description *d, size_t i_weft, size_t i_warp)
{
    return !d->warp_over[i_weft % d->n_weft][i_warp % d->n_warp];
}

/* Edge of the tile across the yarns of a direction, and the borders of their slots (NULL: not wanted). number: NULL
 * for the description's own values. */
static double lay_out(const struct cloth_work *w, int direction, const double *number, double *border_m)
{
    const struct cloth_description *d = w->d;
    const struct kind_shape *kind = number == NULL ? w->nominal : w->kind;
    size_t n = d->n_yarn[direction];
    double cover = cloth_number_value(d, number, -1, direction == CLOTH_WARP ? "cover_warp" : "cover_weft"), sum = 0.0;
    for (size_t i = 0; i < n; i++) sum += 2.0 * kind[kind_of(d, direction, i)].half_m[0];
    if (isnan(cover)) cover = sum / ((double)n * 1e-2 / d->threads_per_cm[direction]);
    if (border_m == NULL) return sum / cover;
    border_m[0] = 0.0;
    for (size_t i = 0; i < n; i++)
        border_m[i + 1] = border_m[i] + 2.0 * kind[kind_of(d, direction, i)].half_m[0] / cover;
    return border_m[n];
}

static status check_threads(const struct cloth_work *w, int direction, double edge_m, struct error *err)
{
    const struct cloth_description *d = w->d;
    double sum = 0.0;
    if (!(d->threads_per_cm[direction] > 0.0)) return STATUS_OK;
    for (size_t i = 0; i < d->n_yarn[direction]; i++) sum += 2.0 * w->kind[kind_of(d, direction, i)].half_m[0];
    double cover = sum / edge_m;
    if (cover >= LEAST_COVER && cover <= MOST_COVER) return STATUS_OK;
    return error_set_field(
        err, STATUS_INVALID, direction == CLOTH_WARP ? CLOTH_FIELD_WARP_PER_CM : CLOTH_FIELD_WEFT_PER_CM,
        "%g threads per cm leave %.3g um for a yarn that is %.3g um wide: width over spacing must be "
        "between %g and %g",
        d->threads_per_cm[direction], 1e6 * edge_m / (double)d->n_yarn[direction],
        1e6 * sum / (double)d->n_yarn[direction], LEAST_COVER, MOST_COVER);
}

static status weave_lay_out(struct weave *v, struct error *err)
{
    struct cloth_work *w = v->w;
    status st = STATUS_OK;
    for (int direction = CLOTH_WEFT; direction <= CLOTH_WARP && st == STATUS_OK; direction++) {
        const struct rng_key key = {.seed = w->d->seed, .iteration = STREAM_DISORDER};
        int across = 1 - direction; /* wefts follow each other along y */
        double longest = (double)w->d->n_yarn[across] / WAVE_YARNS;
        w->set.tile_m[across] = lay_out(w, direction, w->number, v->border_m[direction]);
        v->nominal_tile_m[across] = lay_out(w, direction, NULL, NULL);
        w->spacing_m[across] = w->set.tile_m[across] / (double)w->d->n_yarn[direction];
        for (size_t i = 0; i < w->d->n_yarn[direction]; i++) {
            struct rng rng;
            rng_start(&rng, &key, (uint32_t)(2 * i + (size_t)direction), 0);
            wave_draw_band(&v->aside[direction][i], longest, longest, &rng);
        }
        st = check_threads(w, direction, w->set.tile_m[across], err);
    }
    v->disorder = work_number(w, "disorder");
    v->crimp = work_number(w, "crimp");
    v->compression = work_number(w, "compression");
    return st;
}

/* Place of a yarn across itself, at `along_m` on its way. Amplitudes beyond a quarter of the slot would make yarns
 * overtake each other, so they are bounded smoothly. */
static double place_m(const struct weave *v, int direction, size_t i, double along_m)
{
    const double *border = v->border_m[direction];
    double slot_m = border[i + 1] - border[i],
           off = v->disorder * wave_at(&v->aside[direction][i], along_m / v->w->set.tile_m[direction]);
    return border[i] + slot_m * (0.5 + 0.3 * tanh(off / 0.3));
}

/* Crossings of one yarn, in order along it; [n] repeats the first one tile later. */
struct crossings {
    size_t n;
    double at_m[CLOTH_MAX_YARN + 1], level_m[CLOTH_MAX_YARN + 1];
};

static void find_crossings(const struct weave *v, int direction, size_t i, struct crossings *c)
{
    const struct cloth_work *w = v->w;
    const struct cloth_description *d = w->d;
    int other = 1 - direction;
    double own_middle_m = 0.5 * (v->border_m[direction][i] + v->border_m[direction][i + 1]);
    double half_m = w->kind[kind_of(d, direction, i)].half_m[1];
    c->n = d->n_yarn[other];
    for (size_t j = 0; j < c->n; j++) {
        double distance_m = v->compression * (half_m + w->kind[kind_of(d, other, j)].half_m[1]);
        bool above = direction == CLOTH_WEFT ? weft_over(d, i, j) : !weft_over(d, j, i);
        double share = direction == CLOTH_WEFT ? 1.0 - v->crimp : v->crimp;
        c->at_m[j] = place_m(v, other, j, own_middle_m);
        c->level_m[j] = above ? share * distance_m : -share * distance_m;
    }
    c->at_m[c->n] = c->at_m[0] + w->set.tile_m[direction];
    c->level_m[c->n] = c->level_m[0];
}

/* Height of the yarn at `along_m`: level at each crossing and half a cosine between. */
static double level_m(const struct crossings *c, double tile_m, double along_m, size_t *j)
{
    if (along_m < c->at_m[0]) along_m += tile_m;
    while (*j + 1 < c->n && along_m >= c->at_m[*j + 1]) ++*j;
    if (along_m < c->at_m[*j]) *j = 0;
    while (*j + 1 < c->n && along_m >= c->at_m[*j + 1]) ++*j;
    double blend = 0.5 - 0.5 * cos(M_PI * (along_m - c->at_m[*j]) / (c->at_m[*j + 1] - c->at_m[*j]));
    return c->level_m[*j] + blend * (c->level_m[*j + 1] - c->level_m[*j]);
}

/* The cosine between levels h apart over a distance l has a curvature of at most h / 2 (pi / l)^2. */
static status check_bends(const struct weave *v, int direction, size_t i, const struct crossings *c, struct error *err)
{
    double half_m = v->w->kind[kind_of(v->w->d, direction, i)].half_m[1];
    for (size_t j = 0; j < c->n; j++) {
        double l_m = c->at_m[j + 1] - c->at_m[j], h_m = fabs(c->level_m[j + 1] - c->level_m[j]);
        double radius_m = h_m > 0.0 ? 2.0 * l_m * l_m / (M_PI * M_PI * h_m) : INFINITY;
        if (radius_m >= SHARPEST_BEND * half_m) continue;
        return error_set_field(
            err, STATUS_INVALID, CLOTH_FIELD_CRIMP,
            "this crimp cannot be: %s %zu would have to bend to a radius of %.3g um, and half of its "
            "height is %.3g um; yarns must be flatter, further apart, or the crimp shared otherwise",
            direction == CLOTH_WEFT ? "weft" : "warp", i, 1e6 * radius_m, 1e6 * half_m);
    }
    return STATUS_OK;
}

static status add_yarn(const struct weave *v, int direction, size_t i, struct error *err)
{
    struct cloth_work *w = v->w;
    int along = direction, across = 1 - direction;
    size_t kind = kind_of(w->d, direction, i), j = 0;
    struct crossings c;
    find_crossings(v, direction, i, &c);
    status st = check_bends(v, direction, i, &c, err);
    if (st != STATUS_OK) return st;
    struct yarn y = {.n = c.n * POINTS_PER_CROSSING,
                     .radius_m = w->kind[kind].radius_m,
                     .axis_class = (uint8_t)direction,
                     .cut = direction == CLOTH_WEFT ? CUT_FACE_X : CUT_FACE_Y,
                     .number = (uint32_t)(2 * i + (size_t)direction)};
    y.shift[along] = w->set.tile_m[along];
    y.point = calloc(y.n, sizeof *y.point);
    if (y.point == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot make the fibers: out of memory");
    for (size_t k = 0; k < y.n; k++) {
        double at_m = (double)k / (double)y.n * w->set.tile_m[along];
        y.point[k][along] = at_m;
        y.point[k][across] = place_m(v, direction, i, at_m);
        y.point[k][2] = level_m(&c, w->set.tile_m[along], at_m, &j);
    }
    st = yarn_fill(w, kind, &y, v->nominal_tile_m[along], err);
    free(y.point);
    return st;
}

/* Refuses a tile that is too large before its fibers are made. */
static status check_size(const struct weave *v, struct error *err)
{
    const struct cloth_work *w = v->w;
    size_t n_node = 0;
    for (int direction = CLOTH_WEFT; direction <= CLOTH_WARP; direction++)
        for (size_t i = 0; i < w->d->n_yarn[direction]; i++)
            n_node += yarn_nodes(w, kind_of(w->d, direction, i), v->nominal_tile_m[direction]);
    return work_has_room(w, n_node, err);
}

status cloth_weave(struct cloth_work *w, struct error *err)
{
    struct weave *v = calloc(1, sizeof *v);
    if (v == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot make the fibers: out of memory");
    v->w = w;
    status st = weave_lay_out(v, err);
    if (st == STATUS_OK) st = check_size(v, err);
    for (int direction = CLOTH_WEFT; direction <= CLOTH_WARP; direction++)
        for (size_t i = 0; i < w->d->n_yarn[direction] && st == STATUS_OK; i++) st = add_yarn(v, direction, i, err);
    if (st == STATUS_OK && w->d->structure == CLOTH_VELVET) {
        double ground_m = v->compression * 2.0 * w->kind[0].half_m[1];
        st = cloth_pile(w, v->border_m[CLOTH_WARP], v->border_m[CLOTH_WEFT], ground_m, err);
    }
    free(v);
    return st;
}
