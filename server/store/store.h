/* The database of jobs: SQLite, one connection guarded by one mutex, WAL, synchronous=FULL, so what a call that returned
 * STATUS_OK has written survives power loss. The schema's version is PRAGMA user_version; an older file is copied to
 * <path>.v<old> and migrated, a newer one is refused. All functions may be called from any thread. */
#ifndef SELVEDGE_SERVER_STORE_H
#define SELVEDGE_SERVER_STORE_H

#include "base/status.h"

#include <stdbool.h>
#include <stdint.h>

enum { STORE_ID_BYTES = 40, STORE_HASH_TEXT_BYTES = 65, STORE_HASH_STATE_BYTES = 256 };

enum job_state {
    JOB_DRAFT,
    JOB_QUEUED,
    JOB_RUNNING,
    JOB_PAUSED,
    JOB_SUCCEEDED,
    JOB_FAILED,
    JOB_CANCELLED,
    JOB_N_STATE
};
const char *job_state_name(enum job_state state);
/* false when there is no such state */
bool job_state_parse(const char *name, enum job_state *state);

struct job_row {
    int64_t serial; /* given by the store, rises with every job */
    char id[STORE_ID_BYTES];
    char sample[256];
    char *document; /* JSON text, owned: job_row_release. NULL where it was not read */
    enum job_state state;
    bool cancel_requested;
    bool dirty;   /* edited after an attempt: the next start begins afresh */
    bool deleted; /* tombstone */
    int64_t attempt, lost_attempts, generation;
    char token[STORE_ID_BYTES];
    double created_unix_s, updated_unix_s, queued_unix_s, started_unix_s, finished_unix_s; /* 0: not yet */
    char error_code[32], error_field[160], error_text[1024];                               /* error_code "": none */
    int64_t peak_rss_bytes;
};
void job_row_release(struct job_row *row);

enum file_state { FILE_UPLOADING, FILE_VERIFIED, FILE_COMPLETE };

struct file_row {
    char id[STORE_ID_BYTES]; /* of the upload */
    char job_id[STORE_ID_BYTES];
    char name[128], role[32];
    int64_t size_bytes, offset_bytes;
    char sha256[STORE_HASH_TEXT_BYTES]; /* declared, or "" */
    enum file_state state;
    unsigned char hash_state[STORE_HASH_STATE_BYTES]; /* of the first offset_bytes */
};

struct store;

/* STATUS_UNSUPPORTED on a network file system or a newer schema. */
status store_open(const char *path, struct store **store, struct error *err);
void store_close(struct store *store);

/* idempotency_key NULL: none. body_hash is kept beside the key. One transaction. Sets row->serial. */
status store_job_insert(struct store *store, struct job_row *row, const char *idempotency_key, const char *body_hash,
                        struct error *err);
/* STATUS_NOT_FOUND when the key is new, or its job was deleted. */
status store_idempotency_find(struct store *store, const char *key, char job_id[STORE_ID_BYTES],
                              char body_hash[STORE_HASH_TEXT_BYTES], struct error *err);
/* Tombstones are found too (row->deleted). STATUS_NOT_FOUND. Release the row. */
status store_job_get(struct store *store, const char *id, struct job_row *row, struct error *err);
/* The same without the document, which may be large. */
status store_job_look(struct store *store, const char *id, struct job_row *row, struct error *err);
/* Everything but serial, id and created; sets updated. A document that was not read stays as it is. */
status store_job_update(struct store *store, struct job_row *row, struct error *err);
/* The row, its files and its idempotency keys. */
status store_job_erase(struct store *store, const char *id, struct error *err);

struct job_query {
    int state;             /* -1: all */
    int64_t before_serial; /* 0: from the newest */
    bool deleted;          /* tombstones instead of jobs */
    bool queue_order;      /* by queued_unix_s, oldest first */
    size_t limit;
};
/* *row is an array of *n rows, without their documents: job_rows_free. */
status store_job_list(struct store *store, const struct job_query *q, struct job_row **row, size_t *n,
                      struct error *err);
void job_rows_free(struct job_row *row, size_t n);
/* Jobs in each state, without tombstones. */
status store_job_count(struct store *store, int64_t n[JOB_N_STATE], struct error *err);

/* With its job's row (store_job_update; NULL: without) in one transaction: both are written, or neither. */
status store_file_insert(struct store *store, const struct file_row *row, struct job_row *job, struct error *err);
status store_file_get(struct store *store, const char *id, struct file_row *row, struct error *err);
status store_file_find(struct store *store, const char *job_id, const char *name, struct file_row *row,
                       struct error *err);
/* Offset, hash state, sha256, state. STATUS_NOT_FOUND when the row is gone. */
status store_file_update(struct store *store, const struct file_row *row, struct error *err);
/* With its job's row as above. */
status store_file_erase(struct store *store, const char *id, struct job_row *job, struct error *err);
/* In the order of declaration; free(*row). job_id NULL: of all jobs, those that are not complete. */
status store_file_list(struct store *store, const char *job_id, struct file_row **row, size_t *n, struct error *err);

/* For the readiness check: writes one row. */
status store_probe(struct store *store, struct error *err);

#endif
