/* Inside profile/: one search of profile_fit.h for the minimum, with fixed errors of the values. */
#ifndef SELVEDGE_OPTIMIZER_PROFILE_SEARCH_H
#define SELVEDGE_OPTIMIZER_PROFILE_SEARCH_H

#include "optimizer/fit/profile/profile_problem.h"

enum { PROFILE_MAX_UNKNOWN = FIT_MAX_PARAM + 2 };

/* Shared by all searches of a fit. The unknowns of the layout come first, then the turn of the section and ln of the
 * scale. */
struct profile_target {
    const struct profile_problem *problem;
    struct fit_layout layout;
    struct coordinate coordinate[FIT_MAX_PARAM];
    size_t i_turn, i_scale, n_unknown, n_value;
    size_t mode; /* of profile_work */
    bool fixed[PROFILE_MAX_UNKNOWN];
    double *measured, *base; /* m, and max(m, 0) + 0.02 mean of m; one of each value */
    double least;            /* 2 % of the largest m (profile_problem.h) */
};

/* A place of a search. */
struct profile_point {
    double x[PROFILE_MAX_UNKNOWN]; /* fit coordinates; the turn in radians; ln of the scale */
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
    double *by_turn;  /* and by the turn; NULL where it is not fitted */
    size_t n_evaluation;
    bool converged;
};

/* Where a search begins. A turn that is fitted begins at the best one of a scan over all turns, or, with `second`, at
 * the best one beyond the next maximum of the sum: a section that is turned by 90 degrees can be a minimum too. */
struct profile_start {
    const double *unknown; /* parameters of the layout */
    double misfit;
    bool second;
};

/* Takes memory; the search begins with the best scale. */
status profile_search_begin(struct profile_search *s, const struct profile_target *target, struct thread_pool *pool,
                            const struct profile_start *start, struct error *err);
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
