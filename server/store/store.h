/* The database of jobs: SQLite in a file, or PostgreSQL (sql/store_driver.h). The changes of a call that returned
 * STATUS_OK survive power loss; where the reply to a commit is lost, the call fails. One connection writes, a second
 * one reads, each guarded by a mutex: reading waits for no sync. A call sees the writes of every call that has
 * returned before. A database of an older version is migrated (the file of SQLite is copied to <path>.v<old>
 * first), a newer one is refused. All functions may be called from any thread; all may fail with STATUS_IO,
 * STATUS_DISK_FULL or STATUS_NO_MEMORY. */
#ifndef SELVEDGE_SERVER_STORE_H
#define SELVEDGE_SERVER_STORE_H

#include "base/status.h"
#include "server/store/drivers/store_driver.h"

#include <stdbool.h>
#include <stdint.h>

enum {
    STORE_ID_BYTES = 40,
    STORE_OWNER_BYTES = 65,
    STORE_HASH_TEXT_BYTES = 65,
    STORE_HASH_STATE_BYTES = 256,
    STORE_TAGS_BYTES = 704,
    STORE_KEY_BYTES = 256,
    STORE_NAME_BYTES = 256
};

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
/* Returns false when there is no such state. */
bool job_state_parse(const char *name, enum job_state *state);

struct job_row {
    int64_t serial; /* assigned by the store; rises with every job */
    char id[STORE_ID_BYTES];
    char sample[256];
    char *document;   /* JSON text, owned (job_row_release); NULL where it was not read */
    int64_t revision; /* rises with every change of the job, its document and its files */
    enum job_state state;
    bool cancel_requested;
    bool dirty;   /* edited after an attempt, so the next start discards earlier progress */
    bool deleted; /* the job is deleted, but its folder may still exist (tombstone) */
    int64_t attempt, lost_attempts, generation;
    char token[STORE_ID_BYTES];
    double created_unix_s, updated_unix_s, queued_unix_s, started_unix_s, finished_unix_s; /* 0: not yet */
    char error_code[32], error_field[160], error_text[1024];                               /* error_code "": none */
    int64_t peak_rss_bytes;
    char owner[STORE_OWNER_BYTES];     /* whose token made the job; "": made without a token. Never changes */
    int64_t priority;                  /* -10..10, higher first among the queued jobs of an owner */
    char tags[STORE_TAGS_BYTES];       /* "", or tags between spaces: " a b " */
    char verdict[40];                  /* its code, once the job has succeeded; "": none */
    char batch[STORE_ID_BYTES];        /* id of the batch (store_batch.h) that it is a sample of; "": none */
    int64_t batch_place;               /* its place in the table of the batch, from 0 */
    char batch_name[STORE_NAME_BYTES]; /* read with the row; only store_import writes it */
};
void job_row_release(struct job_row *row);

/* FILE_VERIFIED: all bytes are on disk and the checksum is right, but the file is not yet in its final place. */
enum file_state { FILE_UPLOADING, FILE_VERIFIED, FILE_COMPLETE };

struct file_row {
    char id[STORE_ID_BYTES]; /* identifies the upload */
    char job_id[STORE_ID_BYTES];
    char name[128], role[32];
    int64_t size_bytes, offset_bytes;
    char sha256[STORE_HASH_TEXT_BYTES]; /* as declared or, once verified, as computed; "" if neither */
    enum file_state state;
    unsigned char hash_state[STORE_HASH_STATE_BYTES]; /* of the first offset_bytes bytes */
    int64_t stored_offset_bytes; /* offset_bytes of the database when the row was read or written last */
};

struct store;

/* Whether a database may lie at this path or address: STATUS_UNSUPPORTED on a network file system, whose locks are not
 * reliable enough for SQLite; STATUS_IO. */
status store_check_place(const char *address, struct error *err);

/* Wipes and frees the password. */
void store_place_release(struct store_place *place);

/* Opens a database and brings its schema to the present version. STATUS_UNSUPPORTED on a network file system, for a
 * newer schema, or where a package is missing that the database needs. */
status store_open(const char *path, struct store **store, struct error *err);
status store_open_place(const struct store_place *place, struct store **store, struct error *err);
/* Opens the database of a daemon that runs. It is not migrated: STATUS_CONFLICT when the program expects another
 * version. *store is set then too, and may be asked about its server (store_server_look, store_clock) and closed. */
status store_open_place_beside(const struct store_place *place, struct store **store, struct error *err);
void store_close(struct store *store);
/* From now on `changed` is called with the id of a job after each change of it or of its files, by the thread that made
 * the change, and with NULL when any job may have changed (store_read_changes). To be called once, before other threads
 * use the store. */
void store_on_change(struct store *store, void (*changed)(void *context, const char *job_id), void *context);

/* Inserts a job, and its idempotency key with body_hash (key NULL: none), in one transaction. Sets row->serial. */
status store_job_insert(struct store *store, struct job_row *row, const char *idempotency_key, const char *body_hash,
                        struct error *err);
/* STATUS_NOT_FOUND when the key is new to this owner or its job was deleted. */
status store_idempotency_find(struct store *store, const char *owner, const char *key, char job_id[STORE_ID_BYTES],
                              char body_hash[STORE_HASH_TEXT_BYTES], struct error *err);
/* Reads a job; tombstones are found too (row->deleted). The caller releases the row. STATUS_NOT_FOUND. */
status store_job_get(struct store *store, const char *id, struct job_row *row, struct error *err);
/* The same without the document, which may be large. */
status store_job_look(struct store *store, const char *id, struct job_row *row, struct error *err);
/* Writes all columns except serial, id, created and the document, and sets updated. STATUS_NOT_FOUND. */
status store_job_update(struct store *store, struct job_row *row, struct error *err);
/* The same with the document, in one transaction. */
status store_job_replace(struct store *store, struct job_row *row, struct error *err);
/* Removes the row, its files and its idempotency keys. */
status store_job_erase(struct store *store, const char *id, struct error *err);

/* JOB_BY_PLACE is for the jobs of one batch, without after_serial. */
enum job_order { JOB_BY_CREATION, JOB_BY_END, JOB_BY_SAMPLE, JOB_BY_PLACE };

/* Selects jobs, and a place in the list to begin at. Members that are 0 or NULL select nothing. */
struct job_query {
    unsigned states; /* bits 1 << enum job_state */
    bool deleted;    /* tombstones instead of jobs */
    const char *owner;
    const char *sample; /* a part of the sample's name, whatever the case of A-Z */
    const char *id;     /* the beginning of the id */
    const char *tag;
    const char *batch;   /* id of a batch */
    const char *verdict; /* one of these codes between commas, such as ",good,usable,"; ",," has the jobs without one */
    double created_after_unix_s, created_before_unix_s;
    enum job_order order;
    bool ascending; /* the oldest first, or by the alphabet */
    size_t limit;
    int64_t after_serial;  /* the jobs that follow this one in the list; 0: from the beginning */
    const char *after_key; /* its sample, or its finished_unix_s in decimal */
};
/* *row is an array of *n rows without their documents; the caller calls job_rows_free. */
status store_job_list(struct store *store, const struct job_query *q, struct job_row **row, size_t *n,
                      struct error *err);
void job_rows_free(struct job_row *row, size_t n);
/* Calls visit for the row of each job, tombstones too. */
status store_job_ages(struct store *store, void (*visit)(void *context, const char *id, double updated_unix_s),
                      void *context, struct error *err);
/* A queued job, as far as its turn depends on it (server/jobs/queue_turn.h). */
struct queued_job {
    char id[STORE_ID_BYTES], owner[STORE_OWNER_BYTES], batch[STORE_ID_BYTES];
    int64_t priority;
    double queued_unix_s;
    double last_start_unix_s; /* when a job of this owner and batch was started last; 0: never */
};
/* Lists the first n_each queued jobs of each batch of each owner (jobs without a batch count as one batch), by priority
 * and then by queued_unix_s, owner by owner and batch by batch. The caller frees *job. */
status store_job_queue(struct store *store, size_t n_each, struct queued_job **job, size_t *n, struct error *err);
/* store_job_update for many jobs, in one transaction. */
status store_jobs_update(struct store *store, struct job_row *row, size_t n, struct error *err);
/* Sets verdicts that are not known yet: read gives the code of a job that has succeeded, or "". */
status store_fill_verdicts(struct store *store, void (*read)(void *context, const char *id, char code[40]),
                           void *context, struct error *err);
/* Counts the jobs of an owner (NULL: of all) by tag. *tag is an array that the caller frees. */
struct tag_count {
    char tag[48];
    int64_t n;
};
status store_tag_count(struct store *store, const char *owner, struct tag_count **tag, size_t *n, struct error *err);
/* Notes the bytes of the earlier results that a job keeps; they count as its owner's (owner_use). */
status store_job_version_bytes(struct store *store, const char *id, int64_t n_bytes, struct error *err);
/* Counts the jobs in each state, without tombstones. */
status store_job_count(struct store *store, int64_t n[JOB_N_STATE], struct error *err);

/* Inserts n files and updates their job's row (NULL: no job), as store_job_update does, in one transaction. */
status store_file_insert(struct store *store, const struct file_row *row, size_t n, struct job_row *job,
                         struct error *err);
/* By the id of its upload, and by job and name. STATUS_NOT_FOUND. */
status store_file_get(struct store *store, const char *id, struct file_row *row, struct error *err);
status store_file_find(struct store *store, const char *job_id, const char *name, struct file_row *row,
                       struct error *err);
/* Finds a complete file with this SHA-256, and of this size (-1: any), in a job of the owner, the newest of several.
 * STATUS_NOT_FOUND. */
status store_file_known(struct store *store, const char *owner, const char *sha256, int64_t size_bytes,
                        struct file_row *row, struct error *err);
/* Writes offset, hash state, sha256 and state. STATUS_NOT_FOUND when the row no longer exists, STATUS_STALE when the
 * database has another offset than stored_offset_bytes: another daemon has gone on with the upload. */
status store_file_update(struct store *store, struct file_row *row, struct error *err);
/* Removes a file and updates its job's row (NULL: no job) in one transaction. */
status store_file_erase(struct store *store, const char *id, struct job_row *job, struct error *err);
status store_file_count(struct store *store, const char *job_id, int64_t *n, struct error *err);
/* Lists files in the order of declaration; the caller frees *row. job_id NULL: the incomplete files of all jobs. */
status store_file_list(struct store *store, const char *job_id, struct file_row **row, size_t *n, struct error *err);

/* Writes all facts about a job in one transaction, over the job's present rows: the row as it is, updated_unix_s too,
 * document, files and idempotency key (NULL: none is added). row->serial is 0 for a new job, else the job's serial, and
 * is set. A job that ends by this makes a delivery (store_webhook_enable) like any other. */
status store_import(struct store *store, struct job_row *row, const struct file_row *file, size_t n_file,
                    const char *idempotency_key, const char *body_hash, struct error *err);

/* After a change that has found the disk full: lets changes take space that the database has already, so that deleting
 * is possible on a full disk. */
void store_make_room(struct store *store);

/* Writes one row, as a readiness check. */
status store_probe(struct store *store, struct error *err);

#endif
