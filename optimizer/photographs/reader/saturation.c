#include "optimizer/photographs/reader/saturation.h"

#include <math.h>
#include <stdlib.h>

enum { NEAR = 16, FACTOR = 8, LEAST = 16, BESIDE = 4, MOST_SAMPLES = 1 << 20 };

static const double least_share = 0.005, widest_step = 8.0, darkest_pile = 0.05, like_pile = 0.25;

/* The distinct values of a channel in ascending order, and how often each occurs. */
struct value_counts {
    size_t n, n_sample;
    float *value;
    double *count;
};

static int ascending(const void *a, const void *b)
{
    float x = *(const float *)a, y = *(const float *)b;
    return (x > y) - (x < y);
}

/* Counts the values of every step-th sample. Returns false without memory. */
static bool count_values(const struct image *im, size_t channel, struct value_counts *k)
{
    const size_t n = im->width * im->height, step = (n + MOST_SAMPLES - 1) / MOST_SAMPLES;
    float *sample = malloc((n / step + 1) * sizeof *sample);
    double *count = malloc((n / step + 1) * sizeof *count);
    if (sample == NULL || count == NULL) {
        free(sample);
        free(count);
        return false;
    }
    *k = (struct value_counts){.value = sample, .count = count};
    for (size_t i = 0; i < n; i += step) {
        const size_t jitter = (uint32_t)(i * 2654435761u) / 256 % step; /* no column is sampled alone */
        const float v = im->pixel[(i + jitter < n ? i + jitter : i) * im->n_channel + channel];
        if (isfinite(v)) sample[k->n_sample++] = v;
    }
    qsort(sample, k->n_sample, sizeof *sample, ascending);
    for (size_t i = 0; i < k->n_sample; i++) {
        if (k->n == 0 || sample[i] > sample[k->n - 1]) {
            sample[k->n] = sample[i];
            count[k->n++] = 0.0;
        }
        count[k->n - 1] += 1.0;
    }
    return true;
}

static double largest_count(const struct value_counts *k, size_t begin, size_t end)
{
    double most = 0.0;
    for (size_t i = begin; i < end; i++) most = fmax(most, k->count[i]);
    return most;
}

static bool exceeds(double count, double beside) { return count > FACTOR * beside + 5.0 * sqrt(FACTOR * beside); }

/* Returns whether the distribution reaches its largest value without a gap. */
static bool is_continuous(const struct value_counts *k)
{
    const size_t last = k->n - 1;
    if (last < NEAR + 1 || k->value[last - NEAR] < 0.5f * k->value[last]) return false;
    const double step = (double)k->value[last] - (double)k->value[last - 1];
    const double mean_step = ((double)k->value[last - 1] - (double)k->value[last - 1 - NEAR]) / NEAR;
    return step <= widest_step * mean_step;
}

/* Returns whether a value below the largest one has a pile, too, as flat areas of a synthetic picture have. */
static bool has_other_pile(const struct value_counts *k)
{
    const size_t last = k->n - 1;
    for (size_t i = 0; i < last; i++) {
        if ((double)k->value[i] < darkest_pile * (double)k->value[last] || k->count[i] < like_pile * k->count[last])
            continue;
        const double below = largest_count(k, i > BESIDE ? i - BESIDE : 0, i);
        const double above = largest_count(k, i + 1, i + 1 + BESIDE < last ? i + 1 + BESIDE : last);
        if (exceeds(k->count[i], fmax(below, above))) return true;
    }
    return false;
}

/* Returns whether a sample of 16 bits is the largest one of 10, 12 or 14 bits, at either end. */
static bool is_narrow_scale(const struct photograph_info *info, float value)
{
    bool found = false;
    for (size_t i = 0; i < sizeof info->narrow_scale / sizeof *info->narrow_scale; i++)
        found = found || (value > 0.0f && value == info->narrow_scale[i]);
    return found;
}

static bool is_clipped(const struct value_counts *k, const struct photograph_info *info)
{
    if (k->n == 0) return false;
    const size_t last = k->n - 1;
    if (k->count[last] < LEAST || k->count[last] < least_share * (double)k->n_sample || k->value[last] <= 0.0f)
        return false;
    if (is_narrow_scale(info, k->value[last])) return true;
    return is_continuous(k) && exceeds(k->count[last], largest_count(k, last - NEAR, last)) && !has_other_pile(k);
}

/* Returns the largest value of a channel and its number of samples. */
static float top_of(const struct image *im, size_t channel, size_t *n_top)
{
    float top = -INFINITY;
    *n_top = 0;
    for (size_t i = 0; i < im->width * im->height; i++) {
        const float v = im->pixel[i * im->n_channel + channel];
        if (!(v >= top) || isinf(v)) continue;
        *n_top = v > top ? 1 : *n_top + 1;
        top = v;
    }
    return top;
}

void saturation_find(const struct image *im, struct photograph_info *info)
{
    size_t n_found = 0, n_top;
    double share = 0.0, level = 0.0;
    for (size_t c = 0; c < 3; c++) {
        struct value_counts k;
        const float top = top_of(im, c, &n_top);
        if ((double)top >= info->saturation[c] || n_top < LEAST ||
            (double)n_top < least_share * (double)(im->width * im->height))
            continue;
        if (!count_values(im, c, &k)) return;
        if (is_clipped(&k, info)) {
            info->saturation[c] = (double)top;
            level = fmax(level, (double)top);
            share = fmax(share, k.count[k.n - 1] / (double)k.n_sample);
            n_found++;
        }
        free(k.value);
        free(k.count);
    }
    if (n_found > 0)
        file_ledger_add(&info->ledger, "largest value", NULL, "%.4g, where %.1f %% of the pixels are clipped", level,
                        100.0 * share);
}
