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
#include "optimizer/job/document/job_kind.h"
#include "optimizer/job/document/job_limits.h"
#include "optimizer/job/document/job_sections.h"

struct job_fault_list;

/* Owns the seven sections. Only the parser, its checks and the pipeline see all of them; other code takes the sections
 * that it reads, and includes their headers. */
struct job_document {
    struct job_fault_list *fault; /* all faults go there while the document is read; NULL: reading ends at the first */
    char sample[JOB_MAX_SAMPLE_BYTES];
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
enum job_kind job_document_kind(const struct job_document *doc);

/* Calls visit for every input file that the document names, with its role ("volume", "fibers", "environment",
 * "measurements", "photograph", "camera_noise", "dark_frame", "chart", "white_reference", "mesh", "profile"). */
void job_document_visit_files(const struct job_document *doc,
                              void (*visit)(void *context, const char *name, const char *role), void *context);
/* Writes the key that names an input file, as "photographs[2].file": the last one where several do, "" where none. */
void job_document_file_key(const struct job_document *doc, const char *name, char *key, size_t n_key);

#endif
