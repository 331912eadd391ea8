#include "optimizer/fit/linear/fit_layout.h"
#include "base/option_id.h"

#include <math.h>
#include <stdint.h>
#include <string.h>

enum { N = FIT_MAX_PARAM };
_Static_assert((int)SCATTERING_MAX_FLAT >= N, "estimates have room for derivatives by all unknowns");

/* The range of a nuisance term, in standard deviations of its prior. */
static const double gain_range = 5.0, stray_range = 8.0;

void fit_option_init(struct fit_option *o)
{
    *o = (struct fit_option){.n_start = 1};
    for (size_t p = 0; p < N; p++) {
        o->leader[p] = p;
        o->ratio[p] = 1.0;
        o->prior_mean[p] = o->prior_se[p] = NAN;
    }
}

static void add_prior(struct gaussian_prior *to, double mean, double sd)
{
    double precision = 1.0 / (sd * sd), sum = to->precision + precision;
    to->mean = (to->precision * to->mean + precision * mean) / sum;
    to->precision = sum;
}

/* Adds a prior to unknown k; mean and se are values of the unknown. */
static void add_parameter_prior(struct fit_layout *l, size_t k, double mean, double se)
{
    struct coordinate c;
    coordinate_init(&c, &l->info[k], l->info[k].lower, l->info[k].upper);
    add_prior(&l->prior[k], coordinate_of(&c, mean), se / coordinate_slope(&c, mean));
    l->has_prior = true;
}

/* Returns true for the second and third channel of a colour whose channels are tied as equals: their common prior
 * counts once. */
static bool is_repeated(const struct fit_layout *l, const struct param_info *info, const struct fit_option *o, size_t p)
{
    for (size_t q = 0; q < p; q++)
        if (l->owner[q] == l->owner[p] && strcmp(info[q].symbol, info[p].symbol) == 0 && o->ratio[q] == o->ratio[p] &&
            o->prior_mean[q] == o->prior_mean[p] && o->prior_se[q] == o->prior_se[p])
            return true;
    return false;
}

static struct param_info gain_info(double sd)
{
    double range = exp(gain_range * sd);
    return (struct param_info){.name = NUISANCE_GAIN,
                               .symbol = NUISANCE_GAIN,
                               .kind = PARAM_NUISANCE,
                               .channel = -1,
                               .lower = 1.0 / range,
                               .upper = range,
                               .start = 1.0,
                               .coordinate = PARAM_LOG,
                               .meaning = "Gain of all photographs."};
}

static struct param_info stray_light_info(double sd)
{
    return (struct param_info){.name = NUISANCE_STRAY_LIGHT,
                               .symbol = NUISANCE_STRAY_LIGHT,
                               .kind = PARAM_NUISANCE,
                               .channel = -1,
                               .upper = stray_range * sd,
                               .coordinate = PARAM_LINEAR,
                               .meaning = "Radiance that stray light adds to all photographs."};
}

static size_t add_nuisance(struct fit_layout *l, const struct param_info *info, double prior_mean, double prior_sd)
{
    size_t k = l->n_unknown++;
    l->info[k] = *info;
    l->parameter[k] = (struct fit_parameter){info->lower, info->upper, info->start, false};
    add_prior(&l->prior[k], prior_mean, prior_sd);
    l->has_prior = true;
    return k;
}

status fit_layout_init(struct fit_layout *l, const struct param_info *info, const struct fit_parameter *parameter,
                       size_t n_param, const struct fit_option *o, struct error *err)
{
    memset(l, 0, sizeof *l);
    l->n_full = n_param;
    l->i_gain = l->i_stray = SIZE_MAX;
    size_t n_nuisance = (o->global_gain_sd > 0.0 ? 1u : 0u) + (o->stray_light_sd > 0.0 ? 1u : 0u), n_leader = 0;
    for (size_t p = 0; p < n_param && p < N; p++) n_leader += o->leader[p] == p;
    if (n_param > N || n_leader + n_nuisance > N)
        return error_set_field(err, STATUS_INVALID, OPTION_NUISANCE,
                               "cannot fit %zu parameters and %zu nuisance terms together: allowed are %d", n_leader,
                               n_nuisance, N);
    for (size_t p = 0; p < n_param; p++) {
        if (o->leader[p] != p) continue;
        l->owner[p] = l->n_unknown++;
        l->info[l->owner[p]] = info[p];
        l->parameter[l->owner[p]] = parameter[p];
    }
    for (size_t p = 0; p < n_param; p++) {
        l->owner[p] = l->owner[o->leader[p]];
        l->ratio[p] = o->ratio[p];
    }
    for (size_t p = 0; p < n_param; p++) {
        if (isnan(o->prior_mean[p]) || is_repeated(l, info, o, p)) continue;
        const struct param_info *owner = &l->info[l->owner[p]];
        double mean = o->prior_mean[p] / o->ratio[p], slack = 1e-9 * (owner->upper - owner->lower); /* of rounding */
        if (mean < owner->lower - slack || mean > owner->upper + slack || !(o->prior_se[p] > 0.0))
            return error_set_field(err, STATUS_INVALID, OPTION_PRIORS,
                                   "the prior of '%s' lies outside the range of '%s' or has no width", info[p].name,
                                   owner->name);
        mean = fmin(fmax(mean, owner->lower), owner->upper);
        add_parameter_prior(l, l->owner[p], mean, o->prior_se[p] / o->ratio[p]);
    }
    if (o->global_gain_sd > 0.0) {
        const struct param_info gain = gain_info(o->global_gain_sd);
        l->i_gain = add_nuisance(l, &gain, 0.0, o->global_gain_sd);
    }
    if (o->stray_light_sd > 0.0) {
        const struct param_info stray = stray_light_info(o->stray_light_sd);
        l->i_stray = add_nuisance(l, &stray, 0.0, o->stray_light_sd);
    }
    return STATUS_OK;
}

void fit_layout_full(const struct fit_layout *l, const double *unknown, double *full)
{
    for (size_t p = 0; p < l->n_full; p++) full[p] = l->ratio[p] * unknown[l->owner[p]];
}

double fit_layout_stretch(const struct fit_layout *l, const struct param_info *info, const double *unknown, size_t p)
{
    struct coordinate own, leader;
    size_t k = l->owner[p];
    coordinate_init(&own, &info[p], info[p].lower, info[p].upper);
    coordinate_init(&leader, &l->info[k], l->info[k].lower, l->info[k].upper);
    double value = l->ratio[p] * unknown[k];
    return l->ratio[p] * coordinate_slope(&leader, unknown[k]) / coordinate_slope(&own, value);
}

static void derivatives(const struct fit_layout *l, double gain, const struct estimate *e, struct estimate *out)
{
    memset(out->jac, 0, sizeof out->jac);
    memset(out->jac_var, 0, sizeof out->jac_var);
    for (size_t c = 0; c < 3; c++) {
        double *jac = out->jac + c * l->n_unknown, *var = out->jac_var + c * l->n_unknown;
        for (size_t p = 0; p < l->n_full; p++) {
            size_t k = l->owner[p];
            double factor = gain * l->ratio[p], own = factor * factor * e->jac_var[c * l->n_full + p];
            jac[k] += factor * e->jac[c * l->n_full + p];
            var[k] = var[k] > 0.0 ? var[k] + own + 2.0 * sqrt(var[k] * own) : own;
        }
        if (l->i_gain != SIZE_MAX) {
            jac[l->i_gain] = e->mean[c];
            var[l->i_gain] = e->var[c];
        }
        if (l->i_stray != SIZE_MAX) jac[l->i_stray] = 1.0;
    }
}

void fit_layout_estimate(const struct fit_layout *l, const double *unknown, bool want_jacobian,
                         const struct estimate *e, struct estimate *out)
{
    struct estimate from = *e;
    double gain = l->i_gain != SIZE_MAX ? unknown[l->i_gain] : 1.0;
    double stray = l->i_stray != SIZE_MAX ? unknown[l->i_stray] : 0.0;
    out->n_path = from.n_path;
    out->n_bounce = from.n_bounce;
    out->n_partner = from.n_partner;
    memcpy(out->partner, from.partner, sizeof out->partner);
    for (size_t c = 0; c < 3; c++) {
        out->mean[c] = gain * from.mean[c] + stray;
        out->var[c] = gain * gain * from.var[c];
    }
    if (want_jacobian) derivatives(l, gain, &from, out);
}
