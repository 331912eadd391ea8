#include "geometry/fibers/shape/fiber_correct.h"
#include "base/rng.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* A hair is a chain of HAIR_SEGMENTS segments. HAIR_TRIES places are drawn for its root and the highest is taken. */
enum { HAIR_SEGMENTS = 8, HAIR_TRIES = 8 };
static const double um = 1e-6, mm2_per_m2 = 1e6;
static const double hair_length_m[2] = {150e-6, 450e-6}; /* shortest and longest */
static const double hair_tilt_rad[2] = {0.35, 1.3};      /* of the root from the normal */
static const double hair_bend_rad = 0.6;                 /* largest turn from root to tip, either way */
static const double window_sd = 3.0;                     /* of the Gaussian */

/* ---- smoothing ---- */

/* Position k of a fiber of n vertices. Beyond an end the fiber goes on as its point reflection in that end, so that the
 * ends stay where they are. */
static void reflected(const float *p, long n, long k, double out[3])
{
    long inside = k < 0 ? -k : k >= n ? 2 * (n - 1) - k : k;
    inside = inside < 0 ? 0 : inside >= n ? n - 1 : inside;
    const float *end = p + 3 * (k < 0 ? 0 : n - 1);
    for (int a = 0; a < 3; a++) {
        double here = (double)p[3 * inside + a];
        out[a] = k < 0 || k >= n ? 2.0 * (double)end[a] - here : here;
    }
}

static double distance(const double a[3], const double b[3])
{
    return sqrt((a[0] - b[0]) * (a[0] - b[0]) + (a[1] - b[1]) * (a[1] - b[1]) + (a[2] - b[2]) * (a[2] - b[2]));
}

/* Adds the vertices on one side of vertex k with the Gaussian's weight of their distance along the fiber. */
static void add_side(const float *p, long n, long k, long step, double sd_m, double sum[3], double *weights)
{
    double at[3], next[3], along_m = 0.0;
    reflected(p, n, k, at);
    for (long i = k + step; labs(i - k) < n; i += step) {
        reflected(p, n, i, next);
        along_m += distance(at, next);
        if (along_m > window_sd * sd_m) return;
        double w = exp(-0.5 * along_m * along_m / (sd_m * sd_m));
        for (int a = 0; a < 3; a++) sum[a] += w * next[a];
        *weights += w;
        memcpy(at, next, sizeof at);
    }
}

static void smooth_fiber(const float *p, size_t n, double sd_m, float *out)
{
    for (long k = 0; k < (long)n; k++) {
        double sum[3], weights = 1.0;
        reflected(p, (long)n, k, sum);
        add_side(p, (long)n, k, 1, sd_m, sum, &weights);
        add_side(p, (long)n, k, -1, sd_m, sum, &weights);
        for (int a = 0; a < 3; a++) out[3 * k + a] = (float)(sum[a] / weights);
    }
}

/* ---- hairs ---- */

/* Index of the vertex from which hair i grows: the highest of a few. */
static size_t root_of(const struct fiber_set *f, struct rng *r)
{
    size_t best = 0;
    for (int k = 0; k < HAIR_TRIES; k++) {
        size_t v = (size_t)(rng_double(r) * (double)f->n_vertex);
        if (k == 0 || f->position_m[3 * v + 2] > f->position_m[3 * best + 2]) best = v;
    }
    return best;
}

static size_t fiber_of_vertex(const struct fiber_set *f, size_t vertex)
{
    size_t low = 0, high = f->n_fiber;
    while (high - low > 1) {
        size_t middle = (low + high) / 2;
        if (f->first_vertex[middle] <= vertex)
            low = middle;
        else
            high = middle;
    }
    return low;
}

/* Writes hair i as fiber `to` of out. grown: share of its length. */
static void add_hair(const struct fiber_set *from, size_t i, double grown, struct fiber_set *out, size_t to)
{
    const struct rng_key key = {.seed = 0x68616972u};
    struct rng r;
    rng_start(&r, &key, (uint32_t)i, 0);
    size_t root = root_of(from, &r), fiber = fiber_of_vertex(from, root);
    double length_m = hair_length_m[0] + rng_double(&r) * (hair_length_m[1] - hair_length_m[0]);
    double tilt = hair_tilt_rad[0] + rng_double(&r) * (hair_tilt_rad[1] - hair_tilt_rad[0]);
    double azimuth = 2.0 * M_PI * rng_double(&r), bend = hair_bend_rad * (2.0 * rng_double(&r) - 1.0);
    double step_m = grown * length_m / HAIR_SEGMENTS, at[3];
    for (int a = 0; a < 3; a++) at[a] = (double)from->position_m[3 * root + (size_t)a];
    float *p = out->position_m + 3 * out->first_vertex[to];
    for (int k = 0; k <= HAIR_SEGMENTS; k++) {
        for (int a = 0; a < 3; a++) p[3 * k + a] = (float)at[a];
        double angle = tilt + bend * (k + 0.5) / HAIR_SEGMENTS;
        at[0] += step_m * sin(angle) * cos(azimuth);
        at[1] += step_m * sin(angle) * sin(azimuth);
        at[2] += step_m * cos(angle);
    }
    out->first_vertex[to + 1] = out->first_vertex[to] + HAIR_SEGMENTS + 1;
    out->radius_m[to] = out->radius_m[fiber];
    out->axis_class[to] = out->axis_class[fiber];
    out->group[to] = out->group[fiber];
    for (size_t k = out->first_vertex[to]; out->shape != NULL && k < out->first_vertex[to + 1]; k++)
        out->shape[k] = fiber_shape_disc(out->radius_m[to]);
}

/* ---- all of them ---- */

static status check(const double *value, struct error *err)
{
    for (int k = 0; k < CORRECTION_N; k++) {
        const struct cloth_number_info *info = &correction_number_table[k];
        if (!(value[k] >= info->lower && value[k] <= info->upper))
            return error_set_field(err, STATUS_INVALID, info->name, "'%s' is %g, but must be between %g and %g",
                                   info->name, value[k], info->lower, info->upper);
    }
    return STATUS_OK;
}

/* Copies the fibers with their axes smoothed and their radii scaled. */
static void copy_fibers(const struct fiber_set *from, const double *value, struct fiber_set *out)
{
    memcpy(out->first_vertex, from->first_vertex, (from->n_fiber + 1) * sizeof *out->first_vertex);
    memcpy(out->axis_class, from->axis_class, from->n_fiber * sizeof *out->axis_class);
    memcpy(out->group, from->group, from->n_fiber * sizeof *out->group);
    memcpy(out->tile_size_m, from->tile_size_m, sizeof out->tile_size_m);
    for (size_t i = 0; i < from->n_fiber; i++) {
        const size_t first = from->first_vertex[i], n = from->first_vertex[i + 1] - first;
        out->radius_m[i] = from->radius_m[i];
        if (from->shape != NULL) memcpy(out->shape + first, from->shape + first, n * sizeof *out->shape);
        fiber_set_scale_radius(out, i, value[CORRECT_RADIUS]);
        if (value[CORRECT_SMOOTHING] > 0.0)
            smooth_fiber(from->position_m + 3 * first, n, value[CORRECT_SMOOTHING] * um, out->position_m + 3 * first);
        else
            memcpy(out->position_m + 3 * first, from->position_m + 3 * first, 3 * n * sizeof *out->position_m);
    }
}

static void compress(double factor, const struct fiber_set *from, struct fiber_set *out)
{
    double low_m, high_m;
    if (factor == 1.0) return;
    fiber_set_z_range_m(from, &low_m, &high_m);
    for (size_t v = 0; v < out->n_vertex; v++) {
        float *z = &out->position_m[3 * v + 2];
        *z = (float)(low_m + factor * ((double)*z - low_m));
    }
}

status fiber_correct(const struct fiber_set *from, const double value[CORRECTION_N], struct fiber_set *out,
                     struct error *err)
{
    status s = check(value, err);
    if (s != STATUS_OK) return s;
    double n_hair = value[CORRECT_HAIRS] * from->tile_size_m[0] * from->tile_size_m[1] * mm2_per_m2;
    size_t n = (size_t)ceil(n_hair);
    s = fiber_set_reserve(out, from->n_fiber + n, from->n_vertex + n * (HAIR_SEGMENTS + 1), err);
    if (s == STATUS_OK && from->shape != NULL) s = fiber_set_add_shapes(out, err);
    if (s != STATUS_OK) return s;
    copy_fibers(from, value, out);
    for (size_t i = 0; i < n; i++) add_hair(from, i, fmax(fmin(n_hair - (double)i, 1.0), 1e-3), out, from->n_fiber + i);
    compress(value[CORRECT_COMPRESSION], from, out);
    return STATUS_OK;
}
