/* A fit of a cloth's numbers together with the scattering parameters.
 *
 * 1. Screening: the scattering parameters alone are fitted, with few paths, to a few cloths that are spread evenly over
 *    the bounds of the numbers (fit_run_start). All of these fits use the same random numbers and begin at the job's
 *    start. The first cloth has the start values. The cloths of the extra starts follow; their fits begin at scattering
 *    parameters of their own.
 * 2. Joint fit: the method of descent runs on all unknowns together (cloth_estimator.h) from the best cloth of the
 *    screening. It is aware of noise as it is without numbers: estimates are pooled, steps that are worse beyond doubt
 *    are taken back, paths grow when the noise decides, and it ends when the possible decrease is below the noise or
 *    too small to matter (gauss_newton.v1).
 *
 * 3. Final fit: the scattering parameters alone on the cloth of the joint fit. Where the best cloth of the screening
 *    has an objective that is lower beyond doubt, this cloth is fitted as well and the lower one of both is taken. The
 *    source may make larger tiles of these cloths, in which the random places of single fibers count less.
 *
 * With several starts (fit_option.n_start) all of this is done as often. Each later search screens one cloth of its
 * own, the next one of the evenly spread sequence, and the search whose final fit predicts left-out rows best
 * (cross_validation.h) is the result. An objective would not do: where the model misses the rows, many cloths reach
 * about the same objective, and differ in their predictions between the rows. Without cross-validation a later search
 * is taken when its objective is lower by more than two standard errors.
 *
 * The covariance of the scattering parameters is the final fit's, plus the part of the numbers by the joint fit: cov(p)
 * = cov(p | x) + C_px C_xx^-1 C_xp with C the joint covariance (law of total covariance). Their errors thus contain the
 * uncertainty of the cloth. All steps are deterministic functions of the estimates: with a journal below
 * (estimate_journal.h) a search resumes bit by bit. */
#ifndef SELVEDGE_OPTIMIZER_CLOTH_SEARCH_H
#define SELVEDGE_OPTIMIZER_CLOTH_SEARCH_H

#include "optimizer/fit/cloth/cloth_estimator.h"
#include "optimizer/fit/descent/fit_run.h"

enum { CLOTH_MAX_SCREEN = 32 };

struct cloth_search {
    const struct descent_method *method;
    /* of all unknowns; its estimator is cloth_estimator(cloth) or a journal of it, its budget the paths of one search's
     * joint fit without the differences */
    const struct fit_problem *problem;
    const struct fit_option *option; /* of all unknowns, extra starts too; numbers are not tied */
    struct cloth_estimator *cloth;
    /* Cloths of the screening, more than extra starts. 1: the cloth of the start values alone, so that the joint fit
     * begins with parameters that are fitted to it; 0: the joint fit begins at the start values. */
    size_t n_screen;        /* of the first search */
    uint64_t screen_budget; /* most paths of each of them */
    /* Paths that the budget of `problem` leaves for the whole screening. The joint fit gets the rest that the screening
     * leaves, or pays for its excess, and has at least least_joint_budget. */
    uint64_t screen_expected, least_joint_budget;
    uint64_t final_budget;            /* paths of the final fit; where a second one is needed, it takes as many */
    double screen_share, final_share; /* of the progress, together below 1 */
};

/* One cloth of the screening, internal units. */
struct cloth_screened {
    double number[CLOTH_MAX_FITTED];
    double objective, objective_se; /* with the penalties of the priors */
    uint64_t n_path;
};

struct cloth_search_result {
    size_t n_screen, i_best; /* 0 cloths: no screening was made, and screened[0].number is where the joint fit began */
    struct cloth_screened screened[CLOTH_MAX_SCREEN];
    bool took_screened;              /* the joint fit ended worse than the best cloth of the screening */
    double number[CLOTH_MAX_FITTED]; /* of the final fit */
    struct fit_result joint;         /* of all unknowns: scattering parameters, then numbers */
    struct fit_result final;         /* the same unknowns with fixed numbers */
    size_t n_step;                   /* of all fits; the next two likewise */
    uint64_t n_path;                 /* without the paths of the differences */
    double wall_s;
};

/* Errors: from fit_run; STATUS_INVALID for more than CLOTH_MAX_SCREEN cloths. With several starts r->final lists them,
 * and r is the best one's but for n_step, n_path and wall_s. */
status cloth_search_run(const struct cloth_search *q, struct cloth_search_result *r, struct error *err);

/* The result for the scattering parameters alone: the final fit with the covariance stated above. */
void cloth_search_marginal(const struct cloth_search *q, const struct cloth_search_result *r, struct fit_result *out);

#endif
