#include "optimizer/photographs/camera/exposure_carry.h"

#include <math.h>
#include <stdlib.h>

static const double repeat_sd = 0.01; /* prior: scatter of a shutter's ln time from view to view, as one view more */
static const double same_rel = 1e-6;

void exposure_carry_release(struct exposure_carry *carry)
{
    free(carry->ratio);
    *carry = (struct exposure_carry){0};
}

status exposure_carry_add(struct exposure_carry *carry, const struct exposure_set *e,
                          const struct photograph_info *info, const struct exposure_pair *pair, struct error *err)
{
    if (carry->n + e->n > carry->n_allocated) {
        const size_t n = 2 * carry->n_allocated + EXPOSURE_MAX;
        struct carried_ratio *grown = realloc(carry->ratio, n * sizeof *grown);
        if (grown == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot compare exposures: out of memory");
        carry->ratio = grown;
        carry->n_allocated = n;
    }
    for (size_t i = 0; i + 1 < e->n; i++)
        if (isfinite(pair[i].var))
            carry->ratio[carry->n++] = (struct carried_ratio){
                e->t_s[pair[i].shorter], e->t_s[pair[i].longer], info->iso, info->aperture, pair[i].value, pair[i].var};
    return STATUS_OK;
}

static bool same(double a, double b)
{
    return (isnan(a) && isnan(b)) || fabs(a - b) <= same_rel * fmax(fabs(a), fabs(b));
}

static bool is_of(const struct carried_ratio *a, const struct carried_ratio *b)
{
    return same(a->shorter_s, b->shorter_s) && same(a->longer_s, b->longer_s) && same(a->iso, b->iso) &&
           same(a->aperture, b->aperture);
}

/* The weighted mean of the ratios of these stated exposures, and the variance of the mean. Returns their number. */
static size_t weigh(const struct exposure_carry *carry, const struct carried_ratio *of, double scatter_var,
                    double *mean, double *var)
{
    double weight = 0.0, sum = 0.0;
    size_t n = 0;
    for (size_t i = 0; i < carry->n; i++) {
        const struct carried_ratio *r = &carry->ratio[i];
        if (!is_of(r, of)) continue;
        weight += 1.0 / (r->var + scatter_var);
        sum += r->value / (r->var + scatter_var);
        n++;
    }
    *mean = sum / weight;
    *var = 1.0 / weight;
    return n;
}

/* Scatter of the ratio from view to view beyond the errors of each. */
static double scatter_of(const struct exposure_carry *carry, const struct carried_ratio *of, double mean, size_t n)
{
    double square = repeat_sd * repeat_sd;
    for (size_t i = 0; i < carry->n; i++)
        if (is_of(&carry->ratio[i], of))
            square += fmax(0.0, pow(carry->ratio[i].value - mean, 2.0) - carry->ratio[i].var);
    return square / (double)n; /* the prior is one view more, and the mean takes one */
}

void exposure_carry_fill(const struct exposure_carry *carry, const struct exposure_set *e,
                         const struct photograph_info *info, struct exposure_pair *pair)
{
    for (size_t i = 0; i + 1 < e->n; i++) {
        const struct carried_ratio of = {.shorter_s = e->t_s[pair[i].shorter],
                                         .longer_s = e->t_s[pair[i].longer],
                                         .iso = info->iso,
                                         .aperture = info->aperture};
        double mean, var;
        const size_t n = isfinite(pair[i].var) ? 0 : weigh(carry, &of, repeat_sd * repeat_sd, &mean, &var);
        if (n == 0) continue;
        const double scatter_var = scatter_of(carry, &of, mean, n);
        weigh(carry, &of, scatter_var, &pair[i].value, &var);
        pair[i].var = var + scatter_var;
    }
}
