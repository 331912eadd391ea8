/* The unknowns of a fit: the free parameters of the model after ties, and nuisance terms; and the way between them and
 * the model's full list of parameters.
 *
 *   value of parameter p = ratio_p * value of its leader
 *   radiance in a photograph = gain * (rendered radiance) + stray light
 *
 * Nuisance terms: a global gain (Gaussian on ln gain about 0) and a stray light (radiance >= 0, half a Gaussian about
 * 0) are unknowns like parameters; one gain for each photograph is not an unknown but taken out of the residuals
 * (linear_model.h).
 *
 * Priors are Gaussian in the fit coordinate x (coordinate.h): mean x(mean), standard deviation se |dx/dp| at the mean
 * (delta rule). With residuals r in units of the objective and s2 their variance, -2 ln(posterior) is (r.r + s2 sum ((x
 * - mean) / sd)^2) / s2, so a fit minimises f + s2 sum ((x - mean) / sd)^2. */
#ifndef SELVEDGE_OPTIMIZER_FIT_LAYOUT_H
#define SELVEDGE_OPTIMIZER_FIT_LAYOUT_H

#include "optimizer/fit/linear/linear_model.h"
#include "optimizer/fit/objective/coordinate.h"
#include "optimizer/fit/objective/nuisance.h"
#include "renderer/estimate/estimate.h"

enum { FIT_MAX_EXTRA_START = 4 };
/* One parameter of a fit, internal units. Bounds lie inside the model's. A fixed one keeps `start`. */
struct fit_parameter {
    double lower, upper, start;
    bool fixed;
};

/* Ties, priors, nuisance terms and starts of a fit, in internal units; arrays have one slot for each parameter of the
 * model. */
struct fit_option {
    size_t leader[FIT_MAX_PARAM];
    double ratio[FIT_MAX_PARAM];
    double prior_mean[FIT_MAX_PARAM], prior_se[FIT_MAX_PARAM]; /* NaN: none */
    double global_gain_sd;                                     /* of ln gain; 0: no global gain */
    double photograph_gain_sd;                                 /* of ln gain, one for each observation; 0: none */
    double stray_light_sd;                                     /* radiance; 0: none */
    size_t n_start;                                            /* 1 or more */
    /* Starts besides those, in the model's parameters; fixed parameters keep their own. */
    size_t n_extra_start;
    double extra_start[FIT_MAX_EXTRA_START][FIT_MAX_PARAM];
};

struct fit_layout {
    size_t n_full, n_unknown;
    size_t owner[FIT_MAX_PARAM]; /* index of the unknown that the parameter follows */
    double ratio[FIT_MAX_PARAM];
    struct param_info info[FIT_MAX_PARAM]; /* of the unknowns; the next three likewise */
    struct fit_parameter parameter[FIT_MAX_PARAM];
    struct gaussian_prior prior[FIT_MAX_PARAM];
    bool has_prior;
    size_t i_gain, i_stray; /* index of the unknown, or SIZE_MAX when there is none */
};

/* Every parameter on its own, no priors, no nuisance terms, one start. */
void fit_option_init(struct fit_option *o);
/* STATUS_INVALID when ties and nuisance terms make more unknowns than FIT_MAX_PARAM, or a prior lies outside the
 * model's range. */
status fit_layout_init(struct fit_layout *l, const struct param_info *info, const struct fit_parameter *parameter,
                       size_t n_param, const struct fit_option *o, struct error *err);
/* Computes the model's parameters from the values of the unknowns. */
void fit_layout_full(const struct fit_layout *l, const double *unknown, double *full);
/* Derivative of the fit coordinate of parameter p by the fit coordinate of its owner. */
double fit_layout_stretch(const struct fit_layout *l, const struct param_info *info, const double *unknown, size_t p);
/* Converts an estimate of the renderer to the values in a photograph (mean, variance), with derivatives by the unknowns
 * if they are wanted. The derivatives of tied parameters come from the same paths, so their errors are taken as fully
 * correlated. e and out may be the same. */
void fit_layout_estimate(const struct fit_layout *l, const double *unknown, bool want_jacobian,
                         const struct estimate *e, struct estimate *out);

#endif
