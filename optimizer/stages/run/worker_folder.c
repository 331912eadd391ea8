#include "optimizer/stages/run/worker_folder.h"
#include "base/files/durable.h"
#include "optimizer/job/job_folder.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <ftw.h>
#include <inttypes.h>
#include <jansson.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>
#include <zlib.h>

/* Who only looks whether a worker runs, as the doctor does, has the lock for a moment. */
enum { MAX_ATTEMPT_BYTES = 4096, TRIES_OF_LOCK = 10 };

void worker_folder_path(const struct worker_folder *f, const char *a, const char *b, char path[WORKER_PATH_BYTES])
{
    snprintf(path, WORKER_PATH_BYTES, "%s/%s%s%s", f->path, a, b != NULL ? "/" : "", b != NULL ? b : "");
}

/* Reads attempt.json; without that file the number is 0 and the token empty. */
static status read_attempt(const struct worker_folder *f, long long *attempt, char *token, size_t n_token,
                           struct error *err)
{
    char path[WORKER_PATH_BYTES], *text = NULL;
    size_t n = 0;
    *attempt = 0;
    token[0] = '\0';
    worker_folder_path(f, JOB_FILE_ATTEMPT, NULL, path);
    if (access(path, F_OK) != 0 && errno == ENOENT) return STATUS_OK;
    status s = file_read_all(path, MAX_ATTEMPT_BYTES, &text, &n, err);
    if (s != STATUS_OK) return s;
    json_t *json = json_loadb(text, n, 0, NULL);
    const char *value = json_string_value(json_object_get(json, "token"));
    if (value == NULL || strlen(value) >= n_token) {
        s = error_set(err, STATUS_FORMAT, "cannot use '%s': it has no token", path);
    } else {
        memcpy(token, value, strlen(value) + 1);
        *attempt = json_integer_value(json_object_get(json, "attempt"));
    }
    json_decref(json);
    free(text);
    return s;
}

static status take_lock(struct worker_folder *f, struct error *err)
{
    char path[WORKER_PATH_BYTES];
    worker_folder_path(f, JOB_FILE_LOCK, NULL, path);
    f->lock_fd = open(path, O_RDWR | O_CREAT | O_CLOEXEC, 0600);
    if (f->lock_fd < 0) return error_set_errno(err, "cannot lock job folder '%s'", f->path);
    const struct timespec pause = {0, 10000000};
    for (int i = 0; i < TRIES_OF_LOCK; i++) {
        if (flock(f->lock_fd, LOCK_EX | LOCK_NB) == 0) return STATUS_OK;
        if (errno != EWOULDBLOCK) break;
        if (i + 1 < TRIES_OF_LOCK) nanosleep(&pause, NULL);
    }
    if (errno == EWOULDBLOCK)
        return error_set(err, STATUS_STALE, "job folder '%s' is in use by another worker", f->path);
    return error_set_errno(err, "cannot lock job folder '%s'", f->path);
}

status worker_folder_open(struct worker_folder *f, const char *path, struct error *err)
{
    struct stat st;
    char sub[WORKER_PATH_BYTES];
    *f = (struct worker_folder){.lock_fd = -1};
    if (strlen(path) >= sizeof f->path) return error_set(err, STATUS_INVALID, "the job folder's path is too long");
    snprintf(f->path, sizeof f->path, "%s", path);
    for (size_t n = strlen(f->path); n > 1 && f->path[n - 1] == '/'; n--) f->path[n - 1] = '\0';
    if (stat(f->path, &st) != 0 || !S_ISDIR(st.st_mode))
        return error_set(err, STATUS_NOT_FOUND, "there is no job folder '%s'", f->path);
    status s = take_lock(f, err);
    if (s == STATUS_OK) s = read_attempt(f, &f->attempt, f->token, sizeof f->token, err);
    worker_folder_path(f, JOB_FOLDER_WORK, NULL, sub);
    if (s == STATUS_OK) s = durable_make_folder(sub, err);
    worker_folder_path(f, JOB_FOLDER_RESULTS, NULL, sub);
    if (s == STATUS_OK) s = durable_make_folder(sub, err);
    if (s != STATUS_OK) worker_folder_close(f);
    return s;
}

void worker_folder_close(struct worker_folder *f)
{
    if (f->lock_fd >= 0) close(f->lock_fd);
    f->lock_fd = -1;
}

/* Removes the claims of earlier attempts. One that stays does no harm. */
static void remove_claims(const struct worker_folder *f, const char *keep)
{
    char path[WORKER_PATH_BYTES];
    DIR *d = opendir(f->path);
    for (struct dirent *e; d != NULL && (e = readdir(d)) != NULL;) {
        if (strncmp(e->d_name, JOB_CLAIM_PREFIX, strlen(JOB_CLAIM_PREFIX)) != 0 || strcmp(e->d_name, keep) == 0)
            continue;
        worker_folder_path(f, e->d_name, NULL, path);
        unlink(path);
    }
    if (d != NULL) closedir(d);
}

/* Returns STATUS_STALE when the claim is another start's. A claim of this start is its own: a network file system may
 * repeat the request that made it. */
static status check_claim(const char *path, const char *start, struct error *err)
{
    char *text = NULL;
    size_t n = 0;
    status s = file_read_all(path, MAX_ATTEMPT_BYTES, &text, &n, err);
    if (s == STATUS_OK && strcmp(text, start) != 0)
        s = error_set(err, STATUS_STALE, "this attempt belongs to the start '%.60s', not to '%.60s'", text, start);
    free(text);
    return s;
}

status worker_folder_claim(const struct worker_folder *f, const char *start, struct error *err)
{
    char name[sizeof JOB_CLAIM_PREFIX + sizeof f->token], path[WORKER_PATH_BYTES];
    if (f->token[0] == '\0') return STATUS_OK;
    if (strchr(f->token, '/') != NULL)
        return error_set(err, STATUS_FORMAT, "cannot use the token of attempt %lld: it has a '/'", f->attempt);
    snprintf(name, sizeof name, "%s%s", JOB_CLAIM_PREFIX, f->token);
    worker_folder_path(f, name, NULL, path);
    int fd = open(path, O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC | O_NOFOLLOW, 0600);
    if (fd < 0 && errno == EEXIST) return check_claim(path, start, err);
    if (fd < 0) return error_set_errno(err, "cannot write '%s'", path);
    bool written = write(fd, start, strlen(start)) == (ssize_t)strlen(start) && fsync(fd) == 0;
    status s = written ? durable_sync_folder_of(path, err) : error_set_errno(err, "cannot write '%s'", path);
    close(fd);
    if (!written) unlink(path); /* an empty claim would refuse the same start when it comes again */
    if (s == STATUS_OK) remove_claims(f, name);
    return s == STATUS_OK ? worker_folder_check(f, err) : s;
}

status worker_folder_check(const struct worker_folder *f, struct error *err)
{
    long long attempt;
    char token[sizeof f->token];
    if (f->token[0] == '\0') return STATUS_OK;
    status s = read_attempt(f, &attempt, token, sizeof token, err);
    if (s != STATUS_OK) return s;
    if (attempt == f->attempt && strcmp(token, f->token) == 0) return STATUS_OK;
    return error_set(err, STATUS_STALE, "attempt %lld of this job is no longer current: attempt %lld is", f->attempt,
                     attempt);
}

status worker_folder_replace(const struct worker_folder *f, const char *path, const void *data, size_t n_bytes,
                             struct error *err)
{
    status s = worker_folder_check(f, err);
    return s == STATUS_OK ? durable_replace(path, data, n_bytes, err) : s;
}

static int remove_entry(const char *path, const struct stat *st, int kind, struct FTW *at)
{
    (void)st;
    (void)kind;
    return at->level == 0 ? 0 : remove(path);
}

/* Removes everything in a folder of the job; links are not followed. */
static status empty_folder(const struct worker_folder *f, const char *name, struct error *err)
{
    char path[WORKER_PATH_BYTES];
    worker_folder_path(f, name, NULL, path);
    if (nftw(path, remove_entry, 16, FTW_DEPTH | FTW_PHYS) != 0) return error_set_errno(err, "cannot empty '%s'", path);
    return STATUS_OK;
}

/* Returns whether a file is one that a writer renames when it is whole: "x.part", or durable_replace's
 * "x.tmp-AbCdEf". */
static bool is_temporary(const char *name)
{
    static const char part[] = ".part", tmp[] = ".tmp-";
    size_t n = strlen(name), n_random = 6;
    if (n >= sizeof part - 1 && strcmp(name + n - (sizeof part - 1), part) == 0) return true;
    return n >= sizeof tmp - 1 + n_random && strncmp(name + n - n_random - (sizeof tmp - 1), tmp, sizeof tmp - 1) == 0;
}

static int remove_temporary(const char *path, const struct stat *st, int kind, struct FTW *at)
{
    (void)st;
    if (kind == FTW_F && is_temporary(path + at->base)) unlink(path);
    return 0;
}

void worker_folder_sweep(const struct worker_folder *f)
{
    static const char *const folder[] = {JOB_FOLDER_WORK, JOB_FOLDER_RESULTS};
    char path[WORKER_PATH_BYTES];
    for (size_t i = 0; i < sizeof folder / sizeof folder[0]; i++) {
        worker_folder_path(f, folder[i], NULL, path);
        nftw(path, remove_temporary, 16, FTW_PHYS);
    }
}

enum { PROGRAM_MAX_BYTES = 256 << 20 };

/* Checksum of the running program, because another build may trace other numbers, which must not be mixed with the
 * numbers of an earlier run. 0 where the system does not show the program. */
static uint32_t program_sum(void)
{
    char *text = NULL;
    size_t n = 0;
    if (file_read_all("/proc/self/exe", PROGRAM_MAX_BYTES, &text, &n, NULL) != STATUS_OK) return 0;
    uint32_t sum = (uint32_t)crc32_z(0, (const void *)text, n);
    free(text);
    return sum;
}

uint64_t document_fingerprint(const char *document, size_t n_bytes)
{
    return crc32_z(program_sum(), (const void *)document, n_bytes);
}

status worker_folder_match_inputs(const struct worker_folder *f, uint64_t fingerprint, bool *changed, struct error *err)
{
    char path[WORKER_PATH_BYTES], series[WORKER_PATH_BYTES], want[32], *have = NULL;
    size_t n = 0;
    snprintf(want, sizeof want, "%016" PRIx64 "\n", fingerprint);
    worker_folder_path(f, JOB_FOLDER_WORK, WORKER_FILE_FINGERPRINT, path);
    *changed = false;
    if (file_read_all(path, 64, &have, &n, NULL) == STATUS_OK) {
        *changed = strcmp(have, want) != 0;
        free(have);
        if (!*changed) return STATUS_OK;
    }
    /* also without a stored fingerprint: a worker that was killed here may have removed it and left the marks of
     * stages */
    status s = worker_folder_check(f, err);
    if (s == STATUS_OK) s = empty_folder(f, JOB_FOLDER_WORK, err);
    if (s == STATUS_OK) s = empty_folder(f, JOB_FOLDER_RESULTS, err);
    worker_folder_path(f, JOB_FILE_SERIES, NULL, series);
    if (s == STATUS_OK && unlink(series) != 0 && errno != ENOENT)
        s = error_set_errno(err, "cannot remove '%s'", series);
    return s == STATUS_OK ? worker_folder_replace(f, path, want, strlen(want), err) : s;
}

static void mark_path(const struct worker_folder *f, const char *stage, char path[WORKER_PATH_BYTES])
{
    char name[80];
    snprintf(name, sizeof name, "%.60s.done", stage);
    worker_folder_path(f, JOB_FOLDER_WORK, name, path);
}

bool worker_folder_stage_done(const struct worker_folder *f, const char *stage)
{
    char path[WORKER_PATH_BYTES];
    mark_path(f, stage, path);
    return access(path, F_OK) == 0;
}

status worker_folder_mark_stage(const struct worker_folder *f, const char *stage, struct error *err)
{
    char path[WORKER_PATH_BYTES];
    mark_path(f, stage, path);
    return worker_folder_replace(f, path, "done\n", 5, err);
}

status worker_folder_unmark_stage(const struct worker_folder *f, const char *stage, struct error *err)
{
    char path[WORKER_PATH_BYTES];
    mark_path(f, stage, path);
    status s = worker_folder_check(f, err);
    if (s != STATUS_OK) return s;
    if (unlink(path) == 0) return durable_sync_folder_of(path, err);
    return errno == ENOENT ? STATUS_OK : error_set_errno(err, "cannot remove '%s'", path);
}
