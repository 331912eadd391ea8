/* Creates jobs, and replaces the documents of existing jobs. */
#include "base/clock.h"
#include "base/files/durable.h"
#include "base/files/foreign_file.h"
#include "optimizer/job/job_folder.h"
#include "optimizer/job/job_outline.h"
#include "server/jobs/disk_reserve.h"
#include "server/jobs/job_access.h"
#include "server/jobs/job_change.h"
#include "server/settings/job_paths.h"

#include <fcntl.h>
#include <sodium.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

static status check_document(const char *document, size_t n_bytes, char sample[256], struct error *err)
{
    struct job_outline outline = {.n_file = 0};
    status s = job_outline_read(document, n_bytes, &outline, err);
    if (s != STATUS_OK) return s;
    snprintf(sample, 256, "%s", outline.sample);
    job_outline_release(&outline);
    return STATUS_OK;
}

/* Writes the document to the job's folder, from which the database could be rebuilt. */
static status write_document(struct job_service *v, const struct job_row *row, struct error *err)
{
    char path[PATH_BYTES];
    path_join(path, v->settings->data, "jobs", row->id, JOB_FILE_DOCUMENT, NULL);
    return foreign_file_replace(path, row->document, strlen(row->document), true, err);
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

status job_fill_place(struct job_service *v, const struct job_row *row, const char *folder, struct error *err)
{
    static const char *const part[] = {JOB_FOLDER_INPUT, "upload"};
    const struct journal_entry all = {.job = row, .document = true};
    char path[PATH_BYTES];
    status s = STATUS_OK;
    for (size_t i = 0; s == STATUS_OK && i < 2; i++) {
        path_join(path, folder, part[i], NULL);
        s = durable_make_folder(path, err);
    }
    path_join(path, folder, JOB_FILE_DOCUMENT, NULL);
    if (s == STATUS_OK) s = durable_replace_volatile(path, row->document, strlen(row->document), err);
    return s == STATUS_OK ? job_journal_append(&v->journal_key, folder, &all, false, err) : s;
}

status job_sync_all(struct job_service *v, struct error *err)
{
    int fd = open(v->settings->data, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    status s = fd < 0 || syncfs(fd) != 0 ? error_set_errno(err, "cannot sync '%s'", v->settings->data) : STATUS_OK;
    if (fd >= 0) close(fd);
    return s;
}

void job_note_all(struct job_service *v, const struct job_row *row, size_t n)
{
    char folder[PATH_BYTES];
    for (size_t i = 0; i < n; i++) {
        struct error err = {0};
        path_join(folder, v->settings->data, "jobs", row[i].id, NULL);
        status s = job_journal_append(&v->journal_key, folder, &(struct journal_entry){.job = &row[i]}, false, &err);
        if (s != STATUS_OK && s != STATUS_NOT_FOUND) log_warning(v->log, "job %s: %s", row[i].id, err.text);
    }
    struct error err = {0};
    if (n > 0 && job_sync_all(v, &err) != STATUS_OK) log_warning(v->log, "%s", err.text);
}

static void text_hash(const char *text, size_t n_bytes, char out[STORE_HASH_TEXT_BYTES])
{
    unsigned char sum[crypto_hash_sha256_BYTES];
    crypto_hash_sha256(sum, (const unsigned char *)text, n_bytes);
    sodium_bin2hex(out, STORE_HASH_TEXT_BYTES, sum, sizeof sum);
}

static status find_replay(struct job_service *v, const char *owner, const char *key, const char *body_hash,
                          char id[STORE_ID_BYTES], bool *replayed, struct job_refusal *refusal, struct error *err)
{
    char before[STORE_HASH_TEXT_BYTES];
    status s = store_idempotency_find(v->store, owner, key, id, before, err);
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

static status fill_place(struct job_service *v, const struct job_row *row, const char *key, const char *body_hash,
                         struct error *err)
{
    char path[PATH_BYTES];
    path_join(path, v->settings->data, "jobs", row->id, NULL);
    const struct journal_entry all = {.job = row, .document = true, .idempotency_key = key, .body_hash = body_hash};
    status s = make_folders(v, row->id, err);
    if (s == STATUS_OK) s = write_document(v, row, err);
    if (s == STATUS_OK) s = job_journal_append(&v->journal_key, path, &all, true, err);
    return s;
}

/* A daemon that was killed between row and folder, or whose commit was made without its knowledge, has left a job
 * without a whole folder: the client that repeats its request gets it whole. */
static status complete_place(struct job_service *v, const char *id, const char *key, const char *body_hash,
                             struct error *err)
{
    char path[PATH_BYTES];
    struct stat st;
    struct job_row row;
    path_join(path, v->settings->data, "jobs", id, JOB_FILE_JOURNAL, NULL);
    if (lstat(path, &st) == 0) return STATUS_OK;
    status s = store_job_get(v->store, id, &row, err);
    if (s == STATUS_OK) s = fill_place(v, &row, key, body_hash, err);
    job_row_release(&row);
    return s;
}

static status create_locked(struct job_service *v, struct job_row *row, const struct job_request *request,
                            const char *body_hash, bool *replayed, struct job_refusal *refusal, struct error *err)
{
    const char *key = request->idempotency_key;
    status s = key == NULL ? STATUS_OK : find_replay(v, row->owner, key, body_hash, row->id, replayed, refusal, err);
    if (s == STATUS_OK && *replayed) s = complete_place(v, row->id, key, body_hash, err);
    if (s != STATUS_OK || *replayed) return s;
    int64_t count[JOB_N_STATE], n = 0;
    s = store_job_count(v->store, count, err);
    if (s != STATUS_OK) return s;
    for (int i = 0; i < JOB_N_STATE; i++) n += count[i];
    if (n >= v->settings->max_jobs) {
        refusal->code = "too_many";
        return error_set(err, STATUS_TOO_LARGE, "cannot keep more than %lld jobs; delete some",
                         (long long)v->settings->max_jobs);
    }
    s = job_check_quota(v, request->grant, row->owner, &(struct owner_use){.jobs = 1}, refusal, err);
    if (s != STATUS_OK) return s;
    job_new_id(row->id);
    row->created_unix_s = clock_wall_s();
    s = store_job_insert(v->store, row, key, body_hash, err);
    if (s != STATUS_OK) return s;
    s = fill_place(v, row, key, body_hash, err);
    if (s != STATUS_OK && job_remove_folder(v, row->id, NULL) == STATUS_OK)
        store_job_erase(v->store, row->id, NULL);
    else if (s != STATUS_OK) { /* the folder is removed later */
        row->deleted = true;
        store_job_update(v->store, row, NULL);
    }
    return s;
}

status job_create(struct job_service *v, const struct job_request *request, char id[STORE_ID_BYTES], bool *replayed,
                  struct job_refusal *refusal, struct error *err)
{
    struct job_row row = {.state = JOB_DRAFT};
    char body_hash[STORE_HASH_TEXT_BYTES];
    *replayed = false;
    status s = check_document(request->document, request->n_bytes, row.sample, err);
    if (s != STATUS_OK) return s;
    s = job_disk_check(v, 0, err);
    if (s != STATUS_OK) return s;
    text_hash(request->document, request->n_bytes, body_hash);
    row.document = strndup(request->document, request->n_bytes);
    if (row.document == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot create job: out of memory");
    snprintf(row.owner, sizeof row.owner, "%s", request->grant->owner);
    job_change_begin(v, NULL, row.owner);
    s = create_locked(v, &row, request, body_hash, replayed, refusal, err);
    job_change_end(v);
    if (s == STATUS_OK) snprintf(id, STORE_ID_BYTES, "%s", row.id);
    if (s == STATUS_OK && !*replayed) log_info(v->log, "job %s created: '%s'", row.id, row.sample);
    job_row_release(&row);
    return s;
}

/* Writes JOB/run.json, the document that the present result was made with. */
static status note_document_of_run(struct job_service *v, const struct job_row *row, const char *document,
                                   struct error *err)
{
    char path[PATH_BYTES];
    path_join(path, v->settings->data, "jobs", row->id, JOB_FILE_RUN, NULL);
    return foreign_file_replace(path, document, strlen(document), true, err);
}

/* The folder first: then an acknowledged change is in both folder and database, and a rebuild makes a job a draft whose
 * document differs from the journal's checksum. run: the document of the last run, if this is the first edit since;
 * else NULL. */
static status replace_document(struct job_service *v, struct job_row *row, const char *run, struct error *err)
{
    status s = run != NULL ? note_document_of_run(v, row, run, err) : STATUS_OK;
    if (s == STATUS_OK) s = write_document(v, row, err);
    if (s == STATUS_OK) s = store_job_replace(v->store, row, err);
    if (s == STATUS_OK) job_note(v, row->id, &(struct journal_entry){.job = row, .document = true});
    return s;
}

status job_replace_document(struct job_service *v, const char *id, const char *document, size_t n_bytes,
                            status (*may_edit)(void *context, const struct job_row *row, struct error *err),
                            void *context, struct error *err)
{
    struct job_row row;
    job_change_begin(v, id, NULL);
    status s = job_get(v, id, &row, err);
    if (s == STATUS_OK && may_edit != NULL) s = may_edit(context, &row, err);
    if (s == STATUS_OK) s = check_document(document, n_bytes, row.sample, err);
    if (s == STATUS_OK) s = job_check_editable(&row, err);
    if (s != STATUS_OK) goto out;
    char *text = strndup(document, n_bytes);
    if (text == NULL) {
        s = error_set(err, STATUS_NO_MEMORY, "cannot replace the document: out of memory");
        goto out;
    }
    char *run = row.attempt > 0 && !row.dirty ? row.document : NULL;
    if (run == NULL) free(row.document);
    row.document = text;
    job_mark_edited(&row);
    s = replace_document(v, &row, run, err);
    for (int step = 0; s == STATUS_DISK_FULL && disk_reserve_make_room(v, &step);)
        s = replace_document(v, &row, run, err);
    if (s == STATUS_OK) job_forget_plan(v, id);
    free(run);
out:
    job_change_end(v);
    job_row_release(&row);
    return s;
}
