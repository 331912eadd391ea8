#include "geometry/diameter/light_material.h"

#include "geometry/volume/density_map.h"
#include "geometry/volume/noise_smoothing.h"
#include "geometry/volume/voxel_runs.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

/* Standard deviations of the blur of the densities that are looked at, and of another one on top of it: how much this
 * lowers the density of a fiber tells how thick it is. The blur of scans themselves is about SCAN_SD. */
static const double LOOK_SD = 1.2, WIDER_SD = 1.6, SCAN_SD = 0.7;
/* Noise of the blurred densities that material must exceed, in standard deviations: of maxima, and of voxels. */
static const double PEAK_NOISE = 4.5, VOXEL_NOISE = 2.2;
/* Bounds of the density of light fibers, and least distance of both modes in standard deviations of their maxima
 * (Ashman, Bird and Zepf 1994: 2 for a mixture of two normal distributions; halves of an even distribution have
 * 3.5). */
static const double LEAST_DENSITY = 0.15, MOST_DENSITY = 0.6, LEAST_GAP = 5.0;
/* Share of the light fibers' density from which on a voxel may be theirs; least size of their sets of voxels, and least
 * share of the material. */
static const double MATERIAL = 0.55, LEAST_SHARE = 0.03;
enum { LEAST_VOXELS = 150 };
/* Squared distances in voxels: of light material from dense material, and of the voxels around it that are raised, too:
 * rims of light fibers, which may touch dense ones. */
enum { APART2 = 6, RIM2 = 3, REACH = 2 };
/* Quantile of the voxels of a material that stands for its density, and from which on they are near axes. */
static const double DENSITY_QUANTILE = 0.8, AXIS_QUANTILE = 0.6;
/* Density of the dense fibers, over the given one, from which on it is taken: the 90 % quantile of a scan whose dense
 * fibers are few is the light material. */
static const double MOST_ABOVE = 1.2;
/* The blur of light voxels over their noise, and its bounds. */
static const double BLUR_OF_NOISE = 1.2, LEAST_BLUR = 0.3, MOST_BLUR = 1.1;

enum { N_BIN = 1400, LIGHT = 1, DENSE = 2, AXIS = 4 };
static const double BIN = 0.005;

struct histogram {
    double count[N_BIN], total;
};

struct look {
    struct volume a;              /* blurred densities */
    uint8_t *mark, *work, *apart; /* kinds of the voxels, and squared distances from dense ones */
    double noise_sd;              /* of the blurred densities */
};

static void count_value(struct histogram *h, double value)
{
    const double bin = value / BIN;
    if (!(bin >= 0.0)) return;
    h->count[bin < N_BIN ? (size_t)bin : N_BIN - 1] += 1.0;
    h->total += 1.0;
}

static double quantile(const struct histogram *h, double share)
{
    double sum = 0.0;
    for (size_t b = 0; b < N_BIN; b++)
        if ((sum += h->count[b]) >= share * h->total) return ((double)b + 0.5) * BIN;
    return 0.0;
}

/* Makes a blurred copy in which `low` is 0 and `high` 1, and unknown voxels are void. sd: 0 for no blur. */
static status blur_densities(const struct volume *v, double low, double high, double sd, struct thread_pool *pool,
                             struct volume *to, struct error *err)
{
    const size_t n_slice = v->n[0] * v->n[1];
    status s = volume_init_in(to, v->n, v->voxel_size_m, v->space, err);
    for (size_t k = 0; k < v->n[2] && s == STATUS_OK; k++) {
        for (size_t i = k * n_slice; i < (k + 1) * n_slice; i++)
            to->density[i] = isfinite(v->density[i]) ? (v->density[i] - (float)low) / (float)(high - low) : 0.0f;
        scratch_keep_within(v->space);
    }
    return s == STATUS_OK && sd > 0.0 ? volume_smooth_noise(to, sd, pool, err) : s;
}

/* Noise from the values below void: the median of a half-normal distribution is 0.6745 standard deviations. */
static double noise_below_void(const struct volume *a)
{
    struct histogram h = {.total = 0.0};
    for (size_t i = 0; i < volume_n_voxel(a->n); i++) count_value(&h, -(double)a->density[i]);
    return quantile(&h, 0.5) / 0.6745;
}

/* ---- the modes ---- */

static bool is_maximum(const struct volume *a, size_t at)
{
    const size_t sy = a->n[0], sz = a->n[0] * a->n[1];
    const float *x = a->density + at;
    for (size_t z = 0; z < 3; z++)
        for (size_t y = 0; y < 3; y++) {
            const float *row = x + z * sz + y * sy - sz - sy;
            if (row[-1] > x[0] || row[0] > x[0] || row[1] > x[0]) return false;
        }
    return true;
}

/* Counts the maxima of the blurred densities, which lie on the axes of fibers, beyond the noise. */
static void count_maxima(const struct look *l, struct histogram *h)
{
    const struct volume *a = &l->a;
    const float least = (float)fmax(0.7 * LEAST_DENSITY, PEAK_NOISE * l->noise_sd);
    for (size_t k = 1; k + 1 < a->n[2]; k++) {
        scratch_keep_within(a->space);
        for (size_t j = 1; j + 1 < a->n[1]; j++)
            for (size_t i = 1; i + 1 < a->n[0]; i++) {
                const size_t at = volume_index(a->n, i, j, k);
                if (a->density[at] >= least && is_maximum(a, at)) count_value(h, (double)a->density[at]);
            }
    }
}

/* Mean and variance of the bins first to end. */
static double class_mean(const struct histogram *h, size_t first, size_t end, double *variance, double *weight)
{
    double n = 0.0, sum = 0.0, square = 0.0;
    for (size_t b = first; b < end; b++) {
        const double x = ((double)b + 0.5) * BIN;
        n += h->count[b];
        sum += h->count[b] * x;
        square += h->count[b] * x * x;
    }
    *weight = n;
    *variance = n > 0.0 ? fmax(0.0, square / n - sum * sum / (n * n)) : 0.0;
    return n > 0.0 ? sum / n : 0.0;
}

/* Splits the maxima into two classes of least variance within (Otsu 1979). Returns whether they are modes of their own.
 * mode: of the light and the dense class. */
static bool split_maxima(const struct histogram *h, double mode[2])
{
    double least = INFINITY, variance[2], weight[2], best[2] = {0.0}, share = 0.0;
    for (size_t b = 1; b < N_BIN; b++) {
        double mean[2];
        mean[0] = class_mean(h, 0, b, &variance[0], &weight[0]);
        mean[1] = class_mean(h, b, N_BIN, &variance[1], &weight[1]);
        const double within = weight[0] * variance[0] + weight[1] * variance[1];
        if (weight[0] == 0.0 || weight[1] == 0.0 || within >= least) continue;
        least = within;
        memcpy(mode, mean, sizeof mean);
        memcpy(best, variance, sizeof best);
        share = fmin(weight[0], weight[1]) / h->total;
    }
    if (!isfinite(least)) return false;
    const double gap = (mode[1] - mode[0]) / sqrt(0.5 * (best[0] + best[1]) + BIN * BIN);
    return gap >= LEAST_GAP && share >= LEAST_SHARE && mode[0] < MOST_DENSITY * mode[1];
}

/* ---- the voxels ---- */

/* Marks dense material, and light material apart from it. */
static status mark_materials(struct look *l, const double mode[2], struct thread_pool *pool, struct error *err)
{
    const size_t n = volume_n_voxel(l->a.n);
    const float dense = (float)(0.5 * (mode[0] + mode[1]));
    const float least = (float)fmax(MATERIAL * mode[0], VOXEL_NOISE * l->noise_sd);
    for (size_t i = 0; i < n; i++) l->mark[i] = l->a.density[i] > dense ? DENSE : 0;
    status s = voxel_marks_distance(l->a.n, l->mark, DENSE, REACH, pool, l->work, l->apart, err);
    for (size_t i = 0; i < n && s == STATUS_OK; i++) l->mark[i] = l->a.density[i] > least && l->apart[i] > APART2;
    if (s == STATUS_OK) s = voxel_marks_drop_small(l->a.n, LEAST_VOXELS, l->mark, err);
    for (size_t i = 0; i < n && s == STATUS_OK; i++)
        l->mark[i] = l->mark[i] != 0 ? LIGHT : l->apart[i] == 0 ? DENSE : 0;
    return s;
}

/* Marks voxels of a material that are near the axes of its fibers. Returns the material's density. */
static double mark_axes(struct look *l, uint8_t kind, double *n_voxel)
{
    struct histogram h = {.total = 0.0};
    for (size_t i = 0; i < volume_n_voxel(l->a.n); i++)
        if (l->mark[i] == kind) count_value(&h, (double)l->a.density[i]);
    const float least = (float)quantile(&h, AXIS_QUANTILE);
    for (size_t i = 0; i < volume_n_voxel(l->a.n); i++)
        if (l->mark[i] == kind && l->a.density[i] >= least) l->mark[i] |= AXIS;
    *n_voxel = h.total;
    return quantile(&h, DENSITY_QUANTILE);
}

static double mean_on_axes(const struct look *l, uint8_t kind)
{
    double sum = 0.0, n = 0.0;
    for (size_t i = 0; i < volume_n_voxel(l->a.n); i++) {
        if (l->mark[i] != (kind | AXIS)) continue;
        sum += (double)l->a.density[i];
        n += 1.0;
    }
    return n > 0.0 ? sum / n : 0.0;
}

/* Density on the axis of a fiber of density 1 after a blur, if a wider blur leaves `ratio` of it. */
static double axis_density(double ratio)
{
    const double look = 2.0 * (LOOK_SD * LOOK_SD + SCAN_SD * SCAN_SD), wide = look + 2.0 * WIDER_SD * WIDER_SD;
    double low = 0.1, high = 400.0; /* of the squared radius */
    for (int i = 0; i < 50; i++) {
        const double r2 = sqrt(low * high);
        *((1.0 - exp(-r2 / wide)) / (1.0 - exp(-r2 / look)) < ratio ? &low : &high) = r2;
    }
    return 1.0 - exp(-low / look);
}

/* Measures both materials where they are marked. m->density stays NaN if the light one is none. */
static status compare_materials(struct look *l, struct thread_pool *pool, struct light_material *m, struct error *err)
{
    double n[2], before[2], density[2];
    density[0] = mark_axes(l, LIGHT, &n[0]);
    density[1] = mark_axes(l, DENSE, &n[1]);
    if (!(n[0] >= LEAST_SHARE * (n[0] + n[1])) || n[1] == 0.0) return STATUS_OK;
    for (int i = 0; i < 2; i++) before[i] = mean_on_axes(l, i == 0 ? LIGHT : DENSE);
    status s = volume_smooth_noise(&l->a, WIDER_SD, pool, err);
    if (s != STATUS_OK) return s;
    for (int i = 0; i < 2; i++) density[i] /= axis_density(mean_on_axes(l, i == 0 ? LIGHT : DENSE) / before[i]);
    const double ratio = density[0] / density[1];
    if (ratio < LEAST_DENSITY || ratio > MOST_DENSITY) return STATUS_OK;
    m->density = ratio;
    m->high = density[1] > MOST_ABOVE ? density[1] : 1.0;
    m->share = n[0] / (n[0] + n[1]);
    return STATUS_OK;
}

/* Marks light voxels and their rims, and no others. v: as it was, with unknown voxels. */
static status mark_rims(struct look *l, const struct volume *v, struct thread_pool *pool, struct error *err)
{
    status s = voxel_marks_distance(l->a.n, l->mark, LIGHT, REACH, pool, l->work, l->apart, err);
    for (size_t i = 0; i < volume_n_voxel(l->a.n) && s == STATUS_OK; i++)
        l->mark[i] = l->apart[i] <= RIM2 && (l->mark[i] & DENSE) == 0 && isfinite(v->density[i]);
    return s;
}

static status look_at(struct look *l, const struct volume *v, struct thread_pool *pool, struct light_material *m,
                      struct error *err)
{
    struct histogram h = {.total = 0.0};
    double mode[2];
    l->noise_sd = noise_below_void(&l->a);
    count_maxima(l, &h);
    if (!split_maxima(&h, mode)) return STATUS_OK;
    status s = mark_materials(l, mode, pool, err);
    if (s == STATUS_OK) s = compare_materials(l, pool, m, err);
    return s == STATUS_OK && !isnan(m->density) ? mark_rims(l, v, pool, err) : s;
}

/* mark: becomes 1 for the voxels of light fibers and their rims where there are any. */
static status find(const struct volume *v, double low, double high, struct thread_pool *pool, struct light_material *m,
                   uint8_t *mark, struct error *err)
{
    struct look l = {.mark = mark};
    void *bytes[2] = {NULL, NULL};
    status s = blur_densities(v, low, high, LOOK_SD, pool, &l.a, err);
    for (int i = 0; i < 2 && s == STATUS_OK; i++)
        s = scratch_new(v->space, volume_n_voxel(v->n), "light material", &bytes[i], err);
    l.work = bytes[0];
    l.apart = bytes[1];
    if (s == STATUS_OK) s = look_at(&l, v, pool, m, err);
    for (int i = 0; i < 2; i++) scratch_release(v->space, bytes[i]);
    volume_release(&l.a);
    return s;
}

/* Divides the marked densities by the light material's, after a blur where noise is strong for it. low, high: values of
 * void and of dense fibers. */
static status raise_marked(struct volume *v, double low, double high, double density, const uint8_t *mark,
                           struct thread_pool *pool, struct error *err)
{
    struct volume blurred = {0};
    const double noise_sd = density_noise_sd(v, low, high) / density, sd = fmin(MOST_BLUR, BLUR_OF_NOISE * noise_sd);
    const float step = (float)((high - low) / density);
    status s = blur_densities(v, low, high, sd >= LEAST_BLUR ? sd : 0.0, pool, &blurred, err);
    for (size_t i = 0; i < volume_n_voxel(v->n) && s == STATUS_OK; i++)
        if (mark[i] != 0) v->density[i] = (float)low + step * blurred.density[i];
    volume_release(&blurred);
    return s;
}

/* Enters the marked voxels in v->light. */
static status enter_marked(struct volume *v, double density, const uint8_t *mark, struct error *err)
{
    void *run = NULL;
    const size_t n = voxel_runs_of(v->n, mark, NULL);
    status s = scratch_new(v->space, (n + 1) * sizeof *v->light.run, "light material", &run, err);
    if (s != STATUS_OK) return s;
    v->light = (struct volume_light){density, n, run};
    voxel_runs_of(v->n, mark, run);
    return STATUS_OK;
}

status light_material_raise(struct volume *v, double low, double high, struct thread_pool *pool,
                            struct light_material *m, struct error *err)
{
    void *mark = NULL;
    *m = (struct light_material){NAN, 0.0, high};
    if (!(high > low) || !isfinite(high - low)) return STATUS_OK;
    status s = scratch_new(v->space, volume_n_voxel(v->n), "light material", &mark, err);
    if (s == STATUS_OK) s = find(v, low, high, pool, m, mark, err);
    const bool is_found = s == STATUS_OK && !isnan(m->density);
    m->high = is_found ? low + m->high * (high - low) : high;
    if (is_found) s = raise_marked(v, low, m->high, m->density, mark, pool, err);
    if (is_found && s == STATUS_OK) s = enter_marked(v, m->density, mark, err);
    scratch_release(v->space, mark);
    return s;
}
