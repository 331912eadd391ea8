/* What the section "fit" of a job document may ask for beyond model, method and start: tied parameters, bounds, priors,
 * several starts, nuisance terms. Plain data in file units, one slot for each flat parameter of the model.
 *
 *   "tied":   [["C_R.r", "C_R.g", "C_R.b"], {"beta_TT": 1, "gamma_TT": 2}]   equal values; values in these proportions
 *   "bounds": {"beta_R": [2, 8]}                                             inside the model's
 *   "priors": {"beta_R": {"mean": 5, "se": 1}}                               Gaussian in the fit coordinate (fit_layout.h)
 *   "starts": 4                                                              1..16; spread over the bounds
 *   "nuisance": {"gain": "none"|"global"|"per_photograph", "gain_prior_rel": 0.05, "stray_light": false,
 *                "stray_light_prior": 0.01}
 * A group name ("C_R") stands for its three channels.
 */
#ifndef SELVEDGE_OPTIMIZER_JOB_FIT_OPTION_H
#define SELVEDGE_OPTIMIZER_JOB_FIT_OPTION_H

#include "base/catalogue/model_catalogue.h"

#include <stdbool.h>
#include <stddef.h>

enum { JOB_MAX_PARAM = MODEL_MAX_PARAM, JOB_MAX_START = 16 };

enum job_gain { JOB_GAIN_NONE, JOB_GAIN_GLOBAL, JOB_GAIN_PER_PHOTOGRAPH };

struct job_fit_option {
    double lower[JOB_MAX_PARAM], upper[JOB_MAX_PARAM];         /* NaN: the model's */
    double prior_mean[JOB_MAX_PARAM], prior_se[JOB_MAX_PARAM]; /* NaN: no prior */
    size_t leader[JOB_MAX_PARAM]; /* value = ratio * value of the leader; a parameter that is not tied leads itself */
    double ratio[JOB_MAX_PARAM];
    size_t n_start;
    enum job_gain gain;
    double gain_prior_rel; /* standard deviation of ln gain */
    bool stray_light;
    double stray_light_prior; /* standard deviation, radiance unit */
};

/* One flat parameter as the fit will treat it, file units. */
struct job_fit_parameter {
    double lower, upper, start;
    bool fixed;
};

#endif
