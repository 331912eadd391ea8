#include "server/store/store_rows.h"

#include <stdlib.h>
#include <string.h>

#define COLUMNS "id, job_id, name, role, size, \"offset\", sha256, state, hash_state"

static void read_row(struct store_query *q, struct file_row *row)
{
    memset(row, 0, sizeof *row);
    store_text(q, 0, row->id, sizeof row->id);
    store_text(q, 1, row->job_id, sizeof row->job_id);
    store_text(q, 2, row->name, sizeof row->name);
    store_text(q, 3, row->role, sizeof row->role);
    row->size_bytes = store_int64(q, 4);
    row->offset_bytes = row->stored_offset_bytes = store_int64(q, 5);
    store_text(q, 6, row->sha256, sizeof row->sha256);
    row->state = (enum file_state)(int)store_int64(q, 7);
    size_t n = 0;
    const void *blob = q->calls->blob(q, 8, &n);
    if (blob != NULL && n == STORE_HASH_STATE_BYTES) memcpy(row->hash_state, blob, STORE_HASH_STATE_BYTES);
}

status store_file_add(struct store *store, const struct file_row *row, size_t n, struct error *err)
{
    status s = STATUS_OK;
    for (size_t i = 0; s == STATUS_OK && i < n; i++) {
        const struct file_row *r = &row[i];
        s = store_run(&store->write, NULL, err, "INSERT INTO file (" COLUMNS ") VALUES (?,?,?,?,?,?,?,?,?)",
                      "ssssiisib", r->id, r->job_id, r->name, r->role, r->size_bytes, r->offset_bytes, r->sha256,
                      (int64_t)r->state, r->hash_state, (int)STORE_HASH_STATE_BYTES);
    }
    return s;
}

static status insert(struct store *store, const struct file_row *row, size_t n, struct job_row *job, struct error *err)
{
    status s = store_begin(&store->write, err);
    if (s != STATUS_OK) return s;
    s = store_file_add(store, row, n, err);
    if (s == STATUS_OK && job != NULL) s = store_job_write(store, job, err);
    return store_end(&store->write, s, err);
}

status store_file_insert(struct store *store, const struct file_row *row, size_t n, struct job_row *job,
                         struct error *err)
{
    pthread_mutex_lock(&store->write.lock);
    status s = insert(store, row, n, job, err);
    pthread_mutex_unlock(&store->write.lock);
    return store_report(store, s, row->job_id);
}

static status get_one(struct store *store, struct store_query *q, const char *what, struct file_row *row,
                      struct error *err)
{
    enum store_step rc = store_step(q);
    if (rc == STORE_ROW) {
        read_row(q, row);
        return STATUS_OK;
    }
    return rc == STORE_DONE ? error_set(err, STATUS_NOT_FOUND, "file '%.127s' does not exist", what)
                            : store_error(&store->read, "cannot read file", err);
}

status store_file_get(struct store *store, const char *id, struct file_row *row, struct error *err)
{
    struct store_query *q = NULL;
    pthread_mutex_lock(&store->read.lock);
    status s = store_prepare(&store->read, &q, err, "SELECT " COLUMNS " FROM file WHERE id = ?", "s", id);
    if (s == STATUS_OK) s = get_one(store, q, id, row, err);
    store_finish(q);
    pthread_mutex_unlock(&store->read.lock);
    return s;
}

status store_file_find(struct store *store, const char *job_id, const char *name, struct file_row *row,
                       struct error *err)
{
    struct store_query *q = NULL;
    pthread_mutex_lock(&store->read.lock);
    status s = store_prepare(&store->read, &q, err, "SELECT " COLUMNS " FROM file WHERE job_id = ? AND name = ?", "ss",
                             job_id, name);
    if (s == STATUS_OK) s = get_one(store, q, name, row, err);
    store_finish(q);
    pthread_mutex_unlock(&store->read.lock);
    return s;
}

#define OF_OWNER                                                                                                       \
    " AND EXISTS (SELECT 1 FROM job WHERE id = file.job_id AND owner = ?3 AND deleted = 0) ORDER BY serial DESC "      \
    "LIMIT 1"

status store_file_known(struct store *store, const char *owner, const char *sha256, int64_t size_bytes,
                        struct file_row *row, struct error *err)
{
    struct store_query *q = NULL;
    pthread_mutex_lock(&store->read.lock);
    /* with the size the index gives the newest one first, however many jobs have these bytes */
    status s = store_prepare(&store->read, &q, err,
                             size_bytes >= 0 ? "SELECT " COLUMNS " FROM file WHERE state = 2 AND sha256 <> '' AND "
                                               "sha256 = ?1 AND size = ?2" OF_OWNER
                                             : "SELECT " COLUMNS " FROM file WHERE state = 2 AND sha256 <> '' AND "
                                               "sha256 = ?1 AND ?2 < 0" OF_OWNER,
                             "sis", sha256, size_bytes, owner);
    if (s == STATUS_OK) s = get_one(store, q, sha256, row, err);
    store_finish(q);
    pthread_mutex_unlock(&store->read.lock);
    return s;
}

status store_file_update(struct store *store, struct file_row *r, struct error *err)
{
    int n = 0;
    struct file_row there;
    pthread_mutex_lock(&store->write.lock);
    status s = store_run(&store->write, &n, err,
                         "UPDATE file SET \"offset\"=?, sha256=?, state=?, hash_state=? WHERE id=? AND \"offset\"=?",
                         "isibsi", r->offset_bytes, r->sha256, (int64_t)r->state, r->hash_state,
                         (int)STORE_HASH_STATE_BYTES, r->id, r->stored_offset_bytes);
    pthread_mutex_unlock(&store->write.lock);
    if (s == STATUS_OK && n > 0) r->stored_offset_bytes = r->offset_bytes;
    if (s == STATUS_OK && n == 0)
        s = store_file_get(store, r->id, &there, NULL) == STATUS_OK
                ? error_set(err, STATUS_STALE, "another request has taken over the upload of '%s'", r->name)
                : error_set(err, STATUS_NOT_FOUND, "file '%s' no longer exists", r->name);
    return store_report(store, s, r->job_id);
}

static status erase(struct store *store, const char *id, struct job_row *job, struct error *err)
{
    status s = store_begin(&store->write, err);
    if (s != STATUS_OK) return s;
    s = store_run(&store->write, NULL, err, "DELETE FROM file WHERE id = ?", "s", id);
    if (s == STATUS_OK && job != NULL) s = store_job_write(store, job, err);
    return store_end(&store->write, s, err);
}

status store_file_erase(struct store *store, const char *id, struct job_row *job, struct error *err)
{
    pthread_mutex_lock(&store->write.lock);
    status s = erase(store, id, job, err);
    pthread_mutex_unlock(&store->write.lock);
    return job == NULL ? s : store_report(store, s, job->id);
}

status store_file_count(struct store *store, const char *job_id, int64_t *n, struct error *err)
{
    struct store_query *q = NULL;
    pthread_mutex_lock(&store->read.lock);
    status s = store_prepare(&store->read, &q, err, "SELECT count(*) FROM file WHERE job_id = ?", "s", job_id);
    if (s == STATUS_OK && store_step(q) != STORE_ROW) s = store_error(&store->read, "cannot count files", err);
    if (s == STATUS_OK) *n = store_int64(q, 0);
    store_finish(q);
    pthread_mutex_unlock(&store->read.lock);
    return s;
}

status store_file_list(struct store *store, const char *job_id, struct file_row **out, size_t *n_out, struct error *err)
{
    struct store_query *q = NULL;
    struct file_row *row = NULL;
    size_t n = 0, capacity = 0;
    enum store_step rc = STORE_DONE;
    pthread_mutex_lock(&store->read.lock);
    status s =
        job_id != NULL
            ? store_prepare(&store->read, &q, err, "SELECT " COLUMNS " FROM file WHERE job_id = ? ORDER BY serial", "s",
                            job_id)
            : store_prepare(&store->read, &q, err, "SELECT " COLUMNS " FROM file WHERE state <> 2 ORDER BY serial", "");
    while (s == STATUS_OK && (rc = store_step(q)) == STORE_ROW) {
        if (n == capacity) {
            capacity = capacity == 0 ? 64 : capacity * 2;
            struct file_row *more = realloc(row, capacity * sizeof *more);
            if (more == NULL) {
                s = error_set(err, STATUS_NO_MEMORY, "cannot list files: out of memory");
                break;
            }
            row = more;
        }
        read_row(q, &row[n++]);
    }
    if (s == STATUS_OK && rc != STORE_DONE) s = store_error(&store->read, "cannot list files", err);
    store_finish(q);
    pthread_mutex_unlock(&store->read.lock);
    if (s != STATUS_OK) {
        free(row);
        return s;
    }
    *out = row;
    *n_out = n;
    return STATUS_OK;
}
