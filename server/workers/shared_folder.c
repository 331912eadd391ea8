#include "server/workers/shared_folder.h"
#include "base/clock.h"
#include "base/files/durable.h"
#include "server/settings/job_paths.h"
#include "server/store/store_cluster.h"
#include "server/store/store_settings.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#define IDENTITY "store.id"

static status unfit(const char *folder, const char *what, struct error *err)
{
    return error_set(err, STATUS_UNSUPPORTED, "cannot share data folder '%s': %s (docs/shared-database.md)", folder,
                     what);
}

/* Two descriptors of a file: the second one must not get the lock of the first one. */
static status check_locks(const char *folder, const char *path, struct error *err)
{
    status s = STATUS_OK;
    int first = open(path, O_RDWR | O_CLOEXEC), second = open(path, O_RDWR | O_CLOEXEC);
    if (first < 0 || second < 0)
        s = error_set_errno(err, "cannot open '%s'", path);
    else if (flock(first, LOCK_EX | LOCK_NB) != 0)
        s = unfit(folder, "its file system has no locks (flock)", err);
    else if (flock(second, LOCK_EX | LOCK_NB) == 0 || errno != EWOULDBLOCK)
        s = unfit(folder, "locks of its file system (flock) exclude nobody", err);
    if (first >= 0) close(first);
    if (second >= 0) close(second);
    return s;
}

static status write_trial(const char *folder, const char *path, double *clock_lag_s, struct error *err)
{
    struct stat st;
    status s = STATUS_OK;
    int fd = open(path, O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, 0600);
    double now_s = clock_wall_s();
    if (fd < 0) return error_set_errno(err, "cannot write into '%s'", folder);
    if (write(fd, "1", 1) != 1 || fsync(fd) != 0) s = error_set_errno(err, "cannot sync a file in '%s'", folder);
    if (s == STATUS_OK && fstat(fd, &st) == 0 && clock_lag_s != NULL)
        *clock_lag_s = now_s - ((double)st.st_mtim.tv_sec + 1e-9 * (double)st.st_mtim.tv_nsec);
    int again = open(path, O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, 0600);
    if (s == STATUS_OK && (again >= 0 || errno != EEXIST))
        s = unfit(folder, "a name can be created twice (O_EXCL)", err);
    if (again >= 0) close(again);
    close(fd);
    return s;
}

status shared_folder_check(const char *folder, double *clock_lag_s, struct error *err)
{
    char path[PATH_BYTES], other[PATH_BYTES], name[64];
    struct stat st, renamed;
    snprintf(name, sizeof name, "trial-%lld-%.9f", (long long)getpid(), clock_wall_s());
    path_join(path, folder, name, NULL);
    snprintf(other, sizeof other, "%.4000s.to", path);
    status s = write_trial(folder, path, clock_lag_s, err);
    if (s == STATUS_OK) s = check_locks(folder, path, err);
    if (s == STATUS_OK) s = durable_replace(other, "2", 1, err);
    if (s == STATUS_OK && stat(path, &st) != 0) s = error_set_errno(err, "cannot read '%s'", path);
    if (s == STATUS_OK && rename(path, other) != 0) s = error_set_errno(err, "cannot rename in '%s'", folder);
    if (s == STATUS_OK && (stat(other, &renamed) != 0 || renamed.st_ino != st.st_ino || access(path, F_OK) == 0))
        s = unfit(folder, "a rename does not replace the file of that name", err);
    if (s == STATUS_OK) s = durable_sync_folder_of(path, err);
    unlink(path);
    unlink(other);
    return s;
}

static bool has_entries(const char *path)
{
    bool found = false;
    DIR *d = opendir(path);
    for (struct dirent *e; d != NULL && !found && (e = readdir(d)) != NULL;) found = e->d_name[0] != '.';
    if (d != NULL) closedir(d);
    return found;
}

/* Makes a folder that has no jobs the one of this database. */
static status adopt_folder(const char *data, const char *path, const char *id, struct error *err)
{
    char jobs[PATH_BYTES], database[PATH_BYTES];
    path_join(jobs, data, "jobs", NULL);
    path_join(database, data, "selvedge.db", NULL);
    if (access(database, F_OK) == 0)
        return error_set(err, STATUS_CONFLICT,
                         "data folder '%s' has an embedded database, 'selvedge.db'; begin with an empty folder", data);
    if (has_entries(jobs))
        return error_set(err, STATUS_CONFLICT,
                         "data folder '%s' has jobs of another database; begin with an empty folder", data);
    return durable_replace(path, id, strlen(id), err);
}

status shared_folder_admit(struct job_service *v, struct error *err)
{
    const char *data = v->settings->data;
    char path[PATH_BYTES], id[STORE_ID_BYTES], *found = NULL;
    path_join(path, data, IDENTITY, NULL);
    status read = file_read_all(path, 256, &found, NULL, NULL);
    status s = STATUS_OK;
    if (!store_is_shared(v->store) && read == STATUS_OK)
        s = error_set(err, STATUS_CONFLICT,
                      "data folder '%s' belongs to a PostgreSQL database, which setting 'server.store' must name",
                      data);
    if (store_is_shared(v->store)) {
        s = shared_folder_check(data, NULL, err);
        if (s == STATUS_OK) s = store_identity(v->store, id, err);
        if (s == STATUS_OK && read == STATUS_NOT_FOUND)
            s = adopt_folder(data, path, id, err);
        else if (s == STATUS_OK && (read != STATUS_OK || strcmp(found, id) != 0))
            s = error_set(err, STATUS_CONFLICT,
                          "data folder '%s' belongs to another database than 'server.store' names", data);
    }
    free(found);
    return s;
}
