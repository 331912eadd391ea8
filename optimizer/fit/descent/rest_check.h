/* Whether the point at which a method ended is a minimum of the objective, by a linear model of the residuals that is
 * pooled from estimates at that point. The course of a method does not show it: steps that follow the noise of tracing
 * point in all directions, like steps around a minimum. */
#ifndef SELVEDGE_OPTIMIZER_REST_CHECK_H
#define SELVEDGE_OPTIMIZER_REST_CHECK_H

#include "optimizer/fit/descent/descent_methods.h"

struct rest_check {
    double promised;  /* decrease of the objective that further steps promise (far_decrease of gauss_newton.h) */
    double noise;     /* noise of the objective through the parameters */
    double tolerance; /* largest decrease and noise of a minimum: 5 % of the objective or 0.5 % of each radiance */
};

/* f: the objective at the model's reference point. STATUS_NO_MEMORY, and the errors of bounded_quadratic. */
status rest_check_compute(const struct descent_run *run, const struct linear_model *model, double f,
                          struct rest_check *check, struct error *err);

/* STOP_SCHEDULE for a minimum, STOP_DECREASE_LEFT, or STOP_NOISE where the estimates do not tell. */
enum stop_reason rest_check_verdict(const struct rest_check *check);

#endif
