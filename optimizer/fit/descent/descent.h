/* Methods of descent: one file each, one row in the catalogue (base/catalogue/methods.def), found by id.
 *
 * A method is a deterministic function of the problem and of the estimates it asks for; it keeps nothing between runs
 * and never looks at a clock. Therefore a fit is bit-identical for any number of threads and after a resume
 * (estimate_journal.h). */
#ifndef SELVEDGE_OPTIMIZER_DESCENT_H
#define SELVEDGE_OPTIMIZER_DESCENT_H

#include "base/catalogue/method_catalogue.h"
#include "base/catalogue/stop_reason.h"
#include "optimizer/fit/descent/cross_validation.h"
#include "optimizer/fit/descent/estimator.h"
#include "optimizer/fit/linear/fit_layout.h"
#include "optimizer/fit/linear/linear_model.h"
#include "optimizer/fit/linear/uncertainty.h"
#include "optimizer/fit/objective/coordinate.h"
#include "optimizer/fit/objective/objective.h"

enum { FIT_MAX_START = 16 };

/* One of several starts. */
struct fit_start {
    double from[FIT_MAX_PARAM], param[FIT_MAX_PARAM]; /* internal unit */
    double objective, objective_se, prior_penalty;
    double cross_validation; /* relative RMS error, where it chooses among the starts (cloth_search.h); NaN otherwise */
    bool converged;
    bool kept;
    bool elsewhere; /* its objective equals the kept start's within the noise, but its parameters differ */
    uint64_t n_path;
};

/* The report of a method after every iteration. Pointers are valid during the call. */
struct fit_step {
    size_t step;
    const char *phase;
    double wall_s; /* since the fit began, summed over this attempt and all earlier ones */
    uint64_t n_path, n_path_total;
    struct objective_value objective;
    size_t n_param, n_configuration;
    const double *param;    /* where the objective was estimated */
    const double *param_se; /* NULL when unknown */
    const struct estimate *replica[2];
    /* The step that led here: its largest move and the limit on it, both in units of coordinate.step_limit; the
     * predicted decrease of the objective; and the damping added to the diagonal. */
    double step_length, step_limit, decrease, damping;
    double noise; /* mean Monte-Carlo variance of a residual of the pooled model */
    const char *note;
    const struct fit_nuisance *nuisance; /* NULL: none */
};

struct fit_problem {
    size_t n_param;
    const struct param_info *info;         /* of the model */
    const struct fit_parameter *parameter; /* bounds, start and fixed flag of each */
    /* the fitted ones; each is one configuration of the estimator; contrasts come after all radiances */
    const struct observation_set *observation;
    const struct estimator *estimator;
    uint64_t path_budget; /* 0: the method's default */
    /* Ends the fit when the noise of tracing in the fitted means is at most this share of the errors of these means by
     * the photographs' stated errors; the budget is then the most that it takes. 0: no such goal. Methods without it
     * ignore it. */
    double precision;
    size_t max_iteration; /* 0: the method's default */
    size_t first_path;    /* of a configuration and replica in the first estimate; 0: the method's default */
    status (*report)(void *context, const struct fit_step *step, struct error *err); /* NULL: nobody listens */
    void *report_context;
    const struct progress *progress;    /* reports the used fraction of the paths that are expected */
    double usual_path;                  /* paths that such a fit usually takes, for its progress alone; 0: not known */
    const struct gaussian_prior *prior; /* n_param, in fit coordinates; NULL: none. Methods without priors ignore it */
    /* standard deviation of ln gain of every configuration, which is marginalised; 0: none. Methods without gains
     * ignore it */
    double gain_sd;
    bool discrepancy; /* cross-validation with a discrepancy (discrepancy_fit.h), whose share it finds */
};

struct fit_result {
    double param[FIT_MAX_PARAM];
    bool converged;
    enum stop_reason stop;
    char reason[240]; /* the stop reason as a sentence with numbers */
    size_t n_step;
    uint64_t n_path;
    double wall_s;
    struct objective_value objective; /* predicted at `param` by all estimates of the fit together */
    struct uncertainty uncertainty;
    struct cross_validation cross_validation;
    double prior_penalty; /* the priors' part of the objective at `param` */
    /* The fields below are filled in by fit_run (fit_run.h). */
    struct fit_nuisance nuisance;
    /* values of the unknowns of fit_layout.h: leaders of ties and nuisance terms */
    double unknown[FIT_MAX_PARAM];
    struct uncertainty unknown_uncertainty;
    size_t n_start; /* entries of start; 0 when there was only one start */
    struct fit_start start[FIT_MAX_START];
};

struct descent_method {
    const struct method_info *info; /* its row of the catalogue */
    bool plain_paths;               /* the method traces plain paths (estimator.h) */
    /* Least number of paths that a fit takes, however small its budget is. A fit with at least this budget keeps to
     * it. */
    uint64_t (*least_budget)(const struct fit_problem *problem);
    status (*run)(const struct fit_problem *problem, struct fit_result *result, struct error *err);
};

/* All methods in the order of the catalogue, NULL-terminated; and one by its id, NULL when there is none. */
const struct descent_method *const *descent_registry(void);
const struct descent_method *descent_find(const char *id);

#endif
