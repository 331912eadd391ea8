#include "geometry/weave/weave_measure.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { PROFILE = 64, ALONG = 9 };
static const double HALF_HEIGHT_OF_CYLINDER = 0.866, LEAST_PX = 3.0, ENOUGH_PX = 12.0;

/* A place in the averaged repeat, in yarn coordinates from the crossing (0, 0). */
static double value_at(const struct weave_draft *d, const struct weave_repeat *r, double i, double j)
{
    double at_px[2];
    for (int a = 0; a < 2; a++) at_px[a] = d->origin_px[a] + i * d->step_warp_px[a] + j * d->step_weft_px[a];
    return weave_repeat_value(r, at_px);
}

static bool warp_is_on_top(const struct weave_draft *d, size_t i, size_t j)
{
    return d->warp_on_top[j * d->n_warp + i] != 0;
}

/* Mean brightness across the warps (set 0) or wefts (1) where they are on top; profile[PROFILE / 2] is the middle. */
static void mean_profile(const struct weave_draft *d, const struct weave_repeat *r, int set, double profile[PROFILE])
{
    memset(profile, 0, PROFILE * sizeof *profile);
    for (size_t j = 0; j < d->n_weft; j++)
        for (size_t i = 0; i < d->n_warp; i++) {
            if (warp_is_on_top(d, i, j) != (set == 0)) continue;
            for (int k = 0; k < PROFILE; k++)
                for (int l = 0; l < ALONG; l++) {
                    double across = ((double)k - PROFILE / 2) / PROFILE, along = 0.6 * ((l + 0.5) / ALONG - 0.5);
                    profile[k] += set == 0 ? value_at(d, r, (double)i + across, (double)j + along)
                                           : value_at(d, r, (double)i + along, (double)j + across);
                }
        }
}

/* Width over spacing by the half height of the profile. */
static double profile_cover(const double profile[PROFILE])
{
    double low = INFINITY, high = -INFINITY;
    for (int k = 0; k < PROFILE; k++) {
        low = fmin(low, profile[k]);
        high = fmax(high, profile[k]);
    }
    int n_above = 0;
    for (int k = 0; k < PROFILE; k++) n_above += profile[k] > 0.5 * (low + high);
    return fmin(1.2, fmax(0.3, (double)n_above / PROFILE / HALF_HEIGHT_OF_CYLINDER));
}

/* Mean of the repeat in the middle of the crossings with the set on top. */
static double mean_on_top(const struct weave_draft *d, const struct weave_repeat *r, int set)
{
    double sum = 0.0, n = 0.0;
    for (size_t j = 0; j < d->n_weft; j++)
        for (size_t i = 0; i < d->n_warp; i++) {
            if (warp_is_on_top(d, i, j) != (set == 0)) continue;
            for (int k = 0; k < ALONG * ALONG; k++) {
                double across = 0.4 * ((k % ALONG + 0.5) / ALONG - 0.5),
                       along = 0.4 * ((k / ALONG + 0.5) / ALONG - 0.5);
                sum += value_at(d, r, (double)i + across, (double)j + along);
                n += 1.0;
            }
        }
    return sum / n;
}

static status measure_colors(const struct weave_picture *p, const struct weave_draft *d,
                             const struct weave_repeat *repeat, struct weave_guess *g, struct error *err)
{
    size_t n = p->width * p->height;
    struct weave_repeat channel = *repeat; /* borrows the phases */
    float *plane = malloc(n * sizeof *plane);
    if (plane == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot analyse texture: out of memory");
    status s = STATUS_OK;
    for (size_t c = 0; s == STATUS_OK && c < 3; c++) {
        double mean = 0.0;
        for (size_t i = 0; i < n; i++) {
            plane[i] = p->rgb[3 * i + c];
            mean += (double)plane[i] / (double)n;
        }
        s = weave_average_again(plane, p->width, p->height, &channel, err);
        if (s != STATUS_OK) break;
        g->warp.rgb[c] = fmax(0.0, mean + mean_on_top(d, &channel, 0));
        g->weft.rgb[c] = fmax(0.0, mean + mean_on_top(d, &channel, 1));
    }
    free(plane);
    return s;
}

status weave_measure_yarns(const struct weave_picture *picture, const struct weave_draft *draft,
                           const struct weave_repeat *repeat, struct weave_guess *guess, struct error *err)
{
    double spacing_px =
        fmin(1.0 / hypot(draft->f_warp[0], draft->f_warp[1]), 1.0 / hypot(draft->f_weft[0], draft->f_weft[1]));
    double seen = fmin(1.0, fmax(0.0, (spacing_px - LEAST_PX) / (ENOUGH_PX - LEAST_PX)));
    for (int set = 0; set < 2; set++) {
        double profile[PROFILE];
        mean_profile(draft, repeat, set, profile);
        guess->cover[set] = profile_cover(profile);
    }
    guess->cover_confidence = 0.7 * seen * guess->draft_confidence;
    guess->color_confidence =
        seen * guess->draft_confidence / (1.0 + exp(fmin(50.0, draft->score_exchanged - draft->score)));
    return measure_colors(picture, draft, repeat, guess, err);
}
