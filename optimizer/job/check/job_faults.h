/* All faults of a job document at once: the reader of options goes on after a value that is not allowed. */
#ifndef SELVEDGE_OPTIMIZER_JOB_FAULTS_H
#define SELVEDGE_OPTIMIZER_JOB_FAULTS_H

#include "base/status.h"

#include <jansson.h>

struct job_document;

enum { JOB_MAX_FAULT = 100 };

struct job_fault_list {
    size_t n, n_more; /* n_more: faults beyond JOB_MAX_FAULT, which are not kept */
    struct error fault[JOB_MAX_FAULT];
};

/* Adds a fault; one with the same field and text is not added again. */
void job_faults_add(struct job_fault_list *list, const struct error *fault);
/* [{"code", "field", "detail"}], and a last entry that counts those that were not kept. The caller owns it. */
json_t *job_faults_json(const struct job_fault_list *list);

/* Reads a document as job_document_parse does, and adds everything that is wrong with it to the list. A check that
 * compares several values is left out where one of these is wrong itself. *doc: what could be read, with defaults in
 * place of wrong values, to be released by the caller; NULL when the text is not JSON or memory is out. */
void job_document_inspect(const char *text, size_t n_bytes, struct job_document **doc, struct job_fault_list *list);

#endif
