/* Inside the job-document parser: one function a section. Each gets the section's object and fills its fields of doc.
 */
#ifndef SELVEDGE_OPTIMIZER_JOB_DOCUMENT_PARTS_H
#define SELVEDGE_OPTIMIZER_JOB_DOCUMENT_PARTS_H

#include "base/catalogue/model_catalogue.h"
#include "optimizer/job/job_document.h"
#include "optimizer/job/json_field.h"

status job_parse_volume(const struct json_field *f, struct job_document *doc, struct error *err);
status job_parse_fibers(const struct json_field *f, struct job_document *doc, struct error *err);
status job_parse_photographs(const struct json_field *root, struct job_document *doc, struct error *err);
status job_parse_fit(const struct json_field *f, struct job_document *doc, struct error *err);

/* Nothing asked for. */
void job_fit_option_init(struct job_fit_option *o);
/* The keys of job_fit_option.h out of the section "fit", for every model; then all parameters resolved. Everything else
 * of the section is read before. model: those of the document, in its order. */
status job_parse_fit_options(const struct json_field *f, const struct model_info *const *model,
                             struct job_document *doc, struct error *err);
/* "texture" of the section "fit"; the set-up, the observations and the rest of the section are read before. */
status job_parse_texture(const struct json_field *fit, struct job_document *doc, struct error *err);
/* "candidates" of the section "fit". */
status job_parse_candidates(const struct json_field *fit, struct job_document *doc, struct error *err);
/* The angle of a lamp, which may be behind a cloth without its black sheet. */
status job_parse_light_theta(const struct json_field *f, const struct job_document *doc, double *theta_deg,
                             struct error *err);
/* "unknown parameter": says what the models have. */
status job_unknown_parameter(const struct model_info *const *model, size_t n_model, const char *path, const char *key,
                             struct error *err);

/* A file name that the document gives: checked with job_file_name_valid. */
status job_parse_file_name(const struct json_field *f, const char *key, char out[JOB_MAX_NAME_BYTES],
                           struct error *err);
status job_check_file_name(const char *path, const char *name, struct error *err);

#endif
