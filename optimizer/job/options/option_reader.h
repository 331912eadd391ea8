/* Reads a job document by the rows of the option table. */
#ifndef SELVEDGE_OPTIMIZER_OPTION_READER_H
#define SELVEDGE_OPTIMIZER_OPTION_READER_H

#include "optimizer/job/document/job_document.h"

#include <jansson.h>

struct job_fault_list;

/* Puts the default of every option into a zeroed document. */
status job_options_default(struct job_document *doc, struct error *err);
/* Reads all options into doc, which must hold their defaults. An unknown key, or a value that its row does not allow,
 * is an error: STATUS_INVALID with the key in err->field. With a list of faults it is added there, and reading goes on.
 * Lists that were allocated belong to doc, also after an error. */
status job_options_read(const json_t *document, struct job_document *doc, struct job_fault_list *faults,
                        struct error *err);

#endif
