/* The methods of descent that the registry lists, and the functions that they share. */
#ifndef SELVEDGE_OPTIMIZER_DESCENT_METHODS_H
#define SELVEDGE_OPTIMIZER_DESCENT_METHODS_H

#include "optimizer/fit/descent/descent.h"

#define DESCENT_METHOD(name, ...) extern const struct descent_method descent_##name;
#include "base/catalogue/methods.def"

/* A running fit: buffers and totals that every method needs. */
struct descent_run {
    const struct fit_problem *problem;
    struct coordinate coordinate[FIT_MAX_PARAM];
    bool fixed[FIT_MAX_PARAM];
    size_t *n_path;              /* per configuration, for the next call */
    struct estimate *replica[2]; /* of the last descent_estimate */
    uint64_t path_budget, n_path_total, n_path_step;
    size_t n_step;
    double wall_s;
    double n_path_expected; /* of the whole fit, as the method predicts it; 0: the budget */
    double fraction;        /* as last reported; never falls */
    bool plain_paths;       /* of the method */
};

status descent_run_init(struct descent_run *run, const struct fit_problem *problem, const struct descent_method *method,
                        struct error *err);
void descent_run_release(struct descent_run *run);

/* Estimates two independent replicas at param with run->n_path paths each, into run->replica. Errors are the
 * estimator's. */
status descent_estimate(struct descent_run *run, const double *param, uint32_t iteration, bool want_jacobian,
                        struct error *err);
/* Counts the step, fills the totals into it, and calls the problem's report function, whose error it returns. */
status descent_report(struct descent_run *run, struct fit_step *step, struct error *err);
/* STATUS_INVALID: fewer than one observation, a start outside its bounds, more parameters than FIT_MAX_PARAM. */
status descent_check(const struct fit_problem *problem, struct error *err);

#endif
