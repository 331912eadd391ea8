/* Plain jersey: x = t + a sin 2t, y = h cos t, z = d cos 2t, in units of a wale's width / 2 pi (a smooth form of
 * Peirce's loop). Heads and feet are on one side, legs on the other. Courses are 5 units apart, so each head hangs over
 * the legs of the next course. */
#include "base/rng.h"
#include "geometry/cloth/cloth_work.h"

#include <math.h>
#include <stdlib.h>

enum { POINTS_PER_LOOP = 120 };
static const double WIDE = 1.5, HIGH = 4.0, DEEP = 1.0, COURSE = 5.0;
/* Length of the longest waves of a course about its place, in wales: one length for all tiles. */
static const double WAVE_WALES = 4.0;
/* Radius of the round yarn, in units, at cover 1. */
static const double YARN = 0.8;

static size_t kind_of(const struct cloth_description *d, size_t course)
{
    return d->order[CLOTH_WEFT][course % d->n_order[CLOTH_WEFT]];
}

/* The loop's unit of length follows from the mean section of the yarns. */
static double unit_m(const struct cloth_work *w, const struct kind_shape *kind, const double *number)
{
    size_t n = w->d->n_yarn[CLOTH_WEFT];
    double sum = 0.0;
    for (size_t i = 0; i < n; i++) sum += kind[kind_of(w->d, i)].outer_m;
    return sum / (double)n / (YARN * cloth_number_value(w->d, number, -1, "cover"));
}

static void course_path(const struct cloth_work *w, size_t i, double unit, struct yarn *y)
{
    const struct rng_key key = {.seed = w->d->seed, .iteration = STREAM_DISORDER};
    double disorder = work_number(w, "disorder"), deep = DEEP * work_number(w, "compression");
    double longest = (double)w->d->n_yarn[CLOTH_WARP] / WAVE_WALES;
    struct wave aside[2];
    struct rng rng;
    rng_start(&rng, &key, (uint32_t)i, 0);
    for (int a = 0; a < 2; a++) wave_draw_band(&aside[a], longest, longest, &rng);
    for (size_t k = 0; k < y->n; k++) {
        double t = 2.0 * M_PI * (double)k / POINTS_PER_LOOP, s = (double)k / (double)y->n;
        y->point[k][0] = (t + WIDE * sin(2.0 * t) + disorder * COURSE * wave_at(&aside[0], s)) * unit;
        y->point[k][1] = (((double)i + 0.5 + disorder * wave_at(&aside[1], s)) * COURSE + HIGH * cos(t)) * unit;
        y->point[k][2] = deep * unit * cos(2.0 * t);
    }
}

status cloth_knit(struct cloth_work *w, struct error *err)
{
    const struct cloth_description *d = w->d;
    double unit = unit_m(w, w->kind, w->number), nominal = unit_m(w, w->nominal, NULL);
    status st = STATUS_OK;
    w->set.tile_m[0] = (double)d->n_yarn[CLOTH_WARP] * 2.0 * M_PI * unit;
    w->set.tile_m[1] = (double)d->n_yarn[CLOTH_WEFT] * COURSE * unit;
    w->spacing_m[0] = 2.0 * M_PI * unit;
    w->spacing_m[1] = COURSE * unit;
    for (size_t i = 0; i < d->n_yarn[CLOTH_WEFT] && st == STATUS_OK; i++) {
        size_t kind = kind_of(d, i);
        struct yarn y = {.n = d->n_yarn[CLOTH_WARP] * POINTS_PER_LOOP,
                         .shift = {w->set.tile_m[0], 0.0},
                         .radius_m = w->kind[kind].radius_m,
                         .cut = CUT_FACE_X,
                         .number = (uint32_t)i};
        y.point = calloc(y.n, sizeof *y.point);
        if (y.point == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot make the fibers: out of memory");
        course_path(w, i, nominal, &y);
        double nominal_m = yarn_length_m(&y);
        course_path(w, i, unit, &y);
        st = yarn_fill(w, kind, &y, nominal_m, err);
        free(y.point);
    }
    return st;
}
