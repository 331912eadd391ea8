#include "server/files/upload.h"
#include "server/files/upload_file.h"
#include "server/settings/job_paths.h"

#include <errno.h>
#include <fcntl.h>
#include <pthread.h>
#include <semaphore.h>
#include <sodium.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

struct upload {
    struct upload_set *set;
    struct upload *next;
    size_t n_holder;                                 /* guarded by set->lock */
    char id[STORE_ID_BYTES], job_id[STORE_ID_BYTES]; /* never change */
    pthread_mutex_t lock; /* guards the members below except the atomic ones; held during writes and syncs */
    struct file_row row;  /* as in the database */
    int64_t offset_bytes;
    crypto_hash_sha256_state hash;
    atomic_int_least64_t offset_seen; /* copy of offset_bytes for readers without the lock */
    atomic_uint_least64_t ticket;     /* raised under the lock, and without it by a discard, which waits for no sync */
    atomic_bool discarded;
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
    /* uploads that may write and hash a piece at the same time: half of the processors, so that many uploads do not
     * keep other requests from theirs. No one waits for a sync while it has a place. */
    sem_t place;
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
    long n_processor = sysconf(_SC_NPROCESSORS_ONLN);
    sem_init(&set->place, 0, n_processor > 2 ? (unsigned)n_processor / 2 : 1);
    *out = set;
    return STATUS_OK;
}

void upload_set_free(struct upload_set *set)
{
    if (set == NULL) return;
    pthread_mutex_destroy(&set->lock);
    sem_destroy(&set->place);
    free(set);
}

static struct upload *find(struct upload_set *set, const char *id)
{
    struct upload *u = set->first;
    while (u != NULL && strcmp(u->id, id) != 0) u = u->next;
    return u;
}

/* A writer that is in the middle of a piece may finish it, into a file that no longer has a name. */
static void end_writers(struct upload *u)
{
    atomic_store(&u->discarded, true);
    atomic_fetch_add(&u->ticket, 1);
}

/* The part goes before the input: a writer that moves the one to the other meanwhile either finds no part, or has moved
 * it to where it is removed next. */
void upload_discard(struct upload_set *set, const struct file_row *row)
{
    char path[PATH_BYTES];
    pthread_mutex_lock(&set->lock);
    struct upload *u = find(set, row->id);
    if (u != NULL) end_writers(u);
    pthread_mutex_unlock(&set->lock);
    upload_part_path(set->data, row, path);
    unlink(path);
    upload_input_path(set->data, row, path);
    unlink(path);
}

void upload_discard_job(struct upload_set *set, const char *job_id)
{
    pthread_mutex_lock(&set->lock);
    for (struct upload *u = set->first; u != NULL; u = u->next) {
        if (strcmp(u->job_id, job_id) != 0) continue;
        end_writers(u);
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
        snprintf(u->id, sizeof u->id, "%s", u->row.id);
        snprintf(u->job_id, sizeof u->job_id, "%s", u->row.job_id);
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

static status start_again(struct upload *u, const char *computed, struct error *err)
{
    char declared[STORE_HASH_TEXT_BYTES];
    snprintf(declared, sizeof declared, "%s", u->row.sha256);
    upload_hash_restart(&u->row);
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
    if (s == STATUS_OK) s = upload_move_to_place(u->set->store, u->set->data, &u->row, err);
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
    if (atomic_load(&u->discarded)) return error_set(err, STATUS_NOT_FOUND, "file '%s' was removed", u->row.name);
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
    *ticket = atomic_fetch_add(&u->ticket, 1) + 1;
    status s = commit(u, err);
    *row = u->row;
    pthread_mutex_unlock(&u->lock);
    return s;
}

static status open_part(struct upload *u, struct error *err)
{
    if (u->fd >= 0) return STATUS_OK;
    char path[PATH_BYTES];
    upload_part_path(u->set->data, &u->row, path);
    u->fd = open(path, O_WRONLY | O_CLOEXEC | O_NOFOLLOW);
    return u->fd >= 0 ? STATUS_OK : error_set_errno(err, "cannot write file '%s'", u->row.name);
}

/* u->lock is held. */
static status write_piece(struct upload *u, const unsigned char *next, size_t n_bytes, struct error *err)
{
    status s = STATUS_OK;
    while (sem_wait(&u->set->place) != 0) {
    }
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
    sem_post(&u->set->place);
    return s;
}

status upload_write(struct upload *u, uint64_t ticket, const void *data, size_t n_bytes, struct error *err)
{
    status s = STATUS_OK;
    pthread_mutex_lock(&u->lock);
    if (atomic_load(&u->ticket) != ticket || atomic_load(&u->discarded))
        s = error_set(err, STATUS_STALE, "another request has taken over the upload of '%s'", u->row.name);
    else if (u->row.state != FILE_UPLOADING || (int64_t)n_bytes > u->row.size_bytes - u->offset_bytes)
        s = error_set(err, STATUS_INVALID, "file '%s' has more bytes than declared", u->row.name);
    if (s == STATUS_OK) s = open_part(u, err);
    if (s == STATUS_OK) s = write_piece(u, data, n_bytes, err);
    if (s == STATUS_OK && u->offset_bytes - u->row.offset_bytes >= u->set->commit_bytes &&
        u->offset_bytes < u->row.size_bytes)
        s = commit(u, err);
    pthread_mutex_unlock(&u->lock);
    return s;
}

status upload_commit(struct upload *u, uint64_t ticket, struct file_row *row, struct error *err)
{
    pthread_mutex_lock(&u->lock);
    status s = atomic_load(&u->ticket) != ticket
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

uint64_t upload_progress(struct upload_set *set, const char *job_id)
{
    uint64_t sum = 0;
    pthread_mutex_lock(&set->lock);
    for (const struct upload *u = set->first; u != NULL; u = u->next) {
        unsigned char text[80], hash[crypto_generichash_BYTES_MIN];
        uint64_t part;
        if (strcmp(u->job_id, job_id) != 0) continue;
        int n = snprintf((char *)text, sizeof text, "%s %lld", u->id, (long long)atomic_load(&u->offset_seen));
        crypto_generichash(hash, sizeof hash, text, (unsigned long long)n, NULL, 0);
        memcpy(&part, hash, sizeof part);
        sum += part;
    }
    pthread_mutex_unlock(&set->lock);
    return sum;
}

uint64_t upload_bytes_total(const struct upload_set *set) { return atomic_load(&set->n_bytes_total); }

static status recover_one(struct upload_set *set, struct file_row *row, struct error *err)
{
    char part[PATH_BYTES], input[PATH_BYTES];
    struct stat st;
    bool verified = row->state == FILE_VERIFIED;
    status s = verified ? upload_move_to_place(set->store, set->data, row, err) : STATUS_OK;
    upload_part_path(set->data, row, part);
    upload_input_path(set->data, row, input);
    if (verified && s == STATUS_OK) return s;
    /* only an upload whose bytes are missing starts again: a new empty file could later replace an existing one with
     * zeros */
    if (stat(part, &st) == 0) return s;
    if (errno != ENOENT) return error_set_errno(err, "cannot examine its upload");
    if (verified && (stat(input, &st) == 0 || errno != ENOENT)) return s;
    log_warning(set->log, "file '%s' of job %s has lost its bytes and must be sent again", row->name, row->job_id);
    s = upload_reserve(set->data, row, 1, err);
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
