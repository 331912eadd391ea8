/* Batches: named sets of jobs, the samples of one table, in the database of jobs. Membership is the column `batch` of a
 * job. As all of store.h. */
#ifndef SELVEDGE_SERVER_STORE_BATCH_H
#define SELVEDGE_SERVER_STORE_BATCH_H

#include "server/store/store.h"

struct batch_row {
    int64_t serial; /* assigned by the store */
    char id[STORE_ID_BYTES], owner[STORE_OWNER_BYTES];
    char name[STORE_NAME_BYTES]; /* unique among the batches of its owner */
    char *template_text;         /* JSON, owned (batch_row_release); NULL where it was not read */
    double created_unix_s, updated_unix_s;
};
void batch_row_release(struct batch_row *row);
void batch_rows_free(struct batch_row *row, size_t n);

/* Inserts a batch, or replaces template and time of the one with this id; inserts n_new drafts, and updates n_old jobs
 * as store_job_update does. All in one transaction. Sets the serials of new rows. */
status store_batch_write(struct store *store, struct batch_row *batch, struct job_row *new_job, size_t n_new,
                         struct job_row *old_job, size_t n_old, struct error *err);
/* Removes a batch, and updates n jobs, which leave it or are tombstones, in one transaction. */
status store_batch_erase(struct store *store, const char *id, struct job_row *job, size_t n, struct error *err);
/* By id, or by owner and name. The caller releases the row. STATUS_NOT_FOUND. */
status store_batch_get(struct store *store, const char *id, struct batch_row *row, struct error *err);
status store_batch_find(struct store *store, const char *owner, const char *name, struct batch_row *row,
                        struct error *err);
/* The newest batches of an owner (NULL: of all) before a serial (0: from the newest), without template. The
 * caller calls batch_rows_free. */
status store_batch_list(struct store *store, const char *owner, int64_t before_serial, size_t limit,
                        struct batch_row **row, size_t *n, struct error *err);
/* Counts the jobs of a batch in each state, without tombstones. */
status store_batch_count(struct store *store, const char *id, int64_t n[JOB_N_STATE], struct error *err);

#endif
