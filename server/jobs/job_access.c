#include "server/jobs/job_access.h"
#include "base/files/durable.h"
#include "base/files/file_tree.h"
#include "optimizer/job/job_folder.h"
#include "server/jobs/disk_reserve.h"
#include "server/settings/job_paths.h"

#include <stdio.h>
#include <string.h>
#include <unistd.h>
#include <uuid/uuid.h>

void job_new_id(char out[STORE_ID_BYTES])
{
    uuid_t u;
    uuid_generate_random(u);
    uuid_unparse_lower(u, out);
}

status job_remove_folder(const struct job_service *v, const char *id, struct error *err)
{
    char path[PATH_BYTES];
    path_join(path, v->settings->data, "jobs", id, NULL);
    status s = file_tree_remove(path, err);
    return s == STATUS_OK ? durable_sync_folder_of(path, err) : s;
}

void job_forget_plan(const struct job_service *v, const char *id)
{
    char path[PATH_BYTES];
    path_join(path, v->settings->data, "jobs", id, JOB_FILE_PLAN, NULL);
    unlink(path);
}

status job_disk_check(struct job_service *v, int64_t n_bytes, struct error *err)
{
    long long free_bytes = 0;
    status s = path_free_bytes(v->settings->data, &free_bytes, err);
    if (s != STATUS_OK) return s;
    if (free_bytes >= n_bytes && free_bytes - n_bytes >= v->settings->floor_bytes) return STATUS_OK;
    char needed[64] = "";
    if (n_bytes > 0) snprintf(needed, sizeof needed, " and %lld are needed", (long long)n_bytes);
    return error_set(err, STATUS_DISK_FULL,
                     "cannot take new work: %lld bytes are free, %lld are kept in reserve%s; delete jobs or free space",
                     free_bytes, (long long)v->settings->floor_bytes, needed);
}

status job_check_quota(struct job_service *v, const struct access_grant *grant, const char *owner,
                       const struct owner_use *more, struct job_refusal *refusal, struct error *err)
{
    struct owner_use use = {0};
    const struct access_quota *q = &grant->quota;
    if ((q->jobs == 0 || more->jobs == 0) && (q->stored_bytes == 0 || more->bytes == 0)) return STATUS_OK;
    status s = store_owner_use(v->store, owner, &use, err);
    if (s != STATUS_OK) return s;
    bool jobs = q->jobs > 0 && more->jobs > 0 && use.jobs + more->jobs > q->jobs;
    bool bytes = q->stored_bytes > 0 && more->bytes > 0 && more->bytes > q->stored_bytes - use.bytes;
    if (!jobs && !bytes) return STATUS_OK;
    refusal->code = "quota";
    refusal->extra = json_pack(
        "{s:I,s:I,s:I}", jobs ? "quota_jobs" : "quota_bytes", (json_int_t)(jobs ? q->jobs : q->stored_bytes), "used",
        (json_int_t)(jobs ? use.jobs : use.bytes), "wanted", (json_int_t)(jobs ? more->jobs : more->bytes));
    if (jobs)
        return error_set(err, STATUS_DISK_FULL, "'%s' keeps %lld jobs of at most %lld; delete some", owner,
                         (long long)use.jobs, (long long)q->jobs);
    return error_set_field(err, STATUS_DISK_FULL, "size",
                           "'%s' has declared %lld bytes of at most %lld, and %lld more are asked for; delete jobs or "
                           "files",
                           owner, (long long)use.bytes, (long long)q->stored_bytes, (long long)more->bytes);
}

void job_note(struct job_service *v, const char *job_id, const struct journal_entry *entry)
{
    char folder[PATH_BYTES];
    struct error err = {0};
    /* Changes by the daemon itself follow from the files of the worker, too, so no one waits for their sync. */
    bool sync = entry->job == NULL || (entry->job->state != JOB_RUNNING && entry->job->state != JOB_PAUSED);
    path_join(folder, v->settings->data, "jobs", job_id, NULL);
    status s = job_journal_append(&v->journal_key, folder, entry, sync, &err);
    if (s != STATUS_OK && s != STATUS_NOT_FOUND) log_warning(v->log, "job %s: %s", job_id, err.text);
}

status job_update(struct job_service *v, struct job_row *row, struct error *err)
{
    status s = store_job_update(v->store, row, err);
    if (s == STATUS_OK) job_note(v, row->id, &(struct journal_entry){.job = row});
    return s;
}

status job_update_surely(struct job_service *v, struct job_row *row, struct error *err)
{
    status s = job_update(v, row, err);
    for (int step = 0; s == STATUS_DISK_FULL && disk_reserve_make_room(v, &step);) s = job_update(v, row, err);
    return s;
}

static status find(struct job_service *v, const char *id, bool document, struct job_row *row, struct error *err)
{
    memset(row, 0, sizeof *row);
    if (!id_valid(id)) return error_set(err, STATUS_NOT_FOUND, "job '%.40s' does not exist", id);
    status s = document ? store_job_get(v->store, id, row, err) : store_job_look(v->store, id, row, err);
    if (s != STATUS_OK || !row->deleted) return s;
    job_row_release(row);
    return error_set(err, STATUS_NOT_FOUND, "job '%.40s' does not exist", id);
}

status job_get(struct job_service *v, const char *id, struct job_row *row, struct error *err)
{
    return find(v, id, true, row, err);
}

status job_look(struct job_service *v, const char *id, struct job_row *row, struct error *err)
{
    return find(v, id, false, row, err);
}

void job_wake_runner(const struct job_service *v)
{
    if (v->runner.wake != NULL) v->runner.wake(v->runner.context);
}

bool job_active(const struct job_row *row)
{
    return row->state == JOB_QUEUED || row->state == JOB_RUNNING || row->state == JOB_PAUSED;
}

status job_check_editable(const struct job_row *row, struct error *err)
{
    if (!job_active(row)) return STATUS_OK;
    return error_set(err, STATUS_CONFLICT, "cannot edit the job while it is %s; cancel it first",
                     job_state_name(row->state));
}

void job_mark_edited(struct job_row *row)
{
    row->state = JOB_DRAFT;
    row->verdict[0] = '\0';
    row->dirty = row->dirty || row->attempt > 0;
}
