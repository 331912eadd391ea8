/* The actions of users on a job: start, retry, cancel, delete. */
#include "base/clock.h"
#include "server/files/worker_files.h"
#include "server/jobs/job_access.h"
#include "server/jobs/job_change.h"
#include "server/jobs/job_service.h"

#include <string.h>

/* Returns the bytes that a job writes by its plan when it runs for the first time; 0 without a plan. */
static int64_t planned_bytes(const struct job_service *v, const struct job_row *row)
{
    json_t *plan = row->attempt == 0 ? worker_plan_read(v->settings->data, row->id) : NULL;
    const double n = json_number_value(json_object_get(plan, "disk_bytes"));
    json_decref(plan);
    return (int64_t)n;
}

status job_make_queued(struct job_service *v, struct job_row *row, struct job_refusal *refusal, struct error *err)
{
    status s = job_disk_check(v, planned_bytes(v, row), err);
    if (s != STATUS_OK) return s;
    json_t *missing = NULL;
    s = job_missing_files(v, row, &missing, err);
    if (s != STATUS_OK) return s;
    size_t n = json_array_size(missing);
    if (n > 0) {
        refusal->code = "files_missing";
        refusal->extra = json_pack("{s:O}", "missing_files", missing);
        s = error_set(err, STATUS_CONFLICT, "cannot start: %zu input file%s not complete; the first is '%s'", n,
                      n == 1 ? " is" : "s are", json_string_value(json_array_get(missing, 0)));
    }
    json_decref(missing);
    if (s == STATUS_OK) s = job_check_adopted(v, row, err);
    if (s != STATUS_OK) return s;
    row->state = JOB_QUEUED;
    row->lost_attempts = 0;
    row->cancel_requested = false;
    row->error_code[0] = row->error_field[0] = row->error_text[0] = '\0';
    row->queued_unix_s = clock_wall_s();
    row->started_unix_s = row->finished_unix_s = 0;
    return STATUS_OK;
}

static status begin(struct job_service *v, const char *id, bool retry, const int64_t *priority, bool *changed,
                    struct job_refusal *refusal, struct error *err)
{
    struct job_row row;
    *changed = false;
    job_change_begin(v, id, NULL);
    status s = job_get(v, id, &row, err);
    if (s != STATUS_OK) goto out;
    bool other = priority != NULL && *priority != row.priority;
    if (other) row.priority = *priority;
    if (job_active(&row)) {
        if (row.cancel_requested)
            s = error_set(err, STATUS_CONFLICT,
                          "cannot start the job while it is being cancelled; wait until it has stopped");
        else if (other)
            s = job_update(v, &row, err);
        goto out;
    }
    if (retry && row.state != JOB_FAILED && row.state != JOB_CANCELLED) {
        s = error_set(err, STATUS_CONFLICT,
                      "cannot retry a job that is %s; only failed and cancelled jobs can be retried",
                      job_state_name(row.state));
        goto out;
    }
    if (row.state == JOB_SUCCEEDED) goto out;
    s = job_make_queued(v, &row, refusal, err);
    if (s == STATUS_OK) s = job_update(v, &row, err);
    *changed = s == STATUS_OK;
    if (*changed) log_info(v->log, "job %s queued", row.id);
out:
    job_change_end(v);
    job_row_release(&row);
    if (*changed) job_wake_runner(v);
    return s;
}

status job_start(struct job_service *v, const char *id, const int64_t *priority, bool *changed,
                 struct job_refusal *refusal, struct error *err)
{
    return begin(v, id, false, priority, changed, refusal, err);
}

status job_retry(struct job_service *v, const char *id, const int64_t *priority, bool *changed,
                 struct job_refusal *refusal, struct error *err)
{
    return begin(v, id, true, priority, changed, refusal, err);
}

status job_cancel(struct job_service *v, const char *id, bool *changed, struct error *err)
{
    struct job_row row;
    *changed = false;
    job_change_begin(v, id, NULL);
    status s = job_get(v, id, &row, err);
    if (s != STATUS_OK || row.state == JOB_SUCCEEDED || row.state == JOB_FAILED || row.state == JOB_CANCELLED) goto out;
    if (row.state == JOB_RUNNING) {
        *changed = true;
        if (row.cancel_requested) goto out;
        row.cancel_requested = true;
    } else {
        row.state = JOB_CANCELLED;
        row.finished_unix_s = clock_wall_s();
        atomic_fetch_add(&v->n_finished_total[JOB_CANCELLED], 1);
    }
    s = job_update_surely(v, &row, err);
    if (s == STATUS_OK) log_info(v->log, "job %s: cancellation requested", row.id);
out:
    job_change_end(v);
    job_row_release(&row);
    if (*changed) job_wake_runner(v);
    return s;
}

status job_delete(struct job_service *v, const char *id, struct error *err)
{
    return job_remove(v, id, NULL, NULL, err);
}

status job_remove(struct job_service *v, const char *id,
                  status (*may_remove)(void *context, const struct job_row *row, struct error *err), void *context,
                  struct error *err)
{
    struct job_row row;
    job_change_begin(v, id, NULL);
    status s = job_get(v, id, &row, err);
    if (s == STATUS_OK && may_remove != NULL) s = may_remove(context, &row, err);
    if (s == STATUS_OK) {
        row.deleted = true;
        s = job_update_surely(v, &row, err);
    }
    job_change_end(v);
    if (s == STATUS_OK) {
        upload_discard_job(v->upload, row.id);
        log_info(v->log, "job %s deleted", row.id);
        job_wake_runner(v);
    }
    job_row_release(&row);
    return s;
}
