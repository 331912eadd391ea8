/* Batches as the API sees them: the actions of users on all samples of a table at once. Every change holds the lock of
 * the job service and goes to the database in one transaction. Error texts are meant for users. */
#ifndef SELVEDGE_SERVER_BATCH_SERVICE_H
#define SELVEDGE_SERVER_BATCH_SERVICE_H

#include "server/batches/batch_table.h"
#include "server/store/store_batch.h"

/* The outcome of a submission. */
struct batch_outcome {
    char id[STORE_ID_BYTES];
    bool created;
    bool replayed;   /* the batch was like the table already */
    json_t *samples; /* [{"sample","job","outcome"}]: "new", "changed" or "taken_over"; owned by the caller */
    json_t *left;    /* [{"sample","job","cancelled"}]: jobs that are no part of the batch any more; owned */
};

/* Makes a batch of drafts and declares their files; files that the server knows are complete at once. Where the owner
 * has a batch of this name, jobs whose document and files equal their row are taken over as they are; the others leave
 * the batch, are cancelled if they have not ended, and keep their results. STATUS_EXISTS when that would change the
 * batch and table->update is false. After an error it can be repeated, and completes the missing parts. */
status batch_submit(struct job_service *v, const struct access_grant *grant, const struct batch_table *table,
                    struct batch_outcome *outcome, struct job_refusal *refusal, struct error *err);

enum batch_action {
    BATCH_START, /* queues drafts and cancelled jobs */
    BATCH_RETRY, /* queues failed jobs */
    BATCH_CANCEL /* cancels all that have not ended */
};
/* Acts on all jobs of a batch, in one transaction. priority: as for job_start; NULL: as it is. *n_changed jobs are
 * other than before; *refused (owned by the caller) is a list of {"sample","job","code","detail"}. STATUS_NOT_FOUND. */
status batch_act(struct job_service *v, const char *id, enum batch_action action, const int64_t *priority,
                 size_t *n_changed, json_t **refused, struct error *err);
/* Removes a batch. delete_jobs: with all its jobs; otherwise they stay, without a batch. STATUS_NOT_FOUND. */
status batch_delete(struct job_service *v, const char *id, bool delete_jobs, struct error *err);

/* Reads a batch; the caller releases the row. STATUS_NOT_FOUND. */
status batch_get(struct job_service *v, const char *id, struct batch_row *row, struct error *err);
/* Its jobs in the order of its table, without documents. The caller calls job_rows_free. */
status batch_jobs(struct job_service *v, const char *id, struct job_row **row, size_t *n, struct error *err);

#endif
