/* Jobs as the API sees them: every change of a job's state goes through here, under one lock, database first.
 * Thread-safe. Texts of errors are for the user. */
#ifndef SELVEDGE_SERVER_JOB_SERVICE_H
#define SELVEDGE_SERVER_JOB_SERVICE_H

#include "base/log.h"
#include "server/jobs/upload.h"
#include "server/settings.h"
#include "server/store/store.h"

#include <jansson.h>
#include <pthread.h>
#include <stdatomic.h>

struct supervisor;

struct job_service {
    const struct settings *settings;
    struct store *store;
    struct upload_set *upload;
    struct log *log;
    struct supervisor *supervisor; /* woken after changes; NULL in tests */
    pthread_mutex_t change;        /* held from reading a row to writing it back */
    atomic_bool stopping;
    atomic_uint_least64_t n_attempt_total, n_lost_total, n_finished_total[JOB_N_STATE];
};

/* Why a request was refused, when the status alone does not say: a code of http_problem.c, or NULL. */
struct job_refusal {
    const char *code;
    json_t *missing_files; /* owned by the caller */
};

/* Opens the database in the data folder, quarantines unknown job folders, removes tombstones, brings running jobs back to
 * the queue and uploads into a known state. */
status job_service_open(const struct settings *settings, struct log *log, struct job_service **service,
                        struct error *err);
void job_service_close(struct job_service *service);

/* A job to be made: the text of its document, and the client's key for this request, or NULL. */
struct job_request {
    const char *document;
    size_t n_bytes;
    const char *idempotency_key;
};

/* Makes a job in the state "draft" and gives its id. *replayed: a request with the same key and document has made it before;
 * that job's id is given. */
status job_create(struct job_service *v, const struct job_request *request, char id[STORE_ID_BYTES], bool *replayed,
                  struct job_refusal *refusal, struct error *err);
/* may_edit (NULL: always) sees the job as it is and is not changed by anyone until the document is replaced; what it returns
 * ends the call. */
status job_replace_document(struct job_service *v, const char *id, const char *document, size_t n_bytes,
                            status (*may_edit)(void *context, const struct job_row *row, struct error *err),
                            void *context, struct error *err);
/* *changed: false when the job was in the wanted state already. */
status job_start(struct job_service *v, const char *id, bool *changed, struct job_refusal *refusal, struct error *err);
status job_retry(struct job_service *v, const char *id, bool *changed, struct job_refusal *refusal, struct error *err);
status job_cancel(struct job_service *v, const char *id, bool *changed, struct error *err);
status job_delete(struct job_service *v, const char *id, struct error *err);

/* A job that exists and is not a tombstone. Release the row. */
status job_get(struct job_service *v, const char *id, struct job_row *row, struct error *err);

/* row: name, role, size, sha256 filled in and checked here. *existed: the same declaration was made before. */
status job_declare_file(struct job_service *v, const char *id, struct file_row *row, bool *existed,
                        struct job_refusal *refusal, struct error *err);
status job_delete_file(struct job_service *v, const char *id, const char *name, struct error *err);
status job_delete_upload(struct job_service *v, const char *upload_id, struct error *err);

/* Names that the document uses and that are not complete; *missing is a JSON array. STATUS_INVALID, STATUS_TOO_LARGE:
 * the stored document is one that is refused today. */
status job_missing_files(struct job_service *v, const struct job_row *row, json_t **missing, struct error *err);
/* STATUS_DISK_FULL when less than the floor (plus n_bytes) is free. */
status job_disk_check(struct job_service *v, int64_t n_bytes, struct error *err);

#endif
