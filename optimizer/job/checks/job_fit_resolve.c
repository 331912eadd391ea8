/* Bounds, start and fixed flag of each parameter from ties, bounds, priors, fixed values and starts
 * (job_fit_resolve). */
#include "optimizer/job/checks/job_document_parts.h"
#include "optimizer/job/document/job_fit.h"
#include "optimizer/job/document/job_fit_option.h"

#include <math.h>
#include <stdint.h>
#include <string.h>

bool job_parameter_is_tied(const struct job_fit_option *o, size_t n_param, size_t p)
{
    for (size_t q = 0; q < n_param; q++)
        if (q != p && o->leader[q] == p) return true;
    return o->leader[p] != p;
}

static bool same(double a, double b) { return fabs(a - b) <= 1e-9 * (fabs(a) + fabs(b)); }

/* The value of the leader that follows from the first value in `given` of its group; NaN when the group has none.
 * *clash becomes the index of a member whose value contradicts it, or SIZE_MAX. */
static double group_value(const struct job_fit_option *o, size_t n_param, const double *given, size_t leader,
                          size_t *clash)
{
    double value = NAN;
    *clash = SIZE_MAX;
    for (size_t p = 0; p < n_param; p++) {
        if (o->leader[p] != leader || isnan(given[p])) continue;
        double v = given[p] / o->ratio[p];
        if (isnan(value))
            value = v;
        else if (!same(value, v))
            *clash = p;
    }
    return value;
}

static status group_bounds(const struct param_info *info, size_t n_param, const struct job_fit_option *o, size_t leader,
                           double *lower, double *upper, struct error *err)
{
    *lower = -INFINITY;
    *upper = INFINITY;
    for (size_t p = 0; p < n_param; p++) {
        if (o->leader[p] != leader) continue;
        double a = isnan(o->lower[p]) ? param_to_file_unit(&info[p], info[p].lower) : o->lower[p];
        double b = isnan(o->upper[p]) ? param_to_file_unit(&info[p], info[p].upper) : o->upper[p];
        *lower = fmax(*lower, a / o->ratio[p]);
        *upper = fmin(*upper, b / o->ratio[p]);
    }
    if (*lower < *upper) return STATUS_OK;
    return error_set_field(
        err, STATUS_INVALID, "fit.tied",
        "'fit.tied' leaves no room for '%s': the bounds of the parameters tied to it exclude each other",
        info[leader].name);
}

/* The density multiplier has keys of its own, density_multiplier_per_cm and fit_density. */
static bool is_density(const struct param_info *info) { return info->kind == PARAM_DENSITY; }

/* A prior of a tied parameter constrains its leader. Its mean must lie inside the leader's bounds of the model, where
 * the fit coordinate is defined, and within three standard errors of the bounds of the group. */
static status check_priors(const struct param_info *info, size_t n_param, const struct job_model *given, size_t leader,
                           const double bound[2], bool held, struct error *err)
{
    const double most_se = 3.0;
    const struct job_fit_option *o = &given->option;
    double lower = param_to_file_unit(&info[leader], info[leader].lower),
           upper = param_to_file_unit(&info[leader], info[leader].upper);
    const double slack = 1e-12 * (fabs(lower) + fabs(upper));
    for (size_t p = 0; p < n_param; p++) {
        if (o->leader[p] != leader || isnan(o->prior_mean[p])) continue;
        if (held)
            return error_set_field(err, STATUS_INVALID, "fit.priors", "'fit.priors' has '%s', which %s", info[p].name,
                                   is_density(&info[p]) ? "is fitted only with 'fit.fit_density'"
                                                        : "'fit.fixed' holds fixed");
        double mean = o->prior_mean[p] / o->ratio[p];
        if (mean < lower - slack || mean > upper + slack)
            return error_set_field(
                err, STATUS_INVALID, "fit.priors",
                "'fit.priors' has '%s' at %g, which 'fit.tied' makes '%s' at %g: allowed are %g and %g", info[p].name,
                o->prior_mean[p], info[leader].name, mean, lower, upper);
        if (fmax(bound[0] - mean, mean - bound[1]) > most_se * o->prior_se[p] / o->ratio[p])
            return error_set_field(err, STATUS_INVALID, "fit.priors",
                                   "'fit.priors' has '%s' at %g +- %g, its bounds are %g and %g: no value agrees with "
                                   "both",
                                   info[p].name, o->prior_mean[p], o->prior_se[p], bound[0] * o->ratio[p],
                                   bound[1] * o->ratio[p]);
    }
    return STATUS_OK;
}

/* The first member of a group that has a value, or the last parameter when none has. */
static size_t stated_member(const struct job_fit_option *o, size_t n_param, const double *value, size_t leader)
{
    size_t p = 0;
    while (p + 1 < n_param && (o->leader[p] != leader || isnan(value[p]))) p++;
    return p;
}

/* The error of a value outside of the bounds. It names the member of the group that the document gives. bound: lower
 * and upper bound of the leader. */
static status outside_bounds(const struct param_info *info, size_t n_param, const struct job_fit_option *o,
                             size_t leader, const char *field, const double *given, const double bound[2],
                             struct error *err)
{
    size_t p = stated_member(o, n_param, given, leader);
    if (is_density(&info[p])) /* its value stands neither in 'fit.fixed' nor in 'fit.start' */
        return error_set_field(err, STATUS_INVALID, "fit.density_multiplier_per_cm",
                               "'fit.density_multiplier_per_cm' is %g%s: 'fit.bounds' has %g and %g", given[p],
                               strcmp(field, "fit.fixed") == 0 ? ", and held there without 'fit.fit_density'" : "",
                               bound[0], bound[1]);
    return error_set_field(err, STATUS_INVALID, field, "'%s' has '%s' at %g: its bounds are %g and %g%s", field,
                           info[p].name, given[p], bound[0] * o->ratio[p], bound[1] * o->ratio[p],
                           job_parameter_is_tied(o, n_param, p) ? ", with those of what 'fit.tied' ties it to" : "");
}

static status resolve_group(const struct param_info *info, size_t n_param, const struct job_model *given, size_t leader,
                            struct job_fit_parameter *out, struct error *err)
{
    const struct job_fit_option *o = &given->option;
    double lower, upper;
    size_t clash;
    status s = group_bounds(info, n_param, o, leader, &lower, &upper, err);
    if (s != STATUS_OK) return s;
    double held = group_value(o, n_param, given->fixed, leader, &clash);
    if (clash != SIZE_MAX)
        return error_set_field(err, STATUS_INVALID, "fit.fixed",
                               "'fit.fixed' holds '%s' at a value that 'fit.tied' does not allow", info[clash].name);
    double begin = group_value(o, n_param, given->start, leader, &clash);
    if (clash != SIZE_MAX)
        return error_set_field(err, STATUS_INVALID, "fit.start",
                               "'fit.start' starts '%s' at a value that 'fit.tied' does not allow", info[clash].name);
    if (!isnan(held) && !isnan(begin) && !is_density(&info[leader]))
        return error_set_field(err, STATUS_INVALID, "fit.start",
                               "'fit.start' has '%s', which 'fit.fixed' holds fixed by what 'fit.tied' ties it to",
                               info[stated_member(o, n_param, given->start, leader)].name);
    s = check_priors(info, n_param, given, leader, (const double[2]){lower, upper}, !isnan(held), err);
    if (s != STATUS_OK) return s;
    size_t ignored;
    double prior = group_value(o, n_param, o->prior_mean, leader, &ignored);
    const double slack = 1e-9 * (fabs(lower) + fabs(upper));
    double value = !isnan(held) ? held : begin;
    if (value < lower - slack || value > upper + slack)
        return outside_bounds(info, n_param, o, leader, !isnan(held) ? "fit.fixed" : "fit.start",
                              !isnan(held) ? given->fixed : given->start, (const double[2]){lower, upper}, err);
    if (isnan(value)) value = !isnan(prior) ? prior : param_to_file_unit(&info[leader], info[leader].start);
    value = fmin(fmax(value, lower), upper);
    for (size_t p = 0; p < n_param; p++) {
        if (o->leader[p] != leader) continue;
        out[p] =
            (struct job_fit_parameter){lower * o->ratio[p], upper * o->ratio[p], value * o->ratio[p], !isnan(held)};
    }
    return STATUS_OK;
}

status job_fit_resolve(const struct param_info *info, size_t n_param, const struct job_model *given,
                       struct job_fit_parameter *out, struct error *err)
{
    if (n_param > JOB_MAX_PARAM)
        return error_set_field(err, STATUS_INVALID, "fit.model", "model '%s' has %zu parameters: allowed are %d",
                               given->id, n_param, JOB_MAX_PARAM);
    for (size_t p = 0; p < n_param; p++) {
        if (given->option.leader[p] != p) continue;
        status s = resolve_group(info, n_param, given, p, out, err);
        if (s != STATUS_OK) return s;
    }
    return STATUS_OK;
}
