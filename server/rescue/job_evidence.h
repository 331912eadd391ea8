/* The evidence about a job in its folder: its journal, its document, its inputs, and the files of its worker. From this
 * the rows of the job can be written again. The input files are read whole, and their checksums compared. */
#ifndef SELVEDGE_SERVER_JOB_EVIDENCE_H
#define SELVEDGE_SERVER_JOB_EVIDENCE_H

#include "server/store/job_journal.h"

#include <stdio.h>

struct evidence_request {
    const char *data, *id; /* the folder is DATA/jobs/ID */
    /* row of the job by the backup; base NULL: there is none */
    const struct job_row *base;
    const struct file_row *base_file;
    size_t n_base_file;
    bool resume; /* a job that was running or paused is queued; otherwise it is cancelled and can be retried */
    FILE *notes; /* gets a line for everything that is not as it was */
};

struct job_evidence {
    struct job_row row; /* with document and, if the backup has the job, its serial */
    char key[JOURNAL_KEY_BYTES], body_hash[STORE_HASH_TEXT_BYTES]; /* "": none */
    struct file_row *file;
    size_t n_file, n_complete; /* the others must be sent again, from their beginning */
};

/* The caller releases the evidence, after an error too. STATUS_NOT_FOUND: the folder has neither document nor journal,
 * and there is no backup of the job. STATUS_FORMAT or STATUS_INVALID: there is no document that can be read. STATUS_IO,
 * STATUS_NO_MEMORY. */
status job_evidence_read(const struct evidence_request *request, struct job_evidence *evidence, struct error *err);
void job_evidence_release(struct job_evidence *evidence);

#endif
