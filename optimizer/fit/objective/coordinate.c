#include "optimizer/fit/objective/coordinate.h"

#include <math.h>

static double forward(enum param_coordinate kind, double p)
{
    switch (kind) {
    case PARAM_LOG:
        return log(p);
    case PARAM_LOGIT:
        return log(p) - log1p(-p);
    default:
        return p;
    }
}

void coordinate_init(struct coordinate *k, const struct param_info *info, double lower, double upper)
{
    k->kind = info->coordinate;
    k->param_lower = lower;
    k->param_upper = upper;
    k->lower = forward(k->kind, lower);
    k->upper = forward(k->kind, upper);
    k->step_limit = k->kind == PARAM_LOGIT ? 1.0 : k->kind == PARAM_LOG ? 0.25 : (upper - lower) / 8.0;
}

double coordinate_of(const struct coordinate *k, double param) { return forward(k->kind, param); }

double coordinate_from_param(const struct coordinate *k, double param)
{
    if (param <= k->param_lower) return k->lower;
    if (param >= k->param_upper) return k->upper;
    return forward(k->kind, param);
}

double coordinate_to_param(const struct coordinate *k, double x)
{
    if (x <= k->lower) return k->param_lower;
    if (x >= k->upper) return k->param_upper;
    double p = k->kind == PARAM_LOG ? exp(x) : k->kind == PARAM_LOGIT ? 1.0 / (1.0 + exp(-x)) : x;
    return fmin(fmax(p, k->param_lower), k->param_upper);
}

double coordinate_slope(const struct coordinate *k, double param)
{
    switch (k->kind) {
    case PARAM_LOG:
        return param;
    case PARAM_LOGIT:
        return param * (1.0 - param);
    default:
        return 1.0;
    }
}
