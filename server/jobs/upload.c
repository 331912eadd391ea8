#include "server/jobs/upload.h"
#include "base/files/durable.h"
#include "optimizer/job/job_folder.h"
#include "server/jobs/job_paths.h"

#include <errno.h>
#include <fcntl.h>
#include <pthread.h>
#include <sodium.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

_Static_assert(sizeof(crypto_hash_sha256_state) <= STORE_HASH_STATE_BYTES, "the hash state fits its column");

struct upload {
    struct upload_set *set;
    struct upload *next;
    size_t n_holder; /* guarded by set->lock */
    pthread_mutex_t lock;
    struct file_row row; /* as in the database */
    int64_t offset_bytes;
    crypto_hash_sha256_state hash;
    atomic_int_least64_t offset_seen; /* copy of offset_bytes for readers without the lock */
    uint64_t ticket;
    bool discarded;
    int fd;
};

struct upload_set {
    struct store *store;
    const char *data;
    int64_t commit_bytes;
    struct log *log;
    pthread_mutex_t lock;
    struct upload *first;
    atomic_uint_least64_t n_bytes_total;
};

status upload_set_new(struct store *store, const char *data_folder, int64_t commit_bytes, struct log *log,
                      struct upload_set **out, struct error *err)
{
    struct upload_set *set = calloc(1, sizeof *set);
    if (set == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot prepare uploads: out of memory");
    set->store = store;
    set->data = data_folder;
    set->commit_bytes = commit_bytes;
    set->log = log;
    pthread_mutex_init(&set->lock, NULL);
    *out = set;
    return STATUS_OK;
}

void upload_set_free(struct upload_set *set)
{
    if (set == NULL) return;
    pthread_mutex_destroy(&set->lock);
    free(set);
}

static void part_path(const struct upload_set *set, const struct file_row *row, char out[PATH_BYTES])
{
    path_join(out, set->data, "jobs", row->job_id, "upload", row->id, NULL);
}

static void input_path(const struct upload_set *set, const struct file_row *row, char out[PATH_BYTES])
{
    path_join(out, set->data, "jobs", row->job_id, JOB_FOLDER_INPUT, row->name, NULL);
}

static void hash_restart(struct file_row *row)
{
    crypto_hash_sha256_state state;
    memset(&state, 0, sizeof state);
    crypto_hash_sha256_init(&state);
    memset(row->hash_state, 0, sizeof row->hash_state);
    memcpy(row->hash_state, &state, sizeof state);
}

status upload_reserve(struct upload_set *set, struct file_row *row, struct error *err)
{
    char path[PATH_BYTES];
    part_path(set, row, path);
    status s = STATUS_OK;
    int fd = open(path, O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC | O_NOFOLLOW, 0600);
    if (fd < 0) return error_set_errno(err, "cannot make room for '%s'", row->name);
    /* not posix_fallocate(), which writes every block of a file on file systems that cannot reserve space */
    if (fallocate(fd, 0, 0, (off_t)row->size_bytes) != 0 && errno != EOPNOTSUPP) {
        s = errno == EFBIG
                ? error_set(err, STATUS_DISK_FULL,
                            "cannot make room for '%s': the file system does not support files of %lld bytes",
                            row->name, (long long)row->size_bytes)
                : error_set_errno(err, "cannot make room for the %lld bytes of '%s'", (long long)row->size_bytes,
                                  row->name);
        goto out;
    }
    if (fsync(fd) != 0) s = error_set_errno(err, "cannot make room for '%s'", row->name);
    if (s == STATUS_OK) s = durable_sync_folder_of(path, err);
    row->offset_bytes = 0;
    row->state = FILE_UPLOADING;
    hash_restart(row);
out:
    close(fd);
    if (s != STATUS_OK) unlink(path);
    return s;
}

static struct upload *find(struct upload_set *set, const char *id)
{
    struct upload *u = set->first;
    while (u != NULL && strcmp(u->row.id, id) != 0) u = u->next;
    return u;
}

void upload_discard(struct upload_set *set, const struct file_row *row)
{
    char path[PATH_BYTES];
    pthread_mutex_lock(&set->lock);
    struct upload *u = find(set, row->id);
    if (u != NULL) {
        pthread_mutex_lock(&u->lock);
        u->discarded = true;
        u->ticket++;
        pthread_mutex_unlock(&u->lock);
    }
    pthread_mutex_unlock(&set->lock);
    part_path(set, row, path);
    unlink(path);
    input_path(set, row, path);
    unlink(path);
}

void upload_discard_job(struct upload_set *set, const char *job_id)
{
    pthread_mutex_lock(&set->lock);
    for (struct upload *u = set->first; u != NULL; u = u->next) {
        if (strcmp(u->row.job_id, job_id) != 0) continue;
        pthread_mutex_lock(&u->lock);
        u->discarded = true;
        u->ticket++;
        pthread_mutex_unlock(&u->lock);
    }
    pthread_mutex_unlock(&set->lock);
}

status upload_hold(struct upload_set *set, const char *id, struct upload **out, struct error *err)
{
    status s = STATUS_OK;
    pthread_mutex_lock(&set->lock);
    struct upload *u = find(set, id);
    if (u == NULL) {
        u = calloc(1, sizeof *u);
        if (u == NULL) {
            s = error_set(err, STATUS_NO_MEMORY, "cannot continue upload: out of memory");
            goto out;
        }
        s = store_file_get(set->store, id, &u->row, err);
        if (s != STATUS_OK) {
            free(u);
            goto out;
        }
        u->set = set;
        u->fd = -1;
        u->offset_bytes = u->row.offset_bytes;
        atomic_store(&u->offset_seen, u->offset_bytes);
        memcpy(&u->hash, u->row.hash_state, sizeof u->hash);
        pthread_mutex_init(&u->lock, NULL);
        u->next = set->first;
        set->first = u;
    }
    u->n_holder++;
    *out = u;
out:
    pthread_mutex_unlock(&set->lock);
    return s;
}

void upload_release(struct upload_set *set, struct upload *u)
{
    pthread_mutex_lock(&set->lock);
    if (--u->n_holder == 0) {
        struct upload **link = &set->first;
        while (*link != u) link = &(*link)->next;
        *link = u->next;
        if (u->fd >= 0) close(u->fd);
        pthread_mutex_destroy(&u->lock);
        free(u);
    }
    pthread_mutex_unlock(&set->lock);
}

/* Moves a verified file to its final name. May be repeated after a crash. */
static status move_to_place(struct upload_set *set, struct file_row *row, struct error *err)
{
    char from[PATH_BYTES], to[PATH_BYTES];
    part_path(set, row, from);
    input_path(set, row, to);
    if (rename(from, to) != 0 && !(errno == ENOENT && access(to, R_OK) == 0))
        return error_set_errno(err, "cannot move '%s' to its place", row->name);
    status s = durable_sync_folder_of(to, err);
    if (s == STATUS_OK) s = durable_sync_folder_of(from, err);
    if (s != STATUS_OK) return s;
    row->state = FILE_COMPLETE;
    return store_file_update(set->store, row, err);
}

static status start_again(struct upload *u, const char *computed, struct error *err)
{
    char declared[STORE_HASH_TEXT_BYTES];
    snprintf(declared, sizeof declared, "%s", u->row.sha256);
    hash_restart(&u->row);
    memcpy(&u->hash, u->row.hash_state, sizeof u->hash);
    u->offset_bytes = u->row.offset_bytes = 0;
    atomic_store(&u->offset_seen, 0);
    status s = store_file_update(u->set->store, &u->row, err);
    if (s != STATUS_OK) return s;
    return error_set_field(
        err, STATUS_CHECKSUM, u->row.name,
        "file '%s' has SHA-256 %s, but %s was declared; send it again from offset 0, or delete it and declare it again",
        u->row.name, computed, declared);
}

/* Verifies a file that has all its bytes. u->lock is held and the bytes are on disk. */
static status finish(struct upload *u, struct error *err)
{
    crypto_hash_sha256_state last = u->hash;
    unsigned char sum[crypto_hash_sha256_BYTES];
    char text[STORE_HASH_TEXT_BYTES];
    crypto_hash_sha256_final(&last, sum);
    sodium_bin2hex(text, sizeof text, sum, sizeof sum);
    if (u->row.sha256[0] != '\0' && strcmp(text, u->row.sha256) != 0) return start_again(u, text, err);
    snprintf(u->row.sha256, sizeof u->row.sha256, "%s", text);
    u->row.state = FILE_VERIFIED;
    status s = store_file_update(u->set->store, &u->row, err);
    if (s == STATUS_OK) s = move_to_place(u->set, &u->row, err);
    if (s == STATUS_OK)
        log_info(u->set->log, "file '%s' of job %s is complete, %lld bytes", u->row.name, u->row.job_id,
                 (long long)u->row.size_bytes);
    return s;
}

/* Returns to the last committed offset. After a failed sync the kernel may have dropped the pages, and a second sync
 * would falsely succeed, so bytes that are not committed must be sent again. u->lock is held. */
static status roll_back(struct upload *u, struct error *err)
{
    status s = error_set_errno(err, "cannot write file '%s'", u->row.name);
    u->offset_bytes = u->row.offset_bytes;
    memcpy(&u->hash, u->row.hash_state, sizeof u->hash);
    atomic_store(&u->offset_seen, u->offset_bytes);
    close(u->fd);
    u->fd = -1;
    return s;
}

/* Writes the received bytes to disk, then their offset to the database. u->lock is held. */
static status commit(struct upload *u, struct error *err)
{
    if (u->discarded) return error_set(err, STATUS_NOT_FOUND, "file '%s' was removed", u->row.name);
    if (u->row.state == FILE_COMPLETE) return STATUS_OK;
    if (u->offset_bytes != u->row.offset_bytes) {
        if (u->fd >= 0 && fdatasync(u->fd) != 0) return roll_back(u, err);
        struct file_row next = u->row;
        next.offset_bytes = u->offset_bytes;
        memcpy(next.hash_state, &u->hash, sizeof u->hash);
        status s = store_file_update(u->set->store, &next, err);
        if (s != STATUS_OK) return s;
        u->row = next;
    }
    return u->offset_bytes == u->row.size_bytes ? finish(u, err) : STATUS_OK;
}

status upload_take(struct upload *u, uint64_t *ticket, struct file_row *row, struct error *err)
{
    pthread_mutex_lock(&u->lock);
    u->ticket++;
    *ticket = u->ticket;
    status s = commit(u, err);
    *row = u->row;
    pthread_mutex_unlock(&u->lock);
    return s;
}

static status open_part(struct upload *u, struct error *err)
{
    if (u->fd >= 0) return STATUS_OK;
    char path[PATH_BYTES];
    part_path(u->set, &u->row, path);
    u->fd = open(path, O_WRONLY | O_CLOEXEC | O_NOFOLLOW);
    return u->fd >= 0 ? STATUS_OK : error_set_errno(err, "cannot write file '%s'", u->row.name);
}

status upload_write(struct upload *u, uint64_t ticket, const void *data, size_t n_bytes, struct error *err)
{
    const unsigned char *next = data;
    status s = STATUS_OK;
    pthread_mutex_lock(&u->lock);
    if (u->ticket != ticket || u->discarded)
        s = error_set(err, STATUS_STALE, "another request has taken over the upload of '%s'", u->row.name);
    else if (u->row.state != FILE_UPLOADING || (int64_t)n_bytes > u->row.size_bytes - u->offset_bytes)
        s = error_set(err, STATUS_INVALID, "file '%s' has more bytes than declared", u->row.name);
    if (s == STATUS_OK) s = open_part(u, err);
    while (s == STATUS_OK && n_bytes > 0) {
        ssize_t n = pwrite(u->fd, next, n_bytes, (off_t)u->offset_bytes);
        if (n < 0 && errno == EINTR) continue;
        if (n < 0) {
            s = error_set_errno(err, "cannot write file '%s'", u->row.name);
            break;
        }
        crypto_hash_sha256_update(&u->hash, next, (unsigned long long)n);
        u->offset_bytes += n;
        atomic_store(&u->offset_seen, u->offset_bytes);
        next += n;
        n_bytes -= (size_t)n;
        atomic_fetch_add(&u->set->n_bytes_total, (uint64_t)n);
    }
    if (s == STATUS_OK && u->offset_bytes - u->row.offset_bytes >= u->set->commit_bytes &&
        u->offset_bytes < u->row.size_bytes)
        s = commit(u, err);
    pthread_mutex_unlock(&u->lock);
    return s;
}

status upload_commit(struct upload *u, uint64_t ticket, struct file_row *row, struct error *err)
{
    pthread_mutex_lock(&u->lock);
    status s = u->ticket != ticket
                   ? error_set(err, STATUS_STALE, "another request has taken over the upload of '%s'", u->row.name)
                   : commit(u, err);
    if (row != NULL) *row = u->row;
    pthread_mutex_unlock(&u->lock);
    return s;
}

status upload_set_checksum(struct upload_set *set, const char *id, const char *sha256, struct file_row *row,
                           struct error *err)
{
    struct upload *u = NULL;
    status s = upload_hold(set, id, &u, err); /* held, so that a present writer of the upload learns of the checksum */
    if (s != STATUS_OK) return s;
    pthread_mutex_lock(&u->lock);
    if (u->row.state == FILE_UPLOADING && u->row.sha256[0] == '\0') {
        snprintf(u->row.sha256, sizeof u->row.sha256, "%s", sha256);
        s = store_file_update(set->store, &u->row, err);
        if (s != STATUS_OK) u->row.sha256[0] = '\0';
    } else if (strcmp(u->row.sha256, sha256) != 0)
        s = error_set_field(err, STATUS_EXISTS, "name", "file '%s' was declared differently; delete it first",
                            u->row.name);
    *row = u->row;
    pthread_mutex_unlock(&u->lock);
    upload_release(set, u);
    return s;
}

void upload_refresh(struct upload_set *set, struct file_row *row)
{
    pthread_mutex_lock(&set->lock);
    struct upload *u = find(set, row->id);
    if (u != NULL && row->state == FILE_UPLOADING) row->offset_bytes = atomic_load(&u->offset_seen);
    pthread_mutex_unlock(&set->lock);
}

uint64_t upload_bytes_total(const struct upload_set *set) { return atomic_load(&set->n_bytes_total); }

static status recover_one(struct upload_set *set, struct file_row *row, struct error *err)
{
    char part[PATH_BYTES], input[PATH_BYTES];
    struct stat st;
    bool verified = row->state == FILE_VERIFIED;
    status s = verified ? move_to_place(set, row, err) : STATUS_OK;
    part_path(set, row, part);
    input_path(set, row, input);
    if (verified && s == STATUS_OK) return s;
    /* only an upload whose bytes are missing starts again: a new empty file could later replace an existing one with
     * zeros */
    if (stat(part, &st) == 0) return s;
    if (errno != ENOENT) return error_set_errno(err, "cannot examine its upload");
    if (verified && (stat(input, &st) == 0 || errno != ENOENT)) return s;
    log_warning(set->log, "file '%s' of job %s has lost its bytes and must be sent again", row->name, row->job_id);
    s = upload_reserve(set, row, err);
    if (s == STATUS_OK) s = store_file_update(set->store, row, err);
    return s;
}

status upload_recover(struct upload_set *set, struct error *err)
{
    struct file_row *row = NULL;
    size_t n = 0;
    status s = store_file_list(set->store, NULL, &row, &n, err);
    for (size_t i = 0; s == STATUS_OK && i < n; i++) {
        struct error why = {0};
        if (recover_one(set, &row[i], &why) != STATUS_OK)
            log_warning(set->log, "file '%s' of job %s: %s", row[i].name, row[i].job_id, why.text);
    }
    free(row);
    return s;
}
