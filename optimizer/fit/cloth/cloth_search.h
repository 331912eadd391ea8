/* A fit of a cloth's numbers together with the scattering parameters.
 *
 * 1. Screening: the scattering parameters alone are fitted, with few paths, to a few cloths that are spread evenly over
 *    the bounds of the numbers (fit_run_start). All of these fits use the same random numbers, and each begins at the
 *    parameters of the best one so far. The first cloth is that of the start values.
 * 2. Joint fit: the method of descent runs on all unknowns together (cloth_estimator.h) from the best cloth of the
 *    screening. It is aware of noise as it is without numbers: estimates are pooled, steps that are worse beyond doubt
 *    are taken back, paths grow when the noise decides, and it ends when the possible decrease is below the noise or
 *    below what matters (gauss_newton.v1).
 *
 * The covariance of the joint fit is over all unknowns, so the errors of the scattering parameters contain the
 * uncertainty of the cloth. Both steps are deterministic functions of the estimates: with a journal below
 * (estimate_journal.h) a search resumes bit by bit.
 */
#ifndef SELVEDGE_OPTIMIZER_CLOTH_SEARCH_H
#define SELVEDGE_OPTIMIZER_CLOTH_SEARCH_H

#include "optimizer/fit/cloth/cloth_estimator.h"
#include "optimizer/fit/descent/fit_run.h"

enum { CLOTH_MAX_SCREEN = 32 };

struct cloth_search {
    const struct descent_method *method;
    const struct fit_problem *problem; /* of all unknowns; its estimator is cloth_estimator(cloth) or a journal of it */
    const struct fit_option *option;   /* of all unknowns; numbers are not tied */
    struct cloth_estimator *cloth;
    size_t n_screen;        /* cloths of the screening; 0 or 1: the joint fit begins at the start values */
    uint64_t screen_budget; /* paths of each of them */
    double screen_share;    /* of the screening in the progress, below 1 */
};

/* One cloth of the screening, internal units. */
struct cloth_screened {
    double number[CLOTH_MAX_FITTED];
    double objective, objective_se; /* with the penalties of the priors */
    uint64_t n_path;
};

struct cloth_search_result {
    size_t n_screen, i_best; /* 0 cloths: no screening was made */
    struct cloth_screened screened[CLOTH_MAX_SCREEN];
    struct fit_result joint; /* of all unknowns: scattering parameters, then numbers; paths and time of the joint fit */
    uint64_t n_path;         /* of screening and joint fit, without those of the differences */
    double wall_s;
};

/* Errors are those of fit_run; STATUS_INVALID for more than CLOTH_MAX_SCREEN cloths. */
status cloth_search_run(const struct cloth_search *q, struct cloth_search_result *r, struct error *err);

/* Takes the scattering parameters out of the result of a joint fit: values, and the marginal covariance, which contains
 * the uncertainty of the numbers. n_scattering_param: their count. */
void cloth_search_marginal(const struct fit_result *joint, const struct fit_option *option, size_t n_scattering_param,
                           size_t n_numbers, struct fit_result *out);

#endif
