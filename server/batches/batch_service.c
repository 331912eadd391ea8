#include "server/batches/batch_service.h"
#include "base/clock.h"
#include "server/jobs/disk_reserve.h"
#include "server/jobs/job_access.h"
#include "server/jobs/job_change.h"
#include "server/jobs/problem_code.h"
#include "server/settings/job_paths.h"

#include <stdlib.h>
#include <string.h>

status batch_get(struct job_service *v, const char *id, struct batch_row *row, struct error *err)
{
    *row = (struct batch_row){0};
    if (!id_valid(id)) return error_set(err, STATUS_NOT_FOUND, "batch '%.40s' does not exist", id);
    return store_batch_get(v->store, id, row, err);
}

status batch_jobs(struct job_service *v, const char *id, struct job_row **row, size_t *n, struct error *err)
{
    const struct job_query q = {.batch = id, .order = JOB_BY_PLACE, .ascending = true, .limit = SIZE_MAX >> 1};
    return store_job_list(v->store, &q, row, n, err);
}

/* An action on one job. *changed: the row differs from before. */
struct deed {
    struct job_service *v;
    enum batch_action action;
    const int64_t *priority;
};

static status queue_job(const struct deed *d, struct job_row *row, bool *changed, struct job_refusal *refusal,
                        struct error *err)
{
    struct job_row whole;
    status s = store_job_get(d->v->store, row->id, &whole, err);
    if (s != STATUS_OK) return s;
    s = job_make_queued(d->v, &whole, refusal, err);
    free(whole.document);
    whole.document = NULL;
    if (s != STATUS_OK) return s;
    if (d->priority != NULL) whole.priority = *d->priority;
    *row = whole;
    *changed = true;
    return STATUS_OK;
}

static void cancel_job(const struct deed *d, struct job_row *row, bool *changed)
{
    if (row->state >= JOB_SUCCEEDED || row->cancel_requested) return;
    *changed = true;
    if (row->state == JOB_RUNNING) {
        row->cancel_requested = true;
        return;
    }
    row->state = JOB_CANCELLED;
    row->finished_unix_s = clock_wall_s();
    atomic_fetch_add(&d->v->n_finished_total[JOB_CANCELLED], 1);
}

static status act_on(const struct deed *d, struct job_row *row, bool *changed, struct job_refusal *refusal,
                     struct error *err)
{
    bool starts = d->action == BATCH_START && (row->state == JOB_DRAFT || row->state == JOB_CANCELLED);
    if (starts || (d->action == BATCH_RETRY && row->state == JOB_FAILED))
        return queue_job(d, row, changed, refusal, err);
    if (d->action == BATCH_CANCEL) {
        cancel_job(d, row, changed);
        return STATUS_OK;
    }
    if (d->priority != NULL && row->state < JOB_SUCCEEDED && row->state != JOB_DRAFT && row->priority != *d->priority) {
        row->priority = *d->priority;
        *changed = true;
    }
    return STATUS_OK;
}

static void add_refused(json_t *list, const struct job_row *row, status s, const struct job_refusal *refusal,
                        const struct error *err)
{
    json_array_append_new(list, json_pack("{s:s,s:s,s:s,s:s}", "sample", row->sample, "job", row->id, "code",
                                          refusal->code != NULL ? refusal->code : http_problem_of_status(s)->code,
                                          "detail", err->text));
}

/* The changed rows are moved to the front of the array. */
static status act_locked(const struct deed *d, struct job_row *row, size_t n, size_t *n_changed, json_t *refused,
                         struct error *err)
{
    for (size_t i = 0; i < n; i++) {
        struct job_refusal refusal = {0};
        struct error one = {0};
        bool changed = false;
        status s = act_on(d, &row[i], &changed, &refusal, &one);
        json_decref(refusal.extra);
        if (s == STATUS_DISK_FULL || s == STATUS_IO || s == STATUS_NO_MEMORY) {
            *err = one;
            return s;
        }
        if (s != STATUS_OK) add_refused(refused, &row[i], s, &refusal, &one);
        if (changed) row[(*n_changed)++] = row[i];
    }
    status s = store_jobs_update(d->v->store, row, *n_changed, err);
    if (s == STATUS_OK) job_note_all(d->v, row, *n_changed);
    return s;
}

status batch_act(struct job_service *v, const char *id, enum batch_action action, const int64_t *priority,
                 size_t *n_changed, json_t **refused, struct error *err)
{
    static const char *const verb[] = {"started", "retried", "cancelled"};
    const struct deed deed = {v, action, priority};
    struct batch_row batch;
    struct job_row *row = NULL;
    size_t n = 0;
    *n_changed = 0;
    *refused = json_array();
    job_change_begin(v, NULL, NULL);
    status s = batch_get(v, id, &batch, err);
    if (s == STATUS_OK) s = batch_jobs(v, id, &row, &n, err);
    if (s == STATUS_OK) s = act_locked(&deed, row, n, n_changed, *refused, err);
    job_change_end(v);
    if (s == STATUS_OK && *n_changed > 0) log_info(v->log, "batch %s: %zu jobs %s", id, *n_changed, verb[action]);
    if (s == STATUS_OK && *n_changed > 0) job_wake_runner(v);
    free(row); /* without documents; rows moved to the front must not be released twice */
    batch_row_release(&batch);
    return s;
}

status batch_delete(struct job_service *v, const char *id, bool delete_jobs, struct error *err)
{
    struct batch_row batch;
    struct job_row *row = NULL;
    size_t n = 0;
    job_change_begin(v, NULL, NULL);
    status s = batch_get(v, id, &batch, err);
    if (s == STATUS_OK) s = batch_jobs(v, id, &row, &n, err);
    for (size_t i = 0; s == STATUS_OK && i < n; i++) {
        row[i].batch[0] = '\0';
        row[i].batch_place = 0;
        row[i].deleted = delete_jobs;
    }
    if (s == STATUS_OK) s = store_batch_erase(v->store, id, row, n, err);
    for (int step = 0; s == STATUS_DISK_FULL && disk_reserve_make_room(v, &step);)
        s = store_batch_erase(v->store, id, row, n, err);
    if (s == STATUS_OK) job_note_all(v, row, n);
    job_change_end(v);
    if (s == STATUS_OK) {
        for (size_t i = 0; delete_jobs && i < n; i++) upload_discard_job(v->upload, row[i].id);
        log_info(v->log, "batch %s '%s' deleted, its %zu jobs %s", id, batch.name, n, delete_jobs ? "too" : "stay");
        job_wake_runner(v);
    }
    job_rows_free(row, n);
    batch_row_release(&batch);
    return s;
}
