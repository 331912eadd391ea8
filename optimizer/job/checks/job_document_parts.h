/* Inside the job-document parser: the part of the section "fit" that depends on the models. */
#ifndef SELVEDGE_OPTIMIZER_JOB_DOCUMENT_PARTS_H
#define SELVEDGE_OPTIMIZER_JOB_DOCUMENT_PARTS_H

#include "base/catalogue/model_catalogue.h"
#include "base/status.h"
#include "optimizer/job/document/json_field.h"

struct job_cloth;
struct job_fit;
struct job_fit_option;

/* Sets the defaults: no ties, bounds, priors or nuisance terms, and one start. */
void job_fit_option_init(struct job_fit_option *o);
/* Reads the keys of job_fit_option.h from the section "fit" for every model, and then resolves all parameters
 * (job_fit_resolve). The rest of the section must have been read before. model: the models of the document, in its
 * order. */
status job_parse_fit_options(const struct json_field *f, const struct model_info *const *model, struct job_fit *fit,
                             struct error *err);
/* True when parameter p is tied to another parameter, as leader or as follower. */
bool job_parameter_is_tied(const struct job_fit_option *o, size_t n_param, size_t p);
/* Number of parameters that "fixed" and "start" can name. It excludes the density multiplier, the last parameter of a
 * volume model, which has keys of its own. */
size_t job_n_named_parameter(const struct model_info *m);
/* Adds a group of fibers, which has scattering parameters of its own. Returns STATUS_INVALID with the key `path` when
 * the name is not valid or was given before. */
status job_add_group(struct job_cloth *cloth, const char *name, const char *path, struct error *err);
/* Writes the indices of the parameters among the first n_param that a key names: a colour ("C_TT") or one parameter
 * ("C_TT.r"), of one set ("warp.C_TT") or of all. Returns their number. slot has n_param
 * elements. */
size_t job_parameter_slots(const struct model_info *m, size_t n_param, const char *key, size_t *slot);
/* Returns STATUS_INVALID for the key `path`, which names a parameter `key` that no model has. The text lists the
 * parameters that the models have. */
status job_unknown_parameter(const struct model_info *const *model, size_t n_model, const char *path, const char *key,
                             struct error *err);

#endif
