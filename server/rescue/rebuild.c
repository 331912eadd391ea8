#include "server/rescue/rebuild.h"
#include "base/clock.h"
#include "base/files/durable.h"
#include "base/files/file_tree.h"
#include "server/rescue/backup_files.h"
#include "server/rescue/database_age.h"
#include "server/rescue/job_evidence.h"
#include "server/store/drivers/store_backup.h"
#include "server/store/store_access.h"
#include "server/store/store_delivery.h"
#include "server/store/store_settings.h"

#include <dirent.h>
#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

static void database_path(const struct settings *s, char out[PATH_BYTES])
{
    path_join(out, s->data, "selvedge.db", NULL);
}

struct folder {
    char id[STORE_ID_BYTES];
    double created_unix_s;
};

static int oldest_first(const void *a, const void *b)
{
    const struct folder *x = a, *y = b;
    if (x->created_unix_s != y->created_unix_s) return x->created_unix_s < y->created_unix_s ? -1 : 1;
    return strcmp(x->id, y->id);
}

static double created_of(const char *folder)
{
    struct job_journal journal = {0};
    struct stat st;
    double t = stat(folder, &st) == 0 ? (double)st.st_mtim.tv_sec : 0;
    if (job_journal_read(folder, &journal, NULL) == STATUS_OK && journal.has_job) t = journal.job.created_unix_s;
    job_journal_release(&journal);
    return t;
}

/* Lists the folders of jobs in the order of their creation; the caller frees *out. ages: false leaves the times out. */
static status list_folders(const char *data, bool ages, struct folder **out, size_t *n_out, struct error *err)
{
    char path[PATH_BYTES], one[PATH_BYTES];
    struct folder *folder = NULL;
    size_t n = 0;
    status s = STATUS_OK;
    path_join(path, data, "jobs", NULL);
    DIR *d = opendir(path);
    if (d == NULL && errno != ENOENT) return error_set_errno(err, "cannot list '%s'", path);
    for (struct dirent *e; d != NULL && (e = readdir(d)) != NULL;) {
        if (!id_valid(e->d_name)) continue;
        struct folder *more = realloc(folder, (n + 1) * sizeof *more);
        if (more == NULL) {
            s = error_set(err, STATUS_NO_MEMORY, "cannot list '%s': out of memory", path);
            break;
        }
        folder = more;
        folder[n] = (struct folder){0};
        memcpy(folder[n].id, e->d_name, 37);
        path_join(one, path, e->d_name, NULL);
        if (ages) folder[n].created_unix_s = created_of(one);
        n++;
    }
    if (d != NULL) closedir(d);
    if (s != STATUS_OK) {
        free(folder);
        return s;
    }
    if (n > 0) qsort(folder, n, sizeof *folder, oldest_first);
    *out = folder;
    *n_out = n;
    return STATUS_OK;
}

/* A server's database may be behind the folders, too: when an old dump was put back, or another database is named.
 * One of an older version is not compared. */
static status shared_is_behind(const struct settings *settings, struct error *err)
{
    struct store *store = NULL;
    struct error why = {0};
    status s = store_settings_open(settings, true, &store, NULL);
    if (s == STATUS_OK) s = database_age_check(settings, "PostgreSQL", store, &why);
    store_close(store);
    if (s != STATUS_FORMAT) return STATUS_OK; /* whatever else is wrong, opening it will tell */
    return error_set(err, s,
                     "%s; put a newer dump of it back, or give up these jobs by moving their folders out of '%s/jobs'",
                     why.text, settings->data);
}

status rebuild_is_needed(const struct settings *settings, struct error *err)
{
    char path[PATH_BYTES];
    struct folder *folder = NULL;
    size_t n = 0;
    struct error why = {0};
    if (store_settings_shared(settings)) return shared_is_behind(settings, err);
    database_path(settings, path);
    status s = store_examine(path, false, NULL, &why);
    if (s == STATUS_NOT_FOUND && list_folders(settings->data, false, &folder, &n, NULL) == STATUS_OK && n > 0) {
        s = STATUS_FORMAT;
        error_set(&why, s, "database '%s' is missing or empty, but there are folders of %zu jobs", path, n);
    }
    free(folder);
    if (s == STATUS_OK) s = database_age_check(settings, path, NULL, &why);
    if (s != STATUS_FORMAT) return STATUS_OK; /* whatever else is wrong, opening it will tell */
    return error_set(err, s, "%s; bring it back from backup and job folders with: selvedged --data '%s' --rebuild",
                     why.text, settings->data);
}

/* Copies the newest source that is sound to the file `to`. *kept: it is the present database. */
static status copy_base(const struct settings *settings, const char *to, bool *kept, FILE *report, struct error *err)
{
    char path[PATH_BYTES], folder[PATH_BYTES];
    struct backup_file *backup = NULL;
    struct store_summary found;
    size_t n = 0;
    bool copied = false;
    struct error why = {0};
    database_path(settings, path);
    status s = store_backup(path, to, &found, &why);
    *kept = s == STATUS_OK;
    if (s == STATUS_OK) fprintf(report, "the present database is sound: %lld jobs\n", (long long)found.n_job);
    if (s == STATUS_OK) return s;
    if (s != STATUS_NOT_FOUND && s != STATUS_FORMAT) return error_set(err, s, "%s", why.text);
    fprintf(report, "%s\n", why.text);
    backup_folder(settings, folder);
    s = backup_list(folder, &backup, &n, err);
    for (size_t i = 0; s == STATUS_OK && !copied && i < n; i++) {
        path_join(path, folder, backup[i].name, NULL);
        status tried = store_backup(path, to, &found, &why);
        copied = tried == STATUS_OK;
        if (copied)
            fprintf(report, "begun with the backup '%s': %lld jobs\n", path, (long long)found.n_job);
        else
            fprintf(report, "backup '%s' is of no use: %s\n", path, why.text);
        if (!copied && tried != STATUS_NOT_FOUND && tried != STATUS_FORMAT) s = error_set(err, tried, "%s", why.text);
    }
    if (s == STATUS_OK && !copied) fprintf(report, "there is no backup; begun with an empty database\n");
    free(backup);
    return s;
}

struct tally {
    size_t n_job, n_state[JOB_N_STATE], n_file, n_again, n_lost;
    bool owned; /* a job was made with a token */
};

/* Reads a folder and writes its job. The notes come after the line about the job. */
static status bring_back(struct store *store, struct evidence_request *q, struct tally *tally, FILE *report,
                         struct error *err)
{
    struct job_evidence e = {0};
    char *text = NULL;
    size_t n_text = 0;
    q->notes = open_memstream(&text, &n_text);
    if (q->notes == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot rebuild: out of memory");
    status s = job_evidence_read(q, &e, err);
    if (s == STATUS_OK)
        s = store_import(store, &e.row, e.file, e.n_file, e.key[0] != '\0' ? e.key : NULL, e.body_hash, err);
    fclose(q->notes);
    if (s == STATUS_OK) {
        tally->n_job++;
        tally->owned = tally->owned || e.row.owner[0] != '\0';
        tally->n_state[e.row.state] += !e.row.deleted;
        tally->n_file += e.n_complete;
        tally->n_again += e.n_file - e.n_complete;
        fprintf(report, "job %s: '%s' %s%s, %zu of %zu inputs\n%s", q->id, e.row.sample, job_state_name(e.row.state),
                e.row.deleted ? ", deleted" : "", e.n_complete, e.n_file, text);
    }
    free(text);
    job_evidence_release(&e);
    return s;
}

/* The same for a job that the store may know. A folder that says nothing is reported and left. */
static status bring_back_folder(struct store *store, const char *data, const char *id, bool resume, struct tally *tally,
                                FILE *report, struct error *err)
{
    struct job_row base;
    struct file_row *file = NULL;
    struct error why = {0};
    struct evidence_request q = {.data = data, .id = id, .resume = resume};
    status s = store_job_get(store, id, &base, err);
    if (s == STATUS_OK) {
        q.base = &base;
        s = store_file_list(store, id, &file, &q.n_base_file, err);
        q.base_file = file;
    } else if (s == STATUS_NOT_FOUND)
        s = STATUS_OK;
    if (s == STATUS_OK) s = bring_back(store, &q, tally, report, &why);
    if (s == STATUS_NOT_FOUND || s == STATUS_FORMAT || s == STATUS_INVALID || s == STATUS_TOO_LARGE) {
        fprintf(report, "job %s is not brought back: %s\n", id, why.text);
        tally->n_lost++;
        s = STATUS_OK;
    } else if (s != STATUS_OK && err != NULL && err->text[0] == '\0')
        s = error_set(err, s, "%s", why.text);
    free(file);
    job_row_release(&base);
    return s;
}

/* Jobs of the base that have no folder. Those of a backup were deleted since. */
static status drop_deleted(struct store *store, const struct settings *settings, bool kept, FILE *report,
                           struct error *err)
{
    struct job_row *row = NULL;
    size_t n = 0;
    struct job_query all = {.limit = SIZE_MAX >> 1};
    status s = store_job_list(store, &all, &row, &n, err);
    for (size_t i = 0; s == STATUS_OK && i < n; i++) {
        char path[PATH_BYTES];
        struct stat st;
        path_join(path, settings->data, "jobs", row[i].id, NULL);
        if (lstat(path, &st) == 0 || errno != ENOENT) continue;
        fprintf(report, "job %s: '%s' has no folder; %s\n", row[i].id, row[i].sample,
                kept ? "its row is kept" : "it was deleted after the backup");
        if (!kept) s = store_job_erase(store, row[i].id, err);
    }
    job_rows_free(row, n);
    return s;
}

/* Tokens are in the database only. Where they are lost, but were in use, every request still needs one. */
static status close_access(struct store *store, const struct tally *t, bool kept, FILE *report, struct error *err)
{
    bool any = false;
    if (kept) return STATUS_OK;
    status s = store_token_any(store, &any, err);
    if (s == STATUS_OK) s = store_access_rebuilt(store, !any && t->owned, clock_wall_s(), err);
    if (s == STATUS_OK && any)
        fprintf(report, "access tokens are those of the backup: look whether one that was revoked since is among "
                        "them (GET /v1/tokens), and make those anew that were made since\n");
    else if (s == STATUS_OK && t->owned)
        fprintf(report, "access tokens are lost; every request needs one: make the first with --make-token\n");
    return s;
}

static void print_tally(const struct tally *t, bool kept, FILE *report)
{
    fprintf(report, "%zu jobs are brought back (", t->n_job);
    for (int i = 0; i < JOB_N_STATE; i++)
        fprintf(report, "%s%zu %s", i > 0 ? ", " : "", t->n_state[i], job_state_name((enum job_state)i));
    fprintf(report, "), %zu inputs are right, %zu must be sent again\n", t->n_file, t->n_again);
    if (t->n_lost > 0) fprintf(report, "%zu folders could not be read as jobs\n", t->n_lost);
    if (!kept) fprintf(report, "deliveries of webhooks since the backup are not known and are not sent again\n");
}

static status fill(const struct settings *settings, const char *path, bool kept, bool resume, FILE *report,
                   struct error *err)
{
    struct store *store = NULL;
    struct folder *folder = NULL;
    struct tally tally = {0};
    size_t n = 0;
    status s = store_open(path, &store, err);
    /* receivers may have the deliveries of these jobs; the next start says anew whether there is a webhook */
    if (s == STATUS_OK) s = store_webhook_enable(store, false, err);
    if (s == STATUS_OK) s = list_folders(settings->data, true, &folder, &n, err);
    for (size_t i = 0; s == STATUS_OK && i < n; i++)
        s = bring_back_folder(store, settings->data, folder[i].id, resume, &tally, report, err);
    if (s == STATUS_OK) s = drop_deleted(store, settings, kept, report, err);
    if (s == STATUS_OK) s = close_access(store, &tally, kept, report, err);
    store_close(store);
    free(folder);
    if (s == STATUS_OK) s = store_examine(path, true, NULL, err);
    if (s == STATUS_OK) print_tally(&tally, kept, report);
    return s;
}

/* Moves the present files aside, the database last, and the new database to its place. */
static status swap(const struct settings *settings, const char *made, FILE *report, struct error *err)
{
    static const char *const ending[] = {"-wal", "-shm", ""};
    char present[PATH_BYTES], from[PATH_BYTES + 8], folder[PATH_BYTES], to[PATH_BYTES], name[80];
    database_path(settings, present);
    path_join(folder, settings->data, "replaced", NULL);
    status s = durable_make_folder(folder, err);
    if (s == STATUS_OK) s = durable_sync_folder_of(folder, err);
    double now = clock_wall_s();
    for (size_t i = 0; s == STATUS_OK && i < 3; i++) {
        snprintf(from, sizeof from, "%s%s", present, ending[i]);
        snprintf(name, sizeof name, "selvedge-%.3f.db%s", now, ending[i]);
        path_join(to, folder, name, NULL);
        if (rename(from, to) == 0)
            fprintf(report, "'%s' is moved to '%s'\n", from, to);
        else if (errno != ENOENT)
            s = error_set_errno(err, "cannot move '%s' to '%s'", from, to);
    }
    if (s == STATUS_OK) s = durable_sync_folder_of(to, err);
    if (s == STATUS_OK) s = durable_rename(made, present, err);
    return s;
}

/* Moves the folders of jobs that are not in the new database to quarantine; a start would say that it lacks them. */
static status set_aside_lost(const struct settings *settings, FILE *report, struct error *err)
{
    struct store *store = NULL;
    struct folder *folder = NULL;
    size_t n = 0;
    char path[PATH_BYTES], from[PATH_BYTES], to[PATH_BYTES], name[80];
    database_path(settings, path);
    status s = store_open(path, &store, err);
    if (s == STATUS_OK) s = list_folders(settings->data, false, &folder, &n, err);
    path_join(path, settings->data, "quarantine", NULL);
    if (s == STATUS_OK) s = durable_make_folder(path, err);
    for (size_t i = 0; s == STATUS_OK && i < n; i++) {
        struct job_row row = {0};
        if (store_job_look(store, folder[i].id, &row, NULL) != STATUS_NOT_FOUND) continue;
        snprintf(name, sizeof name, "%s-%.0f", folder[i].id, clock_wall_s());
        path_join(from, settings->data, "jobs", folder[i].id, NULL);
        path_join(to, path, name, NULL);
        if (rename(from, to) != 0)
            s = error_set_errno(err, "cannot move '%s' to quarantine", from);
        else
            fprintf(report, "the folder of job %s is moved to '%s'\n", folder[i].id, to);
    }
    store_close(store);
    free(folder);
    return s;
}

status rebuild(const struct settings *settings, bool resume, FILE *report, struct error *err)
{
    char folder[PATH_BYTES], made[PATH_BYTES];
    bool kept = false;
    path_join(folder, settings->data, "rebuild", NULL);
    path_join(made, folder, "selvedge.db", NULL);
    status s = store_settings_need_file(settings, "--rebuild", "bring the database back with pg_restore", err);
    if (s != STATUS_OK) return s;
    s = file_tree_remove(folder, err);
    if (s == STATUS_OK) s = durable_make_folder(folder, err);
    if (s == STATUS_OK) s = copy_base(settings, made, &kept, report, err);
    if (s == STATUS_OK) s = fill(settings, made, kept, resume, report, err);
    if (s == STATUS_OK) s = swap(settings, made, report, err);
    if (s == STATUS_OK) s = set_aside_lost(settings, report, err);
    file_tree_remove(folder, NULL);
    return s == STATUS_OK ? s : error_prefix(err, s, "cannot rebuild the database");
}

status rebuild_one(struct store *store, const char *data, const char *id, FILE *report, struct error *err)
{
    struct tally tally = {0};
    struct evidence_request q = {.data = data, .id = id};
    return bring_back(store, &q, &tally, report, err);
}
