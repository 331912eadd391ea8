#include "optimizer/fit/descent/bounded_quadratic.h"

#include <math.h>
#include <nlopt.h>
#include <string.h>

struct quadratic {
    const double *hessian, *g;
    size_t n;
};

static double evaluate(unsigned n, const double *y, double *gradient, void *context)
{
    const struct quadratic *q = context;
    double value = 0.0;
    for (size_t i = 0; i < n; i++) {
        double hy = 0.0;
        for (size_t j = 0; j < n; j++) hy += q->hessian[i * n + j] * y[j];
        value += y[i] * (q->g[i] + 0.5 * hy);
        if (gradient != NULL) gradient[i] = q->g[i] + hy;
    }
    return value;
}

/* Minimises exactly along one coordinate after the other, which removes the rest after nlopt stops at its tolerance. */
static void polish(const struct quadratic *q, const double *lower, const double *upper, double *y)
{
    for (int sweep = 0; sweep < 200; sweep++) {
        double largest = 0.0;
        for (size_t i = 0; i < q->n; i++) {
            double slope = q->g[i], curvature = q->hessian[i * q->n + i];
            for (size_t j = 0; j < q->n; j++) slope += q->hessian[i * q->n + j] * y[j];
            double to = curvature > 0.0 ? y[i] - slope / curvature
                        : slope > 0.0   ? lower[i]
                        : slope < 0.0   ? upper[i]
                                        : y[i];
            to = fmin(fmax(to, lower[i]), upper[i]);
            largest = fmax(largest, fabs(to - y[i]));
            y[i] = to;
        }
        if (largest < 1e-12) return;
    }
}

status bounded_quadratic(const double *hessian, const double *g, const double *lower, const double *upper, size_t n,
                         double *y, struct error *err)
{
    struct quadratic q = {hessian, g, n};
    double value;
    for (size_t i = 0; i < n; i++)
        y[i] = fmin(fmax(0.0, lower[i]), upper[i]); /* rounding may have put 0 outside of the bounds */
    nlopt_opt opt = nlopt_create(NLOPT_LD_SLSQP, (unsigned)n);
    if (opt == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot solve for a step: out of memory");
    nlopt_set_min_objective(opt, evaluate, &q);
    nlopt_set_lower_bounds(opt, lower);
    nlopt_set_upper_bounds(opt, upper);
    nlopt_set_xtol_rel(opt, 1e-10);
    nlopt_set_maxeval(opt, 500);
    nlopt_result result = nlopt_optimize(opt, y, &value);
    nlopt_destroy(opt);
    if (result == NLOPT_OUT_OF_MEMORY)
        return error_set(err, STATUS_NO_MEMORY, "cannot solve for a step: out of memory");
    for (size_t i = 0; i < n; i++) {
        if (!isfinite(y[i]))
            return error_set(err, STATUS_NUMERIC, "cannot solve for a step: the quadratic model is not finite");
        y[i] = fmin(fmax(y[i], lower[i]), upper[i]);
    }
    polish(&q, lower, upper, y);
    return STATUS_OK;
}
