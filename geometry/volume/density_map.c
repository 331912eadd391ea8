#include "geometry/volume/density_map.h"
#include "base/lanes.h"
#include "base/option_id.h"

#include "geometry/volume/volume_align.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Solid material is not the mode of the material but its 90 % quantile: if there are two yarns, the denser one must
 * keep its texture. */
static const double DENSE_SHARE = 0.9;

enum { N_BIN = 1024, N_SAMPLE = 1 << 22 };

struct histogram {
    double first, width; /* lower edge of bin 0, width of a bin */
    double count[N_BIN];
};

/* Mean of the 3 x 3 x 3 voxels around an inner voxel; VOLUME_OUTSIDE if one of them is. */
static float mean27(const struct volume *v, size_t i, size_t j, size_t k)
{
    float sum = 0.0f;
    for (size_t z = k - 1; z <= k + 1; z++)
        for (size_t y = j - 1; y <= j + 1; y++) {
            const float *row = v->density + volume_index(v->n, i, y, z);
            sum += row[-1] + row[0] + row[1];
        }
    return sum / 27.0f;
}

/* Widens the range by n values, without those outside. Returns false if one of the others is not finite. */
static bool widen_range(const float *value, size_t n, lanes *least, lanes *most)
{
    const lanes zero = {0.0f}, outside = zero + VOLUME_OUTSIDE;
    lane_mask wrong = {0};
    for (size_t i = 0; i < n; i += LANES) {
        lanes x = outside;
        if (i + LANES <= n)
            x = *(const lanes *)(value + i);
        else
            memcpy(&x, value + i, (n - i) * sizeof *value);
        const lane_mask counts = x != outside, finite = (x > -INFINITY) & (x < INFINITY);
        *least = lanes_choose(counts & (x < *least), x, *least);
        *most = lanes_choose(counts & (x > *most), x, *most);
        wrong |= counts & ~finite;
    }
    return !lanes_any(wrong);
}

/* Names the first value of n that is not finite. */
static status refuse_value(const struct volume *v, size_t first, size_t n, struct error *err)
{
    size_t i = first;
    while (i + 1 < first + n && (isfinite(v->density[i]) || v->density[i] == VOLUME_OUTSIDE)) i++;
    const size_t row = i / v->n[0];
    return error_set_field(err, STATUS_INVALID, OPTION_SCAN_FILES, "cannot use the volume: voxel (%zu, %zu, %zu) is %s",
                           i % v->n[0], row % v->n[1], row / v->n[1], isnan(v->density[i]) ? "NaN" : "infinite");
}

static status check_values(const struct volume *v, float *least, float *most, struct error *err)
{
    const size_t n_slice = v->n[0] * v->n[1];
    const lanes zero = {0.0f};
    lanes low = zero + INFINITY, high = zero - INFINITY;
    for (size_t k = 0; k < v->n[2]; k++) {
        scratch_keep_within(v->space);
        if (!widen_range(v->density + k * n_slice, n_slice, &low, &high))
            return refuse_value(v, k * n_slice, n_slice, err);
    }
    *least = INFINITY;
    *most = -INFINITY;
    for (int l = 0; l < LANES; l++) {
        *least = fminf(*least, low[l]);
        *most = fmaxf(*most, high[l]);
    }
    if (!(*most > *least))
        return error_set_field(err, STATUS_INVALID, OPTION_SCAN_FILES,
                               "cannot use the volume: every voxel has the value %g", (double)*most);
    return STATUS_OK;
}

/* Stride of a lattice with at most N_SAMPLE places. */
static size_t lattice_stride(const size_t n[3])
{
    size_t stride = 1;
    while (volume_n_voxel(n) / (stride * stride * stride) > N_SAMPLE) stride++;
    return stride;
}

static double collect(const struct volume *v, struct histogram *h)
{
    double total = 0.0;
    size_t step = lattice_stride(v->n);
    for (size_t k = 1; k + 1 < v->n[2]; k += step) {
        scratch_keep_within(v->space);
        for (size_t j = 1; j + 1 < v->n[1]; j += step)
            for (size_t i = 1; i + 1 < v->n[0]; i += step) {
                float x = mean27(v, i, j, k);
                double bin = ((double)x - h->first) / h->width;
                if (!(bin >= 0.0)) continue;
                h->count[bin < N_BIN ? (size_t)bin : N_BIN - 1] += 1.0;
                total += 1.0;
            }
    }
    return total;
}

/* Narrows the range to 99.99 % of the values, so that single extreme voxels do not take most of the bins. */
static void trim_range(struct histogram *h, double total)
{
    double below = 0.0, above = 0.0;
    size_t lo = 0, hi = N_BIN - 1;
    while (lo + 1 < N_BIN && (below += h->count[lo]) < 5e-5 * total) lo++;
    while (hi > lo + 1 && (above += h->count[hi]) < 5e-5 * total) hi--;
    double first = h->first + (double)lo * h->width, width = h->width * (double)(hi - lo + 1) / N_BIN;
    *h = (struct histogram){.first = first, .width = width};
}

static size_t otsu(const struct histogram *h, double *separability)
{
    double total = 0.0, sum = 0.0, square = 0.0, w = 0.0, s = 0.0, best = -1.0;
    size_t threshold = 1;
    for (size_t b = 0; b < N_BIN; b++) {
        total += h->count[b];
        sum += h->count[b] * (double)b;
        square += h->count[b] * (double)b * (double)b;
    }
    for (size_t b = 0; b + 1 < N_BIN; b++) {
        w += h->count[b];
        s += h->count[b] * (double)b;
        if (w <= 0.0 || w >= total) continue;
        double d = s / w - (sum - s) / (total - w), between = w * (total - w) * d * d;
        if (between > best) {
            best = between;
            threshold = b + 1;
        }
    }
    double variance = square / total - (sum / total) * (sum / total);
    *separability = variance > 0.0 ? best / (total * total * variance) : 0.0;
    return threshold;
}

static void smooth_histogram(struct histogram *h, double sd_bin)
{
    struct histogram out = {.first = h->first, .width = h->width};
    int reach = (int)ceil(3.0 * sd_bin);
    for (int b = 0; b < N_BIN; b++)
        for (int o = -reach; o <= reach; o++)
            if (b + o >= 0 && b + o < N_BIN)
                out.count[b] += h->count[b + o] * exp(-0.5 * (double)(o * o) / (sd_bin * sd_bin));
    *h = out;
}

static size_t peak(const struct histogram *h, size_t from, size_t to)
{
    size_t best = from;
    for (size_t b = from; b < to; b++)
        if (h->count[b] > h->count[best]) best = b;
    return best;
}

/* Mean of bins from..to-1, in bins. */
static double mean_bin(const struct histogram *h, size_t from, size_t to)
{
    double w = 0.0, s = 0.0;
    for (size_t b = from; b < to; b++) {
        w += h->count[b];
        s += h->count[b] * (double)b;
    }
    return w > 0.0 ? s / w : 0.5 * (double)(from + to);
}

/* Bin below which `share` of the counts of from..to-1 lie. */
static size_t quantile_bin(const struct histogram *h, size_t from, size_t to, double share)
{
    double total = 0.0, sum = 0.0;
    for (size_t b = from; b < to; b++) total += h->count[b];
    for (size_t b = from; b < to; b++)
        if ((sum += h->count[b]) >= share * total) return b;
    return to - 1;
}

status density_modes_find(const struct volume *v, struct density_modes *m, struct error *err)
{
    float least = 0.0f, most = 0.0f;
    status s = check_values(v, &least, &most, err);
    if (s != STATUS_OK) return s;
    struct histogram h = {.first = least, .width = ((double)most - (double)least) / N_BIN};
    double total = collect(v, &h);
    if (total < 1000.0)
        return error_set_field(err, STATUS_INVALID, OPTION_SCAN_FILES,
                               "cannot find densities: %zu x %zu x %zu voxels are too few", v->n[0], v->n[1], v->n[2]);
    trim_range(&h, total);
    collect(v, &h);
    size_t threshold = otsu(&h, &m->separability), dense = quantile_bin(&h, threshold, N_BIN, DENSE_SHARE);
    smooth_histogram(&h, 8.0);
    /* A peak next to the threshold is the tail of the other side. That side then has no mode of its own, so its mean
     * is used. */
    size_t low = peak(&h, 0, threshold), high = peak(&h, threshold, N_BIN);
    double low_bin = low + 2 < threshold ? (double)low : mean_bin(&h, 0, threshold);
    double high_bin = high > threshold + 2 ? (double)high : mean_bin(&h, threshold, N_BIN);
    m->half = h.first + (0.5 * (low_bin + high_bin) + 0.5) * h.width;
    if ((double)dense > high_bin) high_bin = (double)dense;
    m->low = h.first + (low_bin + 0.5) * h.width;
    m->high = h.first + (high_bin + 0.5) * h.width;
    m->threshold = h.first + (double)threshold * h.width;
    return STATUS_OK;
}

bool density_threshold(const float *value, size_t n, double *threshold)
{
    struct histogram h = {0};
    double separability;
    float least = INFINITY, most = -INFINITY;
    for (size_t i = 0; i < n; i++) {
        least = fminf(least, value[i]);
        most = fmaxf(most, value[i]);
    }
    if (!(most > least)) return false;
    h.first = (double)least;
    h.width = ((double)most - (double)least) / N_BIN;
    for (size_t i = 0; i < n; i++) {
        const size_t bin = (size_t)(((double)value[i] - h.first) / h.width);
        h.count[bin < N_BIN ? bin : N_BIN - 1] += 1.0;
    }
    *threshold = h.first + (double)otsu(&h, &separability) * h.width;
    return true;
}

struct mapping {
    struct volume *v;
    float low, scale, least, most;
};

static void map_slice(void *context, size_t k, size_t i_thread)
{
    (void)i_thread;
    const struct mapping *m = context;
    scratch_keep_within(m->v->space);
    size_t n = m->v->n[0] * m->v->n[1];
    float *d = m->v->density + k * n;
    for (size_t i = 0; i < n; i++) /* VOLUME_OUTSIDE is not finite */
        d[i] = isfinite(d[i]) ? fminf(m->most, fmaxf(m->least, (d[i] - m->low) * m->scale)) : 0.0f;
}

static status map_within(struct volume *v, double low, double high, const float limit[2], struct thread_pool *pool,
                         struct error *err)
{
    if (!(high > low) || !isfinite(high - low))
        return error_set_field(
            err, STATUS_INVALID, OPTION_DENSITY_HIGH,
            "cannot map densities: the value for solid material, %g, is not above the one for void, %g", high, low);
    struct mapping m = {v, (float)low, (float)(1.0 / (high - low)), limit[0], limit[1]};
    return thread_pool_run(pool, v->n[2], map_slice, &m, NULL);
}

status density_map_apply(struct volume *v, double low, double high, struct thread_pool *pool, struct error *err)
{
    return map_within(v, low, high, (const float[2]){0.0f, 1.0f}, pool, err);
}

status density_map_wide(struct volume *v, double low, double high, struct thread_pool *pool, struct error *err)
{
    return map_within(v, low, high, (const float[2]){-1.0f, 2.0f}, pool, err);
}

static int compare_float(const void *a, const void *b)
{
    float x = *(const float *)a, y = *(const float *)b;
    return (x > y) - (x < y);
}

double density_noise_sd(const struct volume *v, double low, double high)
{
    enum { MAX_VALUE = 100000 };
    const float from = (float)low, scale = (float)(1.0 / (high - low));
    float *value = malloc(MAX_VALUE * sizeof *value);
    if (value == NULL) return NAN;
    size_t n = 0, step = lattice_stride(v->n) + 1;
    for (size_t k = 1; k + 1 < v->n[2]; k += step) {
        scratch_keep_within(v->space);
        for (size_t j = 1; j + 1 < v->n[1]; j += step)
            for (size_t i = 1; i + 2 < v->n[0] && n < MAX_VALUE; i += step) {
                const float x = (v->density[volume_index(v->n, i, j, k)] - from) * scale;
                const float mean = (mean27(v, i, j, k) - from) * scale;
                /* Values of void at 0 and of material at 1 may be clamped. Those on the other side of them have a
                 * half-normal distribution. */
                if (isfinite(mean) && mean < 0.15f && x > 0.0f) value[n++] = x;
                if (mean > 0.85f && x < 1.0f) value[n++] = 1.0f - x;
            }
    }
    double sd = 0.0;
    if (n > 100) { /* whose median is 0.6745 standard deviations */
        qsort(value, n, sizeof *value, compare_float);
        sd = (double)value[n / 2] / 0.6745;
    }
    free(value);
    return sd;
}
