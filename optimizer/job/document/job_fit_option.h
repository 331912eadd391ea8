/* Options of the section "fit" of a job document that concern single parameters or the course of the fit: tied
 * parameters, bounds, priors, several starts, nuisance terms. Plain data in file units, with one array element for each
 * parameter of the model (a colour has three: one for each channel).
 *
 *   "tied":   [["C_R.r", "C_R.g", "C_R.b"],        these parameters have equal values
 *              {"beta_TT": 1, "gamma_TT": 2}]      these have values in the given proportions
 *   "bounds": {"beta_R": [2, 8]}                   inside the model's bounds
 *   "priors": {"beta_R": {"mean": 5, "se": 1}}     Gaussian in the fit coordinate (fit_layout.h)
 *   "starts": 4                                    1..16 starts, spread over the bounds
 *   "nuisance": {"gain": "none"|"global"|"per_photograph", "gain_prior_rel": 0.05, "stray_light": false,
 *                "stray_light_prior": 0.01}
 * A group name ("C_R") stands for its three channels.
 */
#ifndef SELVEDGE_OPTIMIZER_JOB_FIT_OPTION_H
#define SELVEDGE_OPTIMIZER_JOB_FIT_OPTION_H

#include "base/catalogue/model_catalogue.h"

#include <stdbool.h>
#include <stddef.h>

enum { JOB_MAX_PARAM = MODEL_MAX_FLAT, JOB_MAX_START = 16 };

enum job_gain { JOB_GAIN_NONE, JOB_GAIN_GLOBAL, JOB_GAIN_PER_PHOTOGRAPH };

struct job_fit_option {
    double lower[JOB_MAX_PARAM], upper[JOB_MAX_PARAM];         /* NaN: the model's bound */
    double prior_mean[JOB_MAX_PARAM], prior_se[JOB_MAX_PARAM]; /* NaN: no prior */
    size_t leader[JOB_MAX_PARAM]; /* value = ratio * value of the leader; an untied parameter is its own leader */
    double ratio[JOB_MAX_PARAM];
    size_t n_start;
    enum job_gain gain;
    double gain_prior_rel; /* prior standard deviation of ln gain */
    bool stray_light;
    double stray_light_prior; /* prior standard deviation, in the unit of radiance */
};

/* One parameter as the fit treats it, in file units. */
struct job_fit_parameter {
    double lower, upper, start;
    bool fixed;
};

#endif
