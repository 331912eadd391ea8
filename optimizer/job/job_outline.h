/* The outline of a job document: its sample, the other jobs that it names, and its input files. The daemon, and a
 * worker that enters its sandbox, need no more of a document. */
#ifndef SELVEDGE_OPTIMIZER_JOB_OUTLINE_H
#define SELVEDGE_OPTIMIZER_JOB_OUTLINE_H

#include "base/status.h"
#include "optimizer/job/document/job_limits.h"

#include <jansson.h>
#include <stdbool.h>
#include <stddef.h>

struct job_fault_list;

struct job_outline_file {
    char name[JOB_MAX_NAME_BYTES];
    const char *role; /* "volume", "fibers", ... (job_sections.h); constant */
};

struct job_outline {
    char sample[JOB_MAX_SAMPLE_BYTES];
    char geometry_job[JOB_MAX_ID_BYTES], profile_job[JOB_MAX_ID_BYTES]; /* "" when none is named */
    bool export_pdf, export_blend; /* report.pdf, and the file cloth.blend, are wanted */
    size_t n_file;
    struct job_outline_file *file;
};

/* Reads and checks n_bytes of text. Errors as of job_document_parse. On success the caller releases the outline. */
status job_outline_read(const char *text, size_t n_bytes, struct job_outline *outline, struct error *err);
/* The same from parsed JSON. */
status job_outline_take(const json_t *json, struct job_outline *outline, struct error *err);
/* Reads a document and adds everything that is wrong with it to the list. The outline holds the files that could be
 * read; the caller releases it. */
void job_outline_inspect(const char *text, size_t n_bytes, struct job_outline *outline, struct job_fault_list *list);
void job_outline_release(struct job_outline *outline);

#endif
