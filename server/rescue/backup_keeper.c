#include "server/rescue/backup_keeper.h"
#include "base/clock.h"
#include "base/files/durable.h"
#include "server/rescue/backup_files.h"
#include "server/store/drivers/store_backup.h"
#include "server/store/store_settings.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

/* Pauses before the first backup, so that a start is not slowed, and after one that failed. */
enum { FIRST_S = 60, AGAIN_S = 300 };

struct backup_keeper {
    struct job_service *v;
    char folder[PATH_BYTES], database[PATH_BYTES];
    pthread_t thread;
    pthread_mutex_t lock; /* guards the members below */
    pthread_cond_t stopped;
    bool stop;
    struct backup_state state;
};

static int64_t size_of(const char *path)
{
    struct stat st;
    return stat(path, &st) == 0 ? (int64_t)st.st_size : 0;
}

/* The backup must not take the space that is kept in reserve. */
static status check_room(struct backup_keeper *k, struct error *err)
{
    char wal[PATH_BYTES + 8];
    long long free_bytes = 0;
    snprintf(wal, sizeof wal, "%s-wal", k->database);
    int64_t most = size_of(k->database) + size_of(wal);
    status s = path_free_bytes(k->folder, &free_bytes, err);
    if (s == STATUS_OK && free_bytes - most < k->v->settings->floor_bytes)
        s = error_set(err, STATUS_DISK_FULL,
                      "cannot back up the database to '%s': it may take %lld bytes, and of %lld free bytes %lld are "
                      "kept in reserve",
                      k->folder, (long long)most, free_bytes, (long long)k->v->settings->floor_bytes);
    return s;
}

static status back_up(struct backup_keeper *k, struct store_summary *summary, int64_t now_unix_s, struct error *err)
{
    char path[PATH_BYTES];
    backup_path(k->folder, now_unix_s, path);
    status s = durable_make_folder(k->folder, err);
    if (s == STATUS_OK) s = durable_sync_folder_of(k->folder, err);
    if (s == STATUS_OK) s = check_room(k, err);
    if (s == STATUS_OK) s = store_backup(k->database, path, summary, err);
    return s;
}

/* Makes one backup. Returns the seconds until the next one. */
static double one_round(struct backup_keeper *k)
{
    const struct settings *settings = k->v->settings;
    struct error err = {0};
    struct store_summary found = {0};
    int64_t now_unix_s = (int64_t)clock_wall_s();
    status s = back_up(k, &found, now_unix_s, &err);
    pthread_mutex_lock(&k->lock);
    if (s == STATUS_OK) {
        k->state.last_good_unix_s = now_unix_s;
        k->state.last_good_bytes = found.n_bytes;
        k->state.n_good++;
    } else
        k->state.n_failed++;
    snprintf(k->state.error, sizeof k->state.error, "%s", s == STATUS_OK ? "" : err.text);
    pthread_mutex_unlock(&k->lock);
    if (s == STATUS_OK)
        log_info(k->v->log, "the database is backed up: %lld jobs, %lld files, %lld bytes", (long long)found.n_job,
                 (long long)found.n_file, (long long)found.n_bytes);
    else
        log_error(k->v->log, "%s", err.text);
    if (s == STATUS_OK && backup_prune(k->folder, settings->backup_keep, settings->backup_keep_days, &err) != STATUS_OK)
        log_warning(k->v->log, "%s", err.text);
    return (double)(s == STATUS_OK || settings->backup_every_s < AGAIN_S ? settings->backup_every_s : AGAIN_S);
}

/* Finds the newest backup. Returns the seconds until the first one of this start. */
static double first_wait_s(struct backup_keeper *k)
{
    struct backup_file *file = NULL;
    size_t n = 0;
    char path[PATH_BYTES];
    double every_s = (double)k->v->settings->backup_every_s, wait_s = 0;
    if (backup_list(k->folder, &file, &n, NULL) == STATUS_OK && n > 0) {
        path_join(path, k->folder, file[0].name, NULL);
        k->state.last_good_unix_s = file[0].made_unix_s;
        k->state.last_good_bytes = size_of(path);
        wait_s = every_s - (clock_wall_s() - (double)file[0].made_unix_s);
    }
    free(file);
    if (wait_s > every_s) wait_s = every_s; /* the clock was set back */
    double least_s = every_s < FIRST_S ? every_s : FIRST_S;
    return wait_s > least_s ? wait_s : least_s;
}

static void *run(void *context)
{
    struct backup_keeper *k = context;
    pthread_mutex_lock(&k->lock);
    double wait_s = first_wait_s(k);
    while (!k->stop) {
        double until_s = clock_monotonic_s() + wait_s;
        struct timespec until = {.tv_sec = (time_t)until_s,
                                 .tv_nsec = (long)(1e9 * (until_s - (double)(time_t)until_s))};
        int e = 0;
        while (!k->stop && e != ETIMEDOUT) e = pthread_cond_timedwait(&k->stopped, &k->lock, &until);
        if (k->stop) break;
        pthread_mutex_unlock(&k->lock);
        wait_s = one_round(k);
        pthread_mutex_lock(&k->lock);
    }
    pthread_mutex_unlock(&k->lock);
    return NULL;
}

status backup_keeper_start(struct job_service *v, struct backup_keeper **out, struct error *err)
{
    *out = NULL;
    /* a server is backed up by its own means (docs/shared-database.md) */
    if (v->settings->backup_every_s == 0 || store_settings_shared(v->settings)) return STATUS_OK;
    struct backup_keeper *k = calloc(1, sizeof *k);
    if (k == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot start backups: out of memory");
    k->v = v;
    backup_folder(v->settings, k->folder);
    path_join(k->database, v->settings->data, "selvedge.db", NULL);
    pthread_mutex_init(&k->lock, NULL);
    pthread_condattr_t attr;
    pthread_condattr_init(&attr);
    pthread_condattr_setclock(&attr, CLOCK_MONOTONIC);
    pthread_cond_init(&k->stopped, &attr);
    pthread_condattr_destroy(&attr);
    int e = pthread_create(&k->thread, NULL, run, k);
    if (e != 0) {
        pthread_cond_destroy(&k->stopped);
        pthread_mutex_destroy(&k->lock);
        free(k);
        errno = e;
        return error_set_errno(err, "cannot start backups");
    }
    v->backup = k;
    *out = k;
    return STATUS_OK;
}

void backup_keeper_stop(struct backup_keeper *k)
{
    if (k == NULL) return;
    pthread_mutex_lock(&k->lock);
    k->stop = true;
    pthread_cond_signal(&k->stopped);
    pthread_mutex_unlock(&k->lock);
    pthread_join(k->thread, NULL);
    k->v->backup = NULL;
    pthread_cond_destroy(&k->stopped);
    pthread_mutex_destroy(&k->lock);
    free(k);
}

void backup_keeper_state(struct backup_keeper *k, struct backup_state *state)
{
    *state = (struct backup_state){0};
    if (k == NULL) return;
    pthread_mutex_lock(&k->lock);
    *state = k->state;
    pthread_mutex_unlock(&k->lock);
}
