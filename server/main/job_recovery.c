#include "server/main/job_recovery.h"
#include "base/clock.h"
#include "base/files/durable.h"
#include "base/files/foreign_file.h"
#include "optimizer/job/job_folder.h"
#include "server/batches/batch_places.h"
#include "server/files/worker_files.h"
#include "server/jobs/job_access.h"
#include "server/jobs/job_change.h"
#include "server/settings/job_paths.h"
#include "server/workers/backends/job_backend.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

/* Moves an entry of jobs/ that the database does not know to the quarantine folder. */
static status quarantine(struct job_service *v, const char *name, struct error *err)
{
    char from[PATH_BYTES], to[PATH_BYTES], label[400];
    snprintf(label, sizeof label, "%s-%.0f", name, clock_wall_s());
    path_join(from, v->settings->data, "jobs", name, NULL);
    path_join(to, v->settings->data, "quarantine", label, NULL);
    if (rename(from, to) != 0) return error_set_errno(err, "cannot move unknown '%s' to quarantine", from);
    log_warning(v->log, "'jobs/%s' belongs to no job, so it was moved to 'quarantine/%s'", name, label);
    return STATUS_OK;
}

static status quarantine_unknown(struct job_service *v, struct error *err)
{
    char path[PATH_BYTES];
    path_join(path, v->settings->data, "jobs", NULL);
    DIR *d = opendir(path);
    if (d == NULL) return error_set_errno(err, "cannot list '%s'", path);
    for (struct dirent *e; (e = readdir(d)) != NULL;) {
        if (strcmp(e->d_name, ".") == 0 || strcmp(e->d_name, "..") == 0) continue;
        struct job_row row = {0};
        struct error why = {0};
        status found = id_valid(e->d_name) ? store_job_look(v->store, e->d_name, &row, &why) : STATUS_NOT_FOUND;
        if (found == STATUS_NOT_FOUND) found = quarantine(v, e->d_name, &why);
        if (found != STATUS_OK) log_warning(v->log, "%s", why.text);
        job_row_release(&row);
    }
    closedir(d);
    return STATUS_OK;
}

/* Removes tombstones whose folder still exists. */
static status remove_deleted(struct job_service *v, struct error *err)
{
    struct job_row *row = NULL;
    size_t n = 0;
    struct job_query q = {.deleted = true, .limit = SIZE_MAX >> 1};
    status s = store_job_list(v->store, &q, &row, &n, err);
    for (size_t i = 0; s == STATUS_OK && i < n; i++) {
        struct error why = {0};
        status removed = job_remove_folder(v, row[i].id, &why);
        if (removed == STATUS_OK) removed = store_job_erase(v->store, row[i].id, &why);
        if (removed != STATUS_OK)
            log_warning(v->log, "job %s is deleted, but a part of it could not be removed: %s", row[i].id, why.text);
    }
    job_rows_free(row, n);
    return s;
}

/* Where workers die with the daemon, a job that is running in the database has none. */
static status requeue(struct job_service *v, struct error *err)
{
    struct job_row *row = NULL;
    size_t n = 0;
    struct job_query q = {.states = 1U << JOB_RUNNING, .limit = SIZE_MAX >> 1};
    const struct job_backend *backend = job_backend_find(v->settings->backend);
    if (backend != NULL && backend->outlives_daemon) return STATUS_OK; /* the supervisor adopts them */
    status s = store_job_list(v->store, &q, &row, &n, err);
    for (size_t i = 0; s == STATUS_OK && i < n; i++) {
        row[i].state = row[i].cancel_requested ? JOB_CANCELLED : JOB_QUEUED;
        if (row[i].cancel_requested) row[i].finished_unix_s = clock_wall_s();
        row[i].cancel_requested = false;
        s = job_update(v, &row[i], err);
        if (s == STATUS_OK)
            log_info(v->log, "job %s was running when the daemon stopped; it is now %s", row[i].id,
                     job_state_name(row[i].state));
    }
    job_rows_free(row, n);
    return s;
}

/* Removes bytes of uploads that no longer have a row. */
static void remove_unknown_parts(struct job_service *v, const char *job_id)
{
    char path[PATH_BYTES], part[PATH_BYTES];
    path_join(path, v->settings->data, "jobs", job_id, "upload", NULL);
    DIR *d = opendir(path);
    if (d == NULL) return;
    for (struct dirent *e; (e = readdir(d)) != NULL;) {
        struct file_row row;
        if (!id_valid(e->d_name) || store_file_get(v->store, e->d_name, &row, NULL) != STATUS_NOT_FOUND) continue;
        path_join(part, path, e->d_name, NULL);
        remove(part);
    }
    closedir(d);
}

/* Writes the document and the journal of a job from before there were journals, without syncs. */
static status begin_journal(struct job_service *v, const char *job_id, const char *folder, struct error *err)
{
    struct job_row row;
    struct file_row *file = NULL;
    char path[PATH_BYTES];
    struct journal_entry all = {.job = &row, .document = true};
    status s = store_job_get(v->store, job_id, &row, err);
    if (s == STATUS_OK) s = store_file_list(v->store, job_id, &file, &all.n_file, err);
    all.file = file;
    path_join(path, folder, JOB_FILE_DOCUMENT, NULL);
    if (s == STATUS_OK) s = foreign_file_replace(path, row.document, strlen(row.document), false, err);
    if (s == STATUS_OK) s = job_journal_append(&v->journal_key, folder, &all, false, err);
    free(file);
    job_row_release(&row);
    return s;
}

/* Begins the journals that are missing, and syncs them all at once. */
static void begin_journals(struct job_service *v, const struct job_row *row, size_t n)
{
    char folder[PATH_BYTES], path[PATH_BYTES];
    struct stat st;
    size_t n_begun = 0;
    for (size_t i = 0; i < n; i++) {
        struct error why = {0};
        path_join(folder, v->settings->data, "jobs", row[i].id, NULL);
        path_join(path, folder, JOB_FILE_JOURNAL, NULL);
        if (lstat(path, &st) == 0 || errno != ENOENT) continue;
        if (begin_journal(v, row[i].id, folder, &why) == STATUS_OK)
            n_begun++;
        else
            log_warning(v->log, "job %s: %s", row[i].id, why.text);
    }
    int fd = n_begun > 0 ? open(v->settings->data, O_RDONLY | O_DIRECTORY | O_CLOEXEC) : -1;
    if (fd >= 0) syncfs(fd);
    if (fd >= 0) close(fd);
    if (n_begun > 0) log_info(v->log, "%zu jobs had no journal and have got one", n_begun);
}

/* Makes the missing folders and journals of every job. A job whose folder was lost keeps its row, with an error. */
static status restore_folders(struct job_service *v, struct error *err)
{
    struct job_row *row = NULL;
    size_t n = 0;
    struct job_query q = {.limit = SIZE_MAX >> 1};
    status s = store_job_list(v->store, &q, &row, &n, err);
    for (size_t i = 0; s == STATUS_OK && i < n; i++) {
        static const char *const part[] = {JOB_FOLDER_INPUT, "upload"};
        for (size_t k = 0; k < 2; k++) {
            char path[PATH_BYTES];
            struct error why = {0};
            path_join(path, v->settings->data, "jobs", row[i].id, part[k], NULL);
            if (durable_make_folder(path, &why) != STATUS_OK) log_warning(v->log, "job %s: %s", row[i].id, why.text);
        }
        remove_unknown_parts(v, row[i].id);
    }
    if (s == STATUS_OK) begin_journals(v, row, n);
    job_rows_free(row, n);
    return s;
}

/* The code of the verdict that a job's result has. */
static void read_verdict(void *context, const char *job_id, char code[40])
{
    const struct job_service *v = context;
    json_t *st = worker_status_read(v->settings->data, job_id);
    const char *text = json_string_value(json_object_get(json_object_get(st, "verdict"), "code"));
    snprintf(code, 40, "%s", text == NULL ? "" : text);
    json_decref(st);
}

status job_recover(struct job_service *v, struct error *err)
{
    job_change_begin(v, NULL, NULL);
    batch_places_clear(v);
    status s = remove_deleted(v, err);
    if (s == STATUS_OK) s = quarantine_unknown(v, err);
    if (s == STATUS_OK) s = restore_folders(v, err); /* first, because it begins journals */
    if (s == STATUS_OK && v->keeper == NULL) s = requeue(v, err);
    if (s == STATUS_OK) s = store_fill_verdicts(v->store, read_verdict, v, err);
    if (s == STATUS_OK) s = upload_recover(v->upload, err);
    job_change_end(v);
    return s;
}
