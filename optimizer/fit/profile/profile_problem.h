/* The fit of a model to the profile of a single fiber (profile_fit.h): the problem and its result. */
#ifndef SELVEDGE_OPTIMIZER_PROFILE_PROBLEM_H
#define SELVEDGE_OPTIMIZER_PROFILE_PROBLEM_H

#include "base/progress.h"
#include "optimizer/fit/linear/fit_layout.h"
#include "optimizer/fit/profile/profile_model.h"

struct profile_problem {
    const struct scattering_model *model;
    const struct fiber_profile *profile;
    const struct fit_parameter *parameter; /* n_param, internal units */
    const struct fit_option *option;       /* nuisance terms and extra starts are ignored */
    double scale;                          /* NaN: fitted */
    double turn_rad;                       /* of the section (profile_model.h); NaN: fitted where it counts */
    const char *mode;                      /* the mode of scattering_model.mode that the profile shows; NULL: all */
    size_t max_iteration;                  /* of one start; 0: 40 */
    struct thread_pool *pool;              /* NULL runs in the caller */
    const struct progress *progress;       /* NULL: none */
};

struct profile_fit {
    double param[FIT_MAX_PARAM], se_param[FIT_MAX_PARAM]; /* internal units; se 0 for fixed parameters */
    bool at_bound[FIT_MAX_PARAM], determined[FIT_MAX_PARAM];
    double scale, scale_se; /* scale_se: 0 for a given scale */
    bool has_turn, turn_determined;
    double turn_rad, turn_se_rad; /* 0 <= turn_rad < pi; se 0 for a given turn; has_turn false: there is none */
    double *value;                /* s L of every row and channel; the caller frees it with profile_fit_release */
    size_t n_value, n_free;       /* unknowns: parameters, the turn and the scale */
    double nrmse; /* root mean square of s L - m over the range of m, as published; NaN without a range */
    /* Root mean squares of (s L - m) / b and of se / b, the latter 0 without stated errors. b is the larger one of
     * m + 0.02 mean of m and 0.02 times the largest m, so that a profile that is mostly dark is not judged by its
     * dark radiances alone. */
    double rel_rms, stated_rms;
    double misfit;     /* t */
    double chi_square; /* the minimised sum without priors and with t = 0, per value less unknown; NaN without se */
    double bic;        /* sum of ((s L - m) / e)^2 + 2 ln e over all values, plus n_free ln n_value */
    size_t n_start, n_agree; /* starts, and those that came within 1 % of the least rel_rms */
    size_t n_evaluation;
    bool converged;
    double wall_s;
};

#endif
