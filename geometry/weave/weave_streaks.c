#include "geometry/weave/weave_streaks.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Rays are looked for between LOWEST and HIGHEST cycles per pixel; light and folds are below. */
enum { RAYS_BESIDE = 3, STEPS = 256 };
static const double LOWEST = 0.015, HIGHEST = 0.40;

static int rising(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static double median(double *v, size_t n)
{
    qsort(v, n, sizeof *v, rising);
    return v[n / 2];
}

void weave_measure_streaks(const float *power, const float *background, size_t width, size_t height,
                           struct weave_streaks *streaks)
{
    double along[STEPS], all[WEAVE_RAYS];
    for (int i = 0; i < WEAVE_RAYS; i++) {
        double angle = i * M_PI / WEAVE_RAYS;
        for (int k = 0; k < STEPS; k++) {
            double f = LOWEST + (HIGHEST - LOWEST) * k / (STEPS - 1);
            size_t x = (size_t)((double)(width / 2) + round(f * cos(angle) * (double)width));
            size_t y = (size_t)((double)(height / 2) + round(f * sin(angle) * (double)height));
            along[k] = log(((double)power[y * width + x] + 1e-12) / ((double)background[y * width + x] + 1e-12));
        }
        streaks->ray[i] = median(along, STEPS);
    }
    memcpy(all, streaks->ray, sizeof all);
    double ground = median(all, WEAVE_RAYS);
    for (int i = 0; i < WEAVE_RAYS; i++) streaks->ray[i] = fmax(0.0, streaks->ray[i] - ground);
}

double weave_streak_along(const struct weave_streaks *streaks, const double f[2])
{
    double best = 0.0;
    long at = lround(atan2(f[1], f[0]) / M_PI * WEAVE_RAYS);
    for (long i = at - RAYS_BESIDE; i <= at + RAYS_BESIDE; i++)
        best = fmax(best, streaks->ray[(i + 2L * WEAVE_RAYS) % WEAVE_RAYS]);
    return best;
}
