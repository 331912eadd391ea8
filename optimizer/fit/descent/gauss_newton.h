/* Inside descent/: the state of gauss_newton.v1, which its four files share: gauss_newton.c (iterations and paths),
 * gauss_newton_step.c (the next step), gauss_newton_stop.c (when the fit ends) and gauss_newton_outlook.c (when it is
 * expected to). f is the objective, sum of r^2. */
#ifndef SELVEDGE_OPTIMIZER_GAUSS_NEWTON_H
#define SELVEDGE_OPTIMIZER_GAUSS_NEWTON_H

#include "optimizer/fit/descent/descent_methods.h"

enum { N = FIT_MAX_PARAM };
/* Effective paths from which on there is no regularization. */
#define GAUSS_NEWTON_REGULARIZED_UNTIL 40000.0

struct gauss_newton {
    struct descent_run run;
    struct linear_history history;
    struct linear_model model;
    double x[N];            /* fit coordinates where the next estimate is made */
    double best_x[N];       /* last point that was accepted */
    double best_f, best_se; /* objective there, by the pooled model */
    double limit_scale;     /* factor of the step limits, 1 or less */
    double n_path_mean;     /* paths of a configuration and replica in the next iteration */
    double predicted;       /* decrease of f by the last step, as the model predicted it */
    /* Of gauss_newton_step: */
    double decrease;       /* of f, by the step */
    double far_decrease;   /* of f, by several steps without damping */
    double noise;          /* mean Monte-Carlo variance of a residual */
    double damping;        /* added to the diagonal, per squared step limit */
    double largest_step;   /* largest move of a parameter, in step limits */
    double noise_decrease; /* expected decrease of the weighted f by a step that follows noise alone */
    bool regularized;      /* as long as the fit is regularized */
    bool at_misfit;        /* the regularization ended because the fit had arrived at misfit */
    /* Of gauss_newton_judge_progress: the accepted point with the lowest objective since the regularization ended, f
     * with priors there (which noise may make negative), and the iterations since f last fell by more than its noise
     * and a small share. */
    bool judged; /* whether there has been such a point */
    double lowest_x[N], lowest_f;
    size_t n_stalled;
    size_t n_free; /* free parameters */
};

/* Finds the next step dx[n_param] in fit coordinates, and fills in the fields above. far_decrease distinguishes a fit
 * that has arrived from one that moves along a valley in steps too short to show. STATUS_INTERNAL of
 * bounded_quadratic. */
status gauss_newton_step(struct gauss_newton *g, double *dx, struct error *err);
/* Returns the term that the regularization adds to f at x; 0 without it. */
double gauss_newton_regularization(const struct gauss_newton *g, const double *x);

/* Decrease of f that pure noise would predict. For f = r.r it is the noise variance of a residual for each free
 * direction, one to three times that because the three channels of a configuration share their paths. */
double gauss_newton_noise(const struct gauss_newton *g);
/* Whether further steps could lower f by no more than noise, or by too little to be worth their paths. */
bool gauss_newton_arrived(const struct gauss_newton *g);
/* Whether the noise of f, which is f +- se, is good enough. */
bool gauss_newton_precise(const struct gauss_newton *g, double f, double se);
/* Whether the noise is small beside the photographs' own errors; false when the job states a budget. */
bool gauss_newton_as_good_as_photographs(const struct gauss_newton *g);

/* Whether the noise is small enough for the job's goal of precision; false when it states none. */
bool gauss_newton_as_precise_as_asked(const struct gauss_newton *g);

/* Whether the fit has arrived with regularization, and misfit, not noise, makes the residuals there. */
bool gauss_newton_regularized_at_misfit(const struct gauss_newton *g);
/* Whether a step from such a place has led to where the noise is far larger: narrow lobes, whose few rare bright paths
 * make renderings too dark and the objective too low. */
bool gauss_newton_in_noise_trap(const struct gauss_newton *g);
/* Counts an accepted point with the objective f +- se, priors included, in lowest_x, lowest_f and n_stalled. */
void gauss_newton_judge_progress(struct gauss_newton *g, double f, double se);
/* Returns whether the remaining residuals are misfit: it rules, and further steps promise too little or have brought
 * nothing. */
bool gauss_newton_ends_at_misfit(const struct gauss_newton *g);
/* Fills in stop and reason of such a fit. */
void gauss_newton_explain_misfit(const struct gauss_newton *g, double f, double se, struct fit_result *result);

/* Factor by which the paths of the pooled means must grow until their noise ends the fit: 1 or less where it is good
 * enough. INFINITY where neither a target nor the photographs' errors can be reached. */
double gauss_newton_paths_to_grow(const struct gauss_newton *g, double f, double se);
/* Factor by which they must grow until it is plain that misfit makes the residuals. INFINITY where, by the decrease
 * that is predicted, it will not. */
double gauss_newton_paths_to_misfit(const struct gauss_newton *g);
/* Returns the paths that the whole fit is expected to take, at least the next iteration's and at most the budget: a
 * prediction for its progress alone. f is the objective with noise se. n_left: iterations that are allowed. */
double gauss_newton_expected_paths(const struct gauss_newton *g, double f, double se, size_t n_left);

/* Fills in stop and reason of a fit that ended because it had arrived. precise: gauss_newton_precise; otherwise it is
 * as good as the photographs, or as precise as the job asks for. */
void gauss_newton_explain_end(const struct gauss_newton *g, bool precise, double f, double se,
                              struct fit_result *result);
/* The state of a fit whose paths or iterations are used up. */
struct gauss_newton_end {
    enum stop_reason used_up; /* STOP_ITERATIONS or STOP_PATH_BUDGET */
    bool arrived, failed;     /* failed: the last step was taken back */
    double objective, objective_se;
};
/* Fills in stop and reason of such a fit: why it has converged (result->converged) or not. */
void gauss_newton_explain_early_end(const struct gauss_newton *g, const struct gauss_newton_end *end,
                                    struct fit_result *result);

#endif
