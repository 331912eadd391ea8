/* Jobs as the API sees them. Every change of a job's state goes through these functions, under one lock and first in
 * the database. They are thread-safe. Their error texts are meant for users. */
#ifndef SELVEDGE_SERVER_JOB_SERVICE_H
#define SELVEDGE_SERVER_JOB_SERVICE_H

#include "base/catalogue/verdict_code.h"
#include "base/log.h"
#include "server/access/access_registry.h"
#include "server/files/upload.h"
#include "server/settings/settings.h"
#include "server/store/journal_seal.h"
#include "server/store/store.h"

#include <jansson.h>
#include <pthread.h>
#include <stdatomic.h>

struct change_feed;
struct backup_keeper;
struct queue_forecast;
struct lease_keeper;

/* A fair lock: threads get it in the order in which they ask for it. */
struct job_turns {
    pthread_mutex_t lock;
    pthread_cond_t next_turn;
    uint64_t n_asked, n_served;
};

/* The part of the daemon that runs jobs (server/workers/supervisor.h). All members are NULL while there is none, as in
 * tests. */
struct job_runner {
    const char *program; /* path of the worker program */
    /* Makes the runner look for changes at once. */
    void (*wake)(void *context);
    /* Writes why no job can be started at present, such as a cluster that cannot be reached; "" otherwise. */
    void (*trouble)(void *context, char *text, size_t n_text);
    void *context;
};

struct job_service {
    const struct settings *settings;
    char *letterhead; /* content of letterhead.json in the folders of jobs (settings/letterhead.h) */
    struct store *store;
    struct upload_set *upload;
    struct change_feed *feed;        /* wakes long polls */
    struct queue_forecast *forecast; /* of when queued jobs start */
    struct log *log;
    struct job_runner runner;
    struct backup_keeper *backup;   /* NULL when the settings say that there are no backups */
    struct lease_keeper *keeper;    /* NULL unless other daemons may use the database */
    struct journal_key journal_key; /* seals the journals of jobs */
    struct job_turns change;        /* held from reading a row to writing it back (server/jobs/job_change.h) */
    atomic_bool stopping;
    atomic_int n_judging; /* checks of input files that run now (server/workers/input_judge.h) */
    atomic_uint_least64_t n_attempt_total, n_lost_total, n_finished_total[JOB_N_STATE];
    atomic_uint_least64_t n_verdict_total[VERDICT_N_CODE]; /* of jobs that have succeeded */
};

/* Why a request is refused, beyond the status and the text of the error. */
struct job_refusal {
    const char *code; /* a code of problem_code.c, if the status does not determine it; else NULL */
    json_t *extra;    /* further members of the problem: {"missing_files"} or numbers; NULL or owned by the caller */
};

/* A job to be created: the text of its document, and the client's key for this request, or NULL. */
struct job_request {
    const char *document;
    size_t n_bytes;
    const char *idempotency_key;
    const struct access_grant *grant; /* owner of the job, and the quota of that owner */
};

/* Creates a draft and gives its id. *replayed: an earlier request with the same key and document has created it; its
 * id is given. */
status job_create(struct job_service *v, const struct job_request *request, char id[STORE_ID_BYTES], bool *replayed,
                  struct job_refusal *refusal, struct error *err);
/* Replaces the document. may_edit (NULL: always) receives the present job, which does not change until the document
 * is replaced; an error that it returns ends the call. */
status job_replace_document(struct job_service *v, const char *id, const char *document, size_t n_bytes,
                            status (*may_edit)(void *context, const struct job_row *row, struct error *err),
                            void *context, struct error *err);
/* *changed: false if the job already was in the requested state. priority: the new one of the job, also if it is queued
 * already; NULL: as it is. */
status job_start(struct job_service *v, const char *id, const int64_t *priority, bool *changed,
                 struct job_refusal *refusal, struct error *err);
status job_retry(struct job_service *v, const char *id, const int64_t *priority, bool *changed,
                 struct job_refusal *refusal, struct error *err);
status job_cancel(struct job_service *v, const char *id, bool *changed, struct error *err);
status job_delete(struct job_service *v, const char *id, struct error *err);
/* The same if may_remove returns STATUS_OK. It receives the job, which does not change until it is removed. */
status job_remove(struct job_service *v, const char *id,
                  status (*may_remove)(void *context, const struct job_row *row, struct error *err), void *context,
                  struct error *err);

/* Reads a job that exists and is not a tombstone. The caller releases the row. STATUS_NOT_FOUND. */
status job_get(struct job_service *v, const char *id, struct job_row *row, struct error *err);

/* The same without the document; there is nothing to release. */
status job_look(struct job_service *v, const char *id, struct job_row *row, struct error *err);

struct job_declaration {
    struct file_row row; /* name, role, size and sha256, which are checked; the whole row afterwards */
    bool existed;        /* the same declaration was made before */
    bool known;          /* a job of the same owner has these bytes (server/jobs/inputs) */
};
/* Declares n >= 1 files, all or none, in one transaction. *i_fault: the declaration that an error is about, or n. */
status job_declare_files(struct job_service *v, const struct access_grant *grant, const char *id,
                         struct job_declaration *file, size_t n, size_t *i_fault, struct job_refusal *refusal,
                         struct error *err);
status job_delete_file(struct job_service *v, const char *id, const char *name, struct error *err);
status job_delete_upload(struct job_service *v, const char *upload_id, struct error *err);

/* Sets *missing, a JSON array, to the names of files that the document uses and that are not complete.
 * STATUS_INVALID or STATUS_TOO_LARGE: the stored document is not valid under the present rules. */
status job_missing_files(struct job_service *v, const struct job_row *row, json_t **missing, struct error *err);
/* STATUS_DISK_FULL if less than the floor plus n_bytes is free. */
status job_disk_check(struct job_service *v, int64_t n_bytes, struct error *err);

#endif
