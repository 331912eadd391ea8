/* Inside profile/: one search of profile_fit.h for the minimum, with fixed errors of the values. */
#ifndef SELVEDGE_OPTIMIZER_PROFILE_SEARCH_H
#define SELVEDGE_OPTIMIZER_PROFILE_SEARCH_H

#include "optimizer/fit/profile/profile_problem.h"

enum { PROFILE_MAX_UNKNOWN = FIT_MAX_PARAM + 1 };

/* Shared by all searches of a fit. The unknowns of the layout come first, then ln of the scale. */
struct profile_target {
    const struct profile_problem *problem;
    struct fit_layout layout;
    struct coordinate coordinate[FIT_MAX_PARAM];
    size_t n_unknown, n_value;
    bool fixed[PROFILE_MAX_UNKNOWN];
    double *measured, *base; /* m, and max(m, 0) + 0.02 mean of m; one of each value */
};

/* A place of a search. */
struct profile_point {
    double x[PROFILE_MAX_UNKNOWN]; /* fit coordinates; the last one is ln of the scale */
    double f;                      /* the minimised sum, priors included */
    double *value, *jac;           /* s L; its derivatives by x, jac[i * n_unknown + u] */
};

struct profile_search {
    const struct profile_target *target;
    struct thread_pool *pool;
    struct progress progress; /* of this search alone */
    struct profile_point here, next;
    double *error;    /* e of each value */
    double *by_param; /* derivatives by the model's parameters */
    size_t n_evaluation;
    bool converged;
};

/* Takes memory; the search starts at the parameters `unknown` of the layout with the best scale there. */
status profile_search_begin(struct profile_search *s, const struct profile_target *target, struct thread_pool *pool,
                            const double *unknown, double misfit, struct error *err);
void profile_search_end(struct profile_search *s);
/* Memory of one search. */
size_t profile_search_bytes(const struct fiber_profile *profile, size_t n_param);
/* Goes on for at most max_iteration steps, and reports the share of these that are done. */
status profile_search_run(struct profile_search *s, size_t max_iteration, struct error *err);
/* The error e of each value for a relative misfit t. */
void profile_search_set_misfit(struct profile_search *s, double misfit);
/* J'J + priors at the present place, n_unknown x n_unknown, and half the gradient of f. */
void profile_search_normal(const struct profile_search *s, double *hessian, double *gradient);

#endif
