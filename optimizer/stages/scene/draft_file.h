/* The draft of a described cloth from a file of a weavers' program. */
#ifndef SELVEDGE_OPTIMIZER_DRAFT_FILE_H
#define SELVEDGE_OPTIMIZER_DRAFT_FILE_H

#include "base/files/file_ledger.h"
#include "optimizer/job/document/job_cloth.h"

/* Reads the file at `path`, which cloth->draft_file names, and gives the description its draft. ledger: receives the
 * statements of the file, or NULL. Errors of weave_wif_read with the field OPTION_DRAFT_FILE; STATUS_INVALID for a
 * draft that holds no cloth together, and for orders and tiles of the document that do not fit it. */
status draft_file_take(const char *path, const struct job_cloth *cloth, struct file_ledger *ledger, struct error *err);

#endif
