/* Inside the job-document parser: the part of the section "fit" that depends on the models. */
#ifndef SELVEDGE_OPTIMIZER_JOB_DOCUMENT_PARTS_H
#define SELVEDGE_OPTIMIZER_JOB_DOCUMENT_PARTS_H

#include "base/catalogue/model_catalogue.h"
#include "optimizer/job/job_document.h"
#include "optimizer/job/json_field.h"

/* Nothing asked for. */
void job_fit_option_init(struct job_fit_option *o);
/* The keys of job_fit_option.h out of the section "fit", for every model; then all parameters resolved. Everything else
 * of the section is read before. model: those of the document, in its order. */
status job_parse_fit_options(const struct json_field *f, const struct model_info *const *model,
                             struct job_document *doc, struct error *err);
/* True when parameter p leads others or follows one. */
bool job_parameter_is_tied(const struct job_fit_option *o, size_t n_param, size_t p);
/* Number of the parameters that "fixed" and "start" can name: all but the density multiplier, the last one of volume models,
 * which has keys of its own. */
size_t job_n_named_parameter(const struct model_info *m);
/* STATUS_INVALID at the key `path`, which names the parameter `key` that no model has; the text lists those they have. */
status job_unknown_parameter(const struct model_info *const *model, size_t n_model, const char *path, const char *key,
                             struct error *err);

#endif
