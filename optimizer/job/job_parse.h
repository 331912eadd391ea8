/* Reads a job document from its text. */
#ifndef SELVEDGE_OPTIMIZER_JOB_PARSE_H
#define SELVEDGE_OPTIMIZER_JOB_PARSE_H

#include "optimizer/job/document/job_document.h"

#include <jansson.h>

struct cloth_description;
struct job_fault_list;

/* Parses and checks n_bytes of text, which need not be NUL-terminated. On success the caller frees *doc with
 * job_document_free. */
status job_document_parse(const char *text, size_t n_bytes, struct job_document **doc, struct error *err);
/* The same from parsed JSON. */
status job_document_read(const json_t *json, struct job_document **doc, struct error *err);
/* Reads a document as job_document_parse does, and adds everything that is wrong with it to the list. A check that
 * compares several values is left out where one of these is wrong itself. *doc: the values that could be read, with
 * defaults in place of wrong values, to be released by the caller; NULL when the text is not JSON or memory is out. */
void job_document_inspect(const char *text, size_t n_bytes, struct job_document **doc, struct job_fault_list *list);
/* Reads the section "cloth" of a document alone. STATUS_INVALID names the field, as "cloth.weave". */
status job_parse_cloth(const json_t *section, struct cloth_description *cloth, struct error *err);

#endif
