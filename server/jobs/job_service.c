#include "server/jobs/job_service.h"
#include "base/clock.h"
#include "base/durable.h"
#include "optimizer/job/job_document.h"
#include "optimizer/job/job_folder.h"
#include "server/jobs/ballast.h"
#include "server/jobs/job_paths.h"
#include "server/jobs/supervisor.h"

#include <sodium.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <uuid/uuid.h>

static void new_id(char out[STORE_ID_BYTES])
{
    uuid_t u;
    uuid_generate_random(u);
    uuid_unparse_lower(u, out);
}

static void wake(struct job_service *v)
{
    if (v->supervisor != NULL) supervisor_wake(v->supervisor);
}

status job_disk_check(struct job_service *v, int64_t n_bytes, struct error *err)
{
    long long free_bytes = 0;
    status s = path_free_bytes(v->settings->data, &free_bytes, err);
    if (s != STATUS_OK) return s;
    if (free_bytes < n_bytes || free_bytes - n_bytes < v->settings->floor_bytes)
        return error_set(
            err, STATUS_DISK_FULL,
            "cannot take new work: %lld bytes are free, %lld are kept in reserve; delete jobs or free space",
            free_bytes, (long long)v->settings->floor_bytes);
    return STATUS_OK;
}

status job_update_surely(struct job_service *v, struct job_row *row, struct error *err)
{
    status s = store_job_update(v->store, row, err);
    return s == STATUS_DISK_FULL && ballast_release(v->settings->data) ? store_job_update(v->store, row, err) : s;
}

static status check_document(const char *document, size_t n_bytes, char sample[256], struct error *err)
{
    struct job_document *doc = NULL;
    status s = job_document_parse(document, n_bytes, &doc, err);
    if (s != STATUS_OK) return s;
    snprintf(sample, 256, "%s", doc->sample);
    job_document_free(doc);
    return STATUS_OK;
}

static status make_folders(struct job_service *v, const char *id, struct error *err)
{
    static const char *const part[] = {JOB_FOLDER_INPUT, "upload"};
    char path[PATH_BYTES];
    status s = STATUS_OK;
    for (size_t i = 0; s == STATUS_OK && i < 2; i++) {
        path_join(path, v->settings->data, "jobs", id, part[i], NULL);
        s = durable_make_folder(path, err);
        if (s == STATUS_OK) s = durable_sync_folder_of(path, err);
    }
    path_join(path, v->settings->data, "jobs", id, NULL);
    return s == STATUS_OK ? durable_sync_folder_of(path, err) : s;
}

static void text_hash(const char *text, size_t n_bytes, char out[STORE_HASH_TEXT_BYTES])
{
    unsigned char sum[crypto_hash_sha256_BYTES];
    crypto_hash_sha256(sum, (const unsigned char *)text, n_bytes);
    sodium_bin2hex(out, STORE_HASH_TEXT_BYTES, sum, sizeof sum);
}

static status find_replay(struct job_service *v, const char *key, const char *body_hash, char id[STORE_ID_BYTES],
                          bool *replayed, struct job_refusal *refusal, struct error *err)
{
    char before[STORE_HASH_TEXT_BYTES];
    status s = store_idempotency_find(v->store, key, id, before, err);
    if (s == STATUS_NOT_FOUND) return STATUS_OK;
    if (s != STATUS_OK) return s;
    if (strcmp(before, body_hash) != 0) {
        refusal->code = "idempotency_key_reused";
        return error_set_field(err, STATUS_INVALID, "Idempotency-Key", "key '%.128s' was used before with another body",
                               key);
    }
    *replayed = true;
    return STATUS_OK;
}

static status create_locked(struct job_service *v, struct job_row *row, const char *key, const char *body_hash,
                            bool *replayed, struct job_refusal *refusal, struct error *err)
{
    status s = key == NULL ? STATUS_OK : find_replay(v, key, body_hash, row->id, replayed, refusal, err);
    if (s != STATUS_OK || *replayed) return s;
    int64_t count[JOB_N_STATE], n = 0;
    s = store_job_count(v->store, count, err);
    if (s != STATUS_OK) return s;
    for (int i = 0; i < JOB_N_STATE; i++) n += count[i];
    if (n >= v->settings->max_jobs) {
        refusal->code = "too_many";
        return error_set(err, STATUS_TOO_LARGE, "cannot keep more than %lld jobs: delete some",
                         (long long)v->settings->max_jobs);
    }
    new_id(row->id);
    row->created_unix_s = clock_wall_s();
    s = store_job_insert(v->store, row, key, body_hash, err);
    if (s != STATUS_OK) return s;
    s = make_folders(v, row->id, err);
    if (s != STATUS_OK) store_job_erase(v->store, row->id, NULL);
    return s;
}

status job_create(struct job_service *v, const char *document, size_t n_bytes, const char *idempotency_key,
                  char id[STORE_ID_BYTES], bool *replayed, struct job_refusal *refusal, struct error *err)
{
    struct job_row row = {.state = JOB_DRAFT};
    char body_hash[STORE_HASH_TEXT_BYTES];
    *replayed = false;
    status s = check_document(document, n_bytes, row.sample, err);
    if (s != STATUS_OK) return s;
    s = job_disk_check(v, 0, err);
    if (s != STATUS_OK) return s;
    text_hash(document, n_bytes, body_hash);
    row.document = strndup(document, n_bytes);
    if (row.document == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot create job: out of memory");
    pthread_mutex_lock(&v->change);
    s = create_locked(v, &row, idempotency_key, body_hash, replayed, refusal, err);
    pthread_mutex_unlock(&v->change);
    if (s == STATUS_OK) snprintf(id, STORE_ID_BYTES, "%s", row.id);
    if (s == STATUS_OK && !*replayed) log_info(v->log, "job %s created: '%s'", row.id, row.sample);
    job_row_release(&row);
    return s;
}

status job_get(struct job_service *v, const char *id, struct job_row *row, struct error *err)
{
    memset(row, 0, sizeof *row);
    if (!id_valid(id)) return error_set(err, STATUS_NOT_FOUND, "job '%.40s' does not exist", id);
    status s = store_job_get(v->store, id, row, err);
    if (s != STATUS_OK || !row->deleted) return s;
    job_row_release(row);
    return error_set(err, STATUS_NOT_FOUND, "job '%.40s' does not exist", id);
}

static bool active(const struct job_row *row)
{
    return row->state == JOB_QUEUED || row->state == JOB_RUNNING || row->state == JOB_PAUSED;
}

static status check_editable(const struct job_row *row, struct error *err)
{
    if (!active(row)) return STATUS_OK;
    return error_set(err, STATUS_CONFLICT, "cannot edit the job while it is %s: cancel it first",
                     job_state_name(row->state));
}

/* An edit of a job that has run: back to draft, and the next start begins afresh. The row is written together with what
 * was edited, so that a job whose edit fails is what it was. */
static void edited(struct job_row *row)
{
    row->state = JOB_DRAFT;
    row->dirty = row->dirty || row->attempt > 0;
}

status job_replace_document(struct job_service *v, const char *id, const char *document, size_t n_bytes,
                            status (*may_edit)(void *context, const struct job_row *row, struct error *err),
                            void *context, struct error *err)
{
    struct job_row row;
    pthread_mutex_lock(&v->change);
    status s = job_get(v, id, &row, err);
    if (s == STATUS_OK && may_edit != NULL) s = may_edit(context, &row, err);
    if (s == STATUS_OK) s = check_document(document, n_bytes, row.sample, err);
    if (s == STATUS_OK) s = check_editable(&row, err);
    if (s != STATUS_OK) goto out;
    char *text = strndup(document, n_bytes);
    if (text == NULL) {
        s = error_set(err, STATUS_NO_MEMORY, "cannot replace the document: out of memory");
        goto out;
    }
    free(row.document);
    row.document = text;
    edited(&row);
    s = job_update_surely(v, &row, err);
out:
    pthread_mutex_unlock(&v->change);
    job_row_release(&row);
    return s;
}

struct missing {
    const struct file_row *file;
    size_t n_file;
    json_t *name;
};

static void visit_file(void *context, const char *name, const char *role)
{
    struct missing *m = context;
    (void)role;
    for (size_t i = 0; i < m->n_file; i++)
        if (m->file[i].state == FILE_COMPLETE && strcmp(m->file[i].name, name) == 0) return;
    json_array_append_new(m->name, json_string(name));
}

status job_missing_files(struct job_service *v, const struct job_row *row, json_t **out, struct error *err)
{
    struct job_document *doc = NULL;
    struct file_row *file = NULL;
    struct missing m = {0};
    status s = job_document_parse(row->document, strlen(row->document), &doc, err);
    if (s != STATUS_OK) return s;
    s = store_file_list(v->store, row->id, &file, &m.n_file, err);
    if (s != STATUS_OK) goto out;
    m.file = file;
    m.name = json_array();
    job_document_visit_files(doc, visit_file, &m);
    *out = m.name;
out:
    free(file);
    job_document_free(doc);
    return s;
}

static status queue(struct job_service *v, struct job_row *row, struct job_refusal *refusal, struct error *err)
{
    status s = job_disk_check(v, 0, err);
    if (s != STATUS_OK) return s;
    json_t *missing = NULL;
    s = job_missing_files(v, row, &missing, err);
    if (s != STATUS_OK) return s;
    size_t n = json_array_size(missing);
    if (n > 0) {
        refusal->code = "files_missing";
        refusal->missing_files = missing;
        return error_set(err, STATUS_CONFLICT, "cannot start: %zu input file%s not complete, the first is '%s'", n,
                         n == 1 ? " is" : "s are", json_string_value(json_array_get(missing, 0)));
    }
    json_decref(missing);
    row->state = JOB_QUEUED;
    row->lost_attempts = 0;
    row->cancel_requested = false;
    row->error_code[0] = row->error_field[0] = row->error_text[0] = '\0';
    row->queued_unix_s = clock_wall_s();
    row->started_unix_s = row->finished_unix_s = 0;
    return store_job_update(v->store, row, err);
}

static status begin(struct job_service *v, const char *id, bool retry, bool *changed, struct job_refusal *refusal,
                    struct error *err)
{
    struct job_row row;
    *changed = false;
    pthread_mutex_lock(&v->change);
    status s = job_get(v, id, &row, err);
    if (s != STATUS_OK) goto out;
    if (active(&row)) {
        if (row.cancel_requested)
            s = error_set(err, STATUS_CONFLICT,
                          "cannot start the job while it is being cancelled: wait until it has stopped");
        goto out;
    }
    if (retry && row.state != JOB_FAILED && row.state != JOB_CANCELLED) {
        s = error_set(err, STATUS_CONFLICT, "cannot retry a job that is %s: only failed and cancelled jobs",
                      job_state_name(row.state));
        goto out;
    }
    if (row.state == JOB_SUCCEEDED) goto out;
    s = queue(v, &row, refusal, err);
    *changed = s == STATUS_OK;
    if (*changed) log_info(v->log, "job %s queued", row.id);
out:
    pthread_mutex_unlock(&v->change);
    job_row_release(&row);
    if (*changed) wake(v);
    return s;
}

status job_start(struct job_service *v, const char *id, bool *changed, struct job_refusal *refusal, struct error *err)
{
    return begin(v, id, false, changed, refusal, err);
}

status job_retry(struct job_service *v, const char *id, bool *changed, struct job_refusal *refusal, struct error *err)
{
    return begin(v, id, true, changed, refusal, err);
}

status job_cancel(struct job_service *v, const char *id, bool *changed, struct error *err)
{
    struct job_row row;
    *changed = false;
    pthread_mutex_lock(&v->change);
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
    if (s == STATUS_OK) log_info(v->log, "job %s: cancel requested", row.id);
out:
    pthread_mutex_unlock(&v->change);
    job_row_release(&row);
    if (*changed) wake(v);
    return s;
}

status job_delete(struct job_service *v, const char *id, struct error *err)
{
    struct job_row row;
    pthread_mutex_lock(&v->change);
    status s = job_get(v, id, &row, err);
    if (s == STATUS_OK) {
        row.deleted = true;
        s = job_update_surely(v, &row, err);
    }
    pthread_mutex_unlock(&v->change);
    if (s == STATUS_OK) {
        upload_discard_job(v->upload, row.id);
        log_info(v->log, "job %s deleted", row.id);
        wake(v);
    }
    job_row_release(&row);
    return s;
}

static bool role_valid(const char *role)
{
    static const char *const known[] = {"volume", "fibers", "measurements", "photograph", "chart", "dark_frame"};
    for (size_t i = 0; i < sizeof known / sizeof known[0]; i++)
        if (strcmp(role, known[i]) == 0) return true;
    return false;
}

static status check_declaration(struct job_service *v, struct file_row *row, struct error *err)
{
    if (!job_file_name_valid(row->name))
        return error_set_field(
            err, STATUS_INVALID, "name",
            "file name '%.127s' is not allowed: 1..127 of A-Z a-z 0-9 . _ -, not starting with a dot", row->name);
    if (!role_valid(row->role))
        return error_set_field(err, STATUS_INVALID, "role",
                               "role '%.31s' is not one of volume, fibers, measurements, photograph, chart, dark_frame",
                               row->role);
    if (row->size_bytes < 1)
        return error_set_field(err, STATUS_INVALID, "size",
                               "file '%s' is declared with %lld bytes: empty files are of no use", row->name,
                               (long long)row->size_bytes);
    if (row->size_bytes > v->settings->max_file_bytes)
        return error_set_field(err, STATUS_TOO_LARGE, "size",
                               "file '%s' is declared with %lld bytes, the limit is %lld", row->name,
                               (long long)row->size_bytes, (long long)v->settings->max_file_bytes);
    size_t n = strlen(row->sha256);
    for (size_t i = 0; i < n; i++) {
        if (row->sha256[i] >= 'A' && row->sha256[i] <= 'F') row->sha256[i] = (char)(row->sha256[i] - 'A' + 'a');
        char c = row->sha256[i];
        if (!((c >= '0' && c <= '9') || (c >= 'a' && c <= 'f'))) n = 1;
    }
    if (n != 0 && n != 64)
        return error_set_field(err, STATUS_INVALID, "sha256", "sha256 of '%s' is not 64 hexadecimal digits", row->name);
    return STATUS_OK;
}

static status declare_locked(struct job_service *v, const char *id, struct file_row *row, bool *existed,
                             struct job_refusal *refusal, struct error *err)
{
    struct job_row job;
    struct file_row before, *all = NULL;
    size_t n = 0;
    status s = job_get(v, id, &job, err);
    if (s != STATUS_OK) goto out;
    snprintf(row->job_id, sizeof row->job_id, "%s", id);
    s = store_file_find(v->store, id, row->name, &before, NULL);
    if (s == STATUS_OK) {
        bool same = before.size_bytes == row->size_bytes && strcmp(before.role, row->role) == 0 &&
                    (row->sha256[0] == '\0' || before.sha256[0] == '\0' || strcmp(before.sha256, row->sha256) == 0);
        if (!same)
            s = error_set_field(err, STATUS_EXISTS, "name", "file '%s' was declared differently: delete it first",
                                row->name);
        else if (before.sha256[0] == '\0' && row->sha256[0] != '\0')
            s = upload_set_checksum(v->upload, before.id, row->sha256, row, err);
        else
            *row = before;
        *existed = true;
        goto out;
    }
    s = store_file_list(v->store, id, &all, &n, err);
    if (s != STATUS_OK) goto out;
    if ((int64_t)n >= v->settings->max_files_per_job) {
        refusal->code = "too_many";
        s = error_set(err, STATUS_TOO_LARGE, "a job takes at most %lld files",
                      (long long)v->settings->max_files_per_job);
        goto out;
    }
    s = check_editable(&job, err);
    if (s == STATUS_OK) s = job_disk_check(v, row->size_bytes, err);
    if (s != STATUS_OK) goto out;
    new_id(row->id);
    s = upload_reserve(v->upload, row, err);
    if (s != STATUS_OK) goto out;
    edited(&job);
    s = store_file_insert(v->store, row, &job, err);
    if (s != STATUS_OK) upload_discard(v->upload, row);
out:
    free(all);
    job_row_release(&job);
    return s;
}

status job_declare_file(struct job_service *v, const char *id, struct file_row *row, bool *existed,
                        struct job_refusal *refusal, struct error *err)
{
    *existed = false;
    status s = check_declaration(v, row, err);
    if (s != STATUS_OK) return s;
    pthread_mutex_lock(&v->change);
    s = declare_locked(v, id, row, existed, refusal, err);
    pthread_mutex_unlock(&v->change);
    return s;
}

status job_delete_file(struct job_service *v, const char *id, const char *name, struct error *err)
{
    struct job_row job;
    struct file_row file;
    pthread_mutex_lock(&v->change);
    status s = job_get(v, id, &job, err);
    if (s == STATUS_OK) s = store_file_find(v->store, id, name, &file, err);
    if (s == STATUS_OK) s = check_editable(&job, err);
    if (s != STATUS_OK) goto out;
    edited(&job);
    /* the row first: bytes without a row are swept away, a row without bytes would be a lie */
    s = store_file_erase(v->store, file.id, &job, err);
    if (s == STATUS_DISK_FULL && ballast_release(v->settings->data)) s = store_file_erase(v->store, file.id, &job, err);
    if (s == STATUS_OK) upload_discard(v->upload, &file);
out:
    pthread_mutex_unlock(&v->change);
    job_row_release(&job);
    return s;
}

status job_delete_upload(struct job_service *v, const char *upload_id, struct error *err)
{
    struct file_row file;
    if (!id_valid(upload_id)) return error_set(err, STATUS_NOT_FOUND, "upload '%.40s' does not exist", upload_id);
    status s = store_file_get(v->store, upload_id, &file, err);
    return s == STATUS_OK ? job_delete_file(v, file.job_id, file.name, err) : s;
}
