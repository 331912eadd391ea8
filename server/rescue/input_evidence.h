/* The input files of a job whose rows are lost: which were declared, and which of them are there and right. */
#ifndef SELVEDGE_SERVER_INPUT_EVIDENCE_H
#define SELVEDGE_SERVER_INPUT_EVIDENCE_H

#include "server/store/job_journal.h"

#include <stdio.h>

/* Computes the SHA-256 of a file as text, in constant memory. Links are not followed. STATUS_NOT_FOUND, STATUS_INVALID
 * (not a file), STATUS_IO. */
status input_hash(const char *path, char out[STORE_HASH_TEXT_BYTES], struct error *err);

struct input_request {
    const char *data;
    const struct job_row *job; /* with document */
    const struct job_journal *journal;
    const struct file_row *base; /* files by the backup */
    size_t n_base;
    FILE *notes;
};
/* The files that the journal declares, or else the backup, or else the document as far as they are there. A file is
 * complete if it is in input/, has its size and, where it is known, its checksum; any other is to be sent anew. The
 * caller frees *file. STATUS_NO_MEMORY, or an error of the document. */
status input_evidence_read(const struct input_request *request, struct file_row **file, size_t *n_file,
                           size_t *n_complete, struct error *err);

#endif
