/* The job document: the description of a job, as JSON text and as a struct. The daemon and the worker read and check it
 * with the same code.
 *
 * The keys, with type, unit, range, default and meaning, are the rows of optimizer/job/options (for people:
 * docs/sample-preparation.md, section 4). Unknown keys are errors, so that a misspelt option is not ignored. Errors:
 * STATUS_INVALID with err->field a key such as "photographs[3].light_theta_deg" and a text that names the allowed
 * values. */
#ifndef SELVEDGE_OPTIMIZER_JOB_DOCUMENT_H
#define SELVEDGE_OPTIMIZER_JOB_DOCUMENT_H

#include "base/status.h"
#include "optimizer/job/document/job_limits.h"
#include "optimizer/job/document/job_sections.h"

/* Owns the seven sections. Only the parser and the owners of a document see all of them; other code takes the sections
 * that it reads, and includes their headers. */
struct job_document {
    struct job_scan *scan;
    struct job_cloth *cloth;
    struct job_setup *setup;
    struct job_rows *rows;
    struct job_profile *profile;
    struct job_fit *fit;
    struct job_results *results;
};

/* Returns a document whose members are all zero, NULL when memory is out. */
struct job_document *job_document_new(void);
struct job_sections job_document_sections(const struct job_document *doc);
void job_document_free(struct job_document *doc);

#endif
