#include "server/rescue/quarantine.h"
#include "base/files/durable.h"
#include "server/rescue/rebuild.h"
#include "server/settings/job_paths.h"
#include "server/store/job_journal.h"
#include "server/store/store_delivery.h"
#include "server/store/store_settings.h"

#include <dirent.h>
#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

/* The id of the job that a folder of the quarantine belonged to. Returns false if its name has none. */
static bool id_of(const char *name, char id[STORE_ID_BYTES])
{
    snprintf(id, STORE_ID_BYTES, "%.36s", name);
    return id_valid(id) && (name[36] == '-' || name[36] == '\0');
}

static void print_one(const char *folder, const char *name, FILE *report)
{
    char id[STORE_ID_BYTES];
    struct job_journal j = {0};
    struct error why = {0};
    if (!id_of(name, id))
        fprintf(report, "%s: not the folder of a job\n", name);
    else if (job_journal_read(folder, &j, &why) == STATUS_OK && j.has_job)
        fprintf(report, "%s: '%s' %s%s, %zu files\n", name, j.job.sample, job_state_name(j.job.state),
                j.job.deleted ? ", deleted" : "", j.n_file);
    else
        fprintf(report, "%s: %s\n", name, why.text[0] ? why.text : "its journal says nothing of the job");
    job_journal_release(&j);
}

status quarantine_list(const struct settings *settings, FILE *report, struct error *err)
{
    char path[PATH_BYTES], folder[PATH_BYTES];
    path_join(path, settings->data, "quarantine", NULL);
    DIR *d = opendir(path);
    if (d == NULL && errno != ENOENT) return error_set_errno(err, "cannot list '%s'", path);
    for (struct dirent *e; d != NULL && (e = readdir(d)) != NULL;) {
        if (strcmp(e->d_name, ".") == 0 || strcmp(e->d_name, "..") == 0) continue;
        path_join(folder, path, e->d_name, NULL);
        print_one(folder, e->d_name, report);
    }
    if (d != NULL) closedir(d);
    return STATUS_OK;
}

/* Finds the only folder with this name, or of a job with this id. */
static status find(const char *path, const char *wanted, char found[256], struct error *err)
{
    size_t n = 0;
    char id[STORE_ID_BYTES];
    DIR *d = opendir(path);
    for (struct dirent *e; d != NULL && (e = readdir(d)) != NULL;) {
        if (!id_of(e->d_name, id)) continue;
        bool whole = strcmp(e->d_name, wanted) == 0;
        if (!whole && strcmp(id, wanted) != 0) continue;
        snprintf(found, 256, "%s", e->d_name);
        n = whole ? 1 : n + 1;
        if (whole) break;
    }
    if (d != NULL) closedir(d);
    if (n == 0) return error_set(err, STATUS_NOT_FOUND, "quarantine has no folder of a job '%.200s'", wanted);
    if (n > 1)
        return error_set(err, STATUS_CONFLICT, "quarantine has %zu folders of job '%.200s'; give the whole name of one",
                         n, wanted);
    return STATUS_OK;
}

/* Moves the folder and adds its job; moves it back after an error. */
static status move_and_add(struct store *store, const struct settings *settings, const char *from, const char *id,
                           FILE *report, struct error *err)
{
    char to[PATH_BYTES];
    path_join(to, settings->data, "jobs", id, NULL);
    if (rename(from, to) != 0) return error_set_errno(err, "cannot move '%s' to '%s'", from, to);
    status s = durable_sync_folder_of(to, err);
    if (s == STATUS_OK) s = durable_sync_folder_of(from, err);
    if (s == STATUS_OK) s = rebuild_one(store, settings->data, id, report, err);
    if (s != STATUS_OK && rename(to, from) != 0) fprintf(report, "'%s' could not be moved back to quarantine\n", to);
    return s;
}

status quarantine_restore(const struct settings *settings, const char *name, FILE *report, struct error *err)
{
    char path[PATH_BYTES], from[PATH_BYTES], found[256], id[STORE_ID_BYTES];
    struct store *store = NULL;
    struct job_row row;
    struct stat st;
    path_join(path, settings->data, "quarantine", NULL);
    status s = find(path, name, found, err);
    if (s != STATUS_OK) return s;
    path_join(from, path, found, NULL);
    id_of(found, id);
    s = rebuild_is_needed(settings, err);
    path_join(path, settings->data, "jobs", id, NULL);
    if (s == STATUS_OK && lstat(path, &st) == 0) s = error_set(err, STATUS_CONFLICT, "there is a folder '%s'", path);
    if (s == STATUS_OK) s = store_settings_open(settings, false, &store, err);
    if (s == STATUS_OK) s = store_webhook_enable(store, false, err);
    if (s != STATUS_OK) goto out;
    s = store_job_look(store, id, &row, err);
    if (s == STATUS_OK)
        s = error_set(err, STATUS_CONFLICT, "job %s exists", id);
    else if (s == STATUS_NOT_FOUND)
        s = move_and_add(store, settings, from, id, report, err);
out:
    store_close(store);
    return s == STATUS_OK ? s : error_prefix(err, s, "cannot restore '%.200s'", name);
}
