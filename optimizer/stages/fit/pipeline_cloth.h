/* The numbers of a cloth that a job has fitted: which they are, the cloth at given values, and the fit of numbers and
 * scattering parameters together (optimizer/fit/cloth). Each model of the job gets its own numbers, and its results are
 * computed on the cloth of these numbers.
 *
 * The path budget of the job counts every path of the search: at most 25 % go to the screening, 25 to 40 % to the final
 * fit, and the rest to the joint fit and its differences. All estimates go through one journal, so the search resumes
 * bit by bit. */
#ifndef SELVEDGE_OPTIMIZER_PIPELINE_CLOTH_H
#define SELVEDGE_OPTIMIZER_PIPELINE_CLOTH_H

#include "optimizer/fit/cloth/cloth_search.h"
#include "optimizer/fit/descent/estimate_journal.h"
#include "optimizer/stages/fit_stages.h"

/* Fills in in->number from the document. STATUS_INVALID with the field at fault when the job asks for something that
 * numbers exclude (volume models, the search for the fiber radius), or for too many. */
status cloth_numbers_read(struct job_inputs *in, struct error *err);

/* The unknowns of a joint fit: the parameters of the model, then the numbers. */
struct pipeline_joint {
    size_t n_scattering;
    struct model_info info; /* the model's, with n_param and param of all unknowns */
    struct param_info param[FIT_MAX_PARAM];
    struct fit_parameter parameter[FIT_MAX_PARAM];
    struct fit_option option;
};
/* STATUS_TOO_LARGE when there are more unknowns than FIT_MAX_PARAM. */
status pipeline_joint_init(const struct model_setup *m, const struct cloth_numbers *number, struct pipeline_joint *j,
                           struct error *err);

/* The path tracer behind a journal for one cloth after the other. Must not move in memory until it is closed, and must
 * be closed after an error too. */
struct pipeline_cloth_trace;
status pipeline_cloth_open(const struct cloth_job *job, struct made_cloth *made, size_t i_model,
                           const struct pipeline_joint *j, struct pipeline_cloth_trace **trace,
                           struct estimate_journal **journal, struct error *err);
void pipeline_cloth_close(struct pipeline_cloth_trace *t);

/* Runs the search for the given problem of j, whose estimator and budget are set here. Fills in fit. */
status pipeline_cloth_fit(struct pipeline_cloth_trace *trace, const struct pipeline_joint *j,
                          const struct fit_problem *problem, struct model_fit *fit, struct error *err);

/* Returns the least number of paths that n_start searches take, however small the budget is: for the screening of
 * n_extra starts, the joint fits with their differences, and the final fits. least: the least paths of one fit by the
 * method alone. */
uint64_t pipeline_cloth_least_budget(const struct cloth_numbers *number, uint64_t least, size_t n_start,
                                     size_t n_extra);

/* Builds the fibers and the scene of `made` at the model's fitted numbers, unless `made` has them already. Does nothing
 * without numbers. */
status pipeline_cloth_use(const struct cloth_job *job, const struct model_fit *fit, size_t i_model,
                          struct made_cloth *made, struct error *err);

#endif
