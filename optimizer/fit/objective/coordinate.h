/* Fit coordinates: the scale on which a fit moves a parameter, p, ln p or ln(p / (1 - p)), as the parameter declares it
 * (param_info.h). The bounds are finite in all three, so a parameter can reach one and stay there.
 */
#ifndef SELVEDGE_OPTIMIZER_COORDINATE_H
#define SELVEDGE_OPTIMIZER_COORDINATE_H

#include "base/catalogue/param_info.h"

/* Largest number of parameters of a fit. A scattering model has fewer, but a cloth may have several sets of parameters,
 * and numbers of its own. */
enum { FIT_MAX_PARAM = 64 };

struct coordinate {
    enum param_coordinate kind;
    double param_lower, param_upper; /* internal unit */
    double lower, upper;             /* the bounds in the fit coordinate */
    double step_limit; /* largest step of one iteration: 1 in logit, 0.25 in log, 1/8 of the range otherwise */
};

/* lower and upper: bounds of this fit, inside the model's bounds. */
void coordinate_init(struct coordinate *k, const struct param_info *info, double lower, double upper);
/* The coordinate of a value inside the model's range, without regard to the bounds of the fit. */
double coordinate_of(const struct coordinate *k, double param);
/* Values beyond a bound map to the bound; a coordinate at (or beyond) a bound gives exactly the bound. */
double coordinate_from_param(const struct coordinate *k, double param);
double coordinate_to_param(const struct coordinate *k, double x);
/* d param / d coordinate at a parameter value. */
double coordinate_slope(const struct coordinate *k, double param);

#endif
