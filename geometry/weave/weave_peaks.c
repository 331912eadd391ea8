#include "geometry/weave/weave_peaks.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>

enum { REACH = 2, LEAST_PERIODS = 5 };
static const double LEAST_EXCESS = 12.0;
/* A weaker maximum this near to a strong peak, as a share of the distance to zero, is the peak's foot. */
static const double FOOT_SHARE = 0.15, FOOT_POWER = 0.05;

struct spectrum {
    long width, height;
    const float *power, *background;
};

static bool is_maximum(const struct spectrum *s, long x, long y)
{
    float own = s->power[y * s->width + x];
    for (long j = -REACH; j <= REACH; j++)
        for (long i = -REACH; i <= REACH; i++)
            if ((i != 0 || j != 0) && s->power[(y + j) * s->width + x + i] >= own) return false;
    return true;
}

static struct weave_peak measure_peak(const struct spectrum *s, long x, long y)
{
    double sum = 0.0, moment[2] = {0.0, 0.0}, ground = (double)s->background[y * s->width + x];
    for (long j = -REACH; j <= REACH; j++)
        for (long i = -REACH; i <= REACH; i++) {
            double p = fmax(0.0, (double)s->power[(y + j) * s->width + x + i] - ground);
            sum += p;
            moment[0] += p * (double)i;
            moment[1] += p * (double)j;
        }
    double bin[2] = {(double)(x - s->width / 2), (double)(y - s->height / 2)};
    return (struct weave_peak){
        .f = {(bin[0] + moment[0] / sum) / (double)s->width, (bin[1] + moment[1] / sum) / (double)s->height},
        .power = sum,
        .excess = (double)s->power[y * s->width + x] / ground};
}

static int by_power(const void *a, const void *b)
{
    double p = ((const struct weave_peak *)a)->power, q = ((const struct weave_peak *)b)->power;
    return (p < q) - (p > q);
}

/* Keeps the strongest WEAVE_PEAK_MAX peaks that are not the foot of a stronger one. */
static size_t select_peaks(struct weave_peak *all, size_t n_all, struct weave_peak *peak)
{
    size_t n = 0;
    qsort(all, n_all, sizeof *all, by_power);
    for (size_t i = 0; i < n_all && n < WEAVE_PEAK_MAX; i++) {
        bool foot = false;
        for (size_t k = 0; k < n && !foot; k++) {
            double apart = hypot(all[i].f[0] - peak[k].f[0], all[i].f[1] - peak[k].f[1]);
            foot = apart < FOOT_SHARE * hypot(peak[k].f[0], peak[k].f[1]) && all[i].power < FOOT_POWER * peak[k].power;
        }
        if (!foot) peak[n++] = all[i];
    }
    return n;
}

status weave_find_peaks(const float *power, const float *background, size_t width, size_t height,
                        struct weave_peak peak[WEAVE_PEAK_MAX], size_t *n_peak, struct error *err)
{
    const struct spectrum spectrum = {(long)width, (long)height, power, background}, *s = &spectrum;
    size_t n = 0, room = width * height / 18 + 1; /* maxima are REACH + 1 bins apart at least */
    struct weave_peak *all = malloc(room * sizeof *all);
    if (all == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot analyse texture: out of memory");
    for (long y = s->height / 2; y < s->height - REACH; y++)
        for (long x = REACH; x < s->width - REACH; x++) {
            long fx = x - s->width / 2, fy = y - s->height / 2;
            if (fx * fx + fy * fy < LEAST_PERIODS * LEAST_PERIODS || (fy == 0 && fx < 0)) continue;
            if (s->power[y * s->width + x] < LEAST_EXCESS * (double)s->background[y * s->width + x]) continue;
            if (n < room && is_maximum(s, x, y)) all[n++] = measure_peak(s, x, y);
        }
    *n_peak = select_peaks(all, n, peak);
    free(all);
    return STATUS_OK;
}
