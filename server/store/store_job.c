#include "base/clock.h"
#include "server/store/store_rows.h"

#include <stdlib.h>
#include <string.h>

void job_row_release(struct job_row *row)
{
    free(row->document);
    row->document = NULL;
}

void job_rows_free(struct job_row *row, size_t n)
{
    for (size_t i = 0; row != NULL && i < n; i++) job_row_release(&row[i]);
    free(row);
}

status store_job_read(struct store_query *q, struct job_row *row, struct error *err)
{
    memset(row, 0, sizeof *row);
    row->serial = store_int64(q, 0);
    store_text(q, 1, row->id, sizeof row->id);
    store_text(q, 2, row->sample, sizeof row->sample);
    const char *document = store_column_text(q, 3);
    if (document != NULL) row->document = strdup(document);
    if (row->document == NULL && !store_is_null(q, 3))
        return error_set(err, STATUS_NO_MEMORY, "cannot read job: out of memory");
    row->revision = store_int64(q, 4);
    row->state = (enum job_state)(int)store_int64(q, 5);
    row->cancel_requested = (int)store_int64(q, 6) != 0;
    row->dirty = (int)store_int64(q, 7) != 0;
    row->deleted = (int)store_int64(q, 8) != 0;
    row->attempt = store_int64(q, 9);
    row->lost_attempts = store_int64(q, 10);
    row->generation = store_int64(q, 11);
    store_text(q, 12, row->token, sizeof row->token);
    row->created_unix_s = store_real(q, 13);
    row->updated_unix_s = store_real(q, 14);
    row->queued_unix_s = store_real(q, 15);
    row->started_unix_s = store_real(q, 16);
    row->finished_unix_s = store_real(q, 17);
    store_text(q, 18, row->error_code, sizeof row->error_code);
    store_text(q, 19, row->error_field, sizeof row->error_field);
    store_text(q, 20, row->error_text, sizeof row->error_text);
    row->peak_rss_bytes = store_int64(q, 21);
    store_text(q, 22, row->owner, sizeof row->owner);
    row->priority = store_int64(q, 23);
    store_text(q, 24, row->tags, sizeof row->tags);
    store_text(q, 25, row->verdict, sizeof row->verdict);
    store_text(q, 26, row->batch, sizeof row->batch);
    row->batch_place = store_int64(q, 27);
    store_text(q, 28, row->batch_name, sizeof row->batch_name);
    return STATUS_OK;
}

status store_job_add(struct store *store, struct job_row *r, const char *key, const char *body_hash, struct error *err)
{
    status s = store_run_serial(
        &store->write, &r->serial, err,
        "INSERT INTO job (id, sample, state, cancel_requested, dirty, deleted, attempt, "
        "lost_attempts, generation, token, created, "
        "updated, queued, started, finished, error_code, error_field, error_text, peak_rss, owner) VALUES "
        "(?,?,?,0,0,0,0,0,0,'',?,?,0,0,0,'','','',0,?) RETURNING serial",
        "ssidds", r->id, r->sample, (int64_t)r->state, r->created_unix_s, r->created_unix_s, r->owner);
    if (s == STATUS_OK)
        s = store_run(&store->write, NULL, err, "INSERT INTO document (job_id, text) VALUES (?,?)", "ss", r->id,
                      r->document);
    if (s == STATUS_OK && key != NULL)
        s = store_run(&store->write, NULL, err, STORE_KEY_WRITE, "ssssd", r->owner, key, r->id, body_hash,
                      r->created_unix_s);
    return s;
}

static status insert(struct store *store, struct job_row *r, const char *key, const char *body_hash, struct error *err)
{
    status s = store_begin(&store->write, err);
    if (s != STATUS_OK) return s;
    return store_end(&store->write, store_job_add(store, r, key, body_hash, err), err);
}

status store_job_insert(struct store *store, struct job_row *row, const char *idempotency_key, const char *body_hash,
                        struct error *err)
{
    pthread_mutex_lock(&store->write.lock);
    status s = insert(store, row, idempotency_key, body_hash, err);
    pthread_mutex_unlock(&store->write.lock);
    return store_report(store, s, row->id);
}

status store_idempotency_find(struct store *store, const char *owner, const char *key, char job_id[STORE_ID_BYTES],
                              char body_hash[STORE_HASH_TEXT_BYTES], struct error *err)
{
    struct store_query *q = NULL;
    pthread_mutex_lock(&store->read.lock);
    status s = store_prepare(&store->read, &q, err,
                             "SELECT i.job_id, i.body_hash FROM idempotency i JOIN job j ON j.id = i.job_id WHERE "
                             "i.owner = ? AND i.key = ? AND j.deleted = 0",
                             "ss", owner, key);
    if (s != STATUS_OK) goto out;
    enum store_step rc = store_step(q);
    if (rc == STORE_ROW) {
        store_text(q, 0, job_id, STORE_ID_BYTES);
        store_text(q, 1, body_hash, STORE_HASH_TEXT_BYTES);
    } else
        s = rc == STORE_DONE ? error_set(err, STATUS_NOT_FOUND, "key is new")
                             : store_error(&store->read, "cannot look up a key", err);
out:
    store_finish(q);
    pthread_mutex_unlock(&store->read.lock);
    return s;
}

static status get(struct store *store, const char *sql, const char *id, struct job_row *row, struct error *err)
{
    struct store_query *q = NULL;
    memset(row, 0, sizeof *row);
    pthread_mutex_lock(&store->read.lock);
    status s = store_prepare(&store->read, &q, err, sql, "s", id);
    if (s != STATUS_OK) goto out;
    enum store_step rc = store_step(q);
    if (rc == STORE_ROW)
        s = store_job_read(q, row, err);
    else
        s = rc == STORE_DONE ? error_set(err, STATUS_NOT_FOUND, "job '%.40s' does not exist", id)
                             : store_error(&store->read, "cannot read job", err);
out:
    store_finish(q);
    pthread_mutex_unlock(&store->read.lock);
    return s;
}

status store_job_get(struct store *store, const char *id, struct job_row *row, struct error *err)
{
    return get(store, "SELECT " JOB_COLUMNS(JOB_DOCUMENT) " FROM job WHERE id = ?", id, row, err);
}

status store_job_look(struct store *store, const char *id, struct job_row *row, struct error *err)
{
    return get(store, "SELECT " JOB_COLUMNS("NULL") " FROM job WHERE id = ?", id, row, err);
}

status store_job_write(struct store *store, struct job_row *r, struct error *err)
{
    int n = 0;
    r->updated_unix_s = clock_wall_s();
    status s = store_run(
        &store->write, &n, err,
        "UPDATE job SET revision=revision+1, sample=?, state=?, cancel_requested=?, dirty=?, "
        "deleted=?, attempt=?, lost_attempts=?, generation=?, token=?, updated=?, queued=?, started=?, "
        "finished=?, error_code=?, error_field=?, error_text=?, peak_rss=?, priority=?, tags=?, verdict=?, batch=?, "
        "batch_place=? WHERE id=?",
        "siiiiiiisddddsssiisssis", r->sample, (int64_t)r->state, (int64_t)r->cancel_requested, (int64_t)r->dirty,
        (int64_t)r->deleted, r->attempt, r->lost_attempts, r->generation, r->token, r->updated_unix_s, r->queued_unix_s,
        r->started_unix_s, r->finished_unix_s, r->error_code, r->error_field, r->error_text, r->peak_rss_bytes,
        r->priority, r->tags, r->verdict, r->batch, r->batch_place, r->id);
    if (s == STATUS_OK && n == 0) s = error_set(err, STATUS_NOT_FOUND, "job '%.40s' does not exist", r->id);
    return s;
}

status store_job_update(struct store *store, struct job_row *row, struct error *err)
{
    pthread_mutex_lock(&store->write.lock);
    status s = store_job_write(store, row, err);
    pthread_mutex_unlock(&store->write.lock);
    return store_report(store, s, row->id);
}

status store_jobs_update(struct store *store, struct job_row *row, size_t n, struct error *err)
{
    if (n == 0) return STATUS_OK;
    pthread_mutex_lock(&store->write.lock);
    status s = store_begin(&store->write, err);
    if (s == STATUS_OK) {
        for (size_t i = 0; s == STATUS_OK && i < n; i++) s = store_job_write(store, &row[i], err);
        s = store_end(&store->write, s, err);
    }
    pthread_mutex_unlock(&store->write.lock);
    for (size_t i = 0; i < n; i++) store_report(store, s, row[i].id);
    return s;
}

static status replace(struct store *store, struct job_row *row, struct error *err)
{
    status s = store_begin(&store->write, err);
    if (s != STATUS_OK) return s;
    s = store_job_write(store, row, err);
    if (s == STATUS_OK)
        s = store_run(&store->write, NULL, err, "UPDATE document SET text = ? WHERE job_id = ?", "ss", row->document,
                      row->id);
    return store_end(&store->write, s, err);
}

status store_job_replace(struct store *store, struct job_row *row, struct error *err)
{
    pthread_mutex_lock(&store->write.lock);
    status s = replace(store, row, err);
    pthread_mutex_unlock(&store->write.lock);
    return store_report(store, s, row->id);
}

static status erase(struct store *store, const char *id, struct error *err)
{
    status s = store_begin(&store->write, err);
    if (s != STATUS_OK) return s;
    s = store_run(&store->write, NULL, err, "DELETE FROM file WHERE job_id = ?", "s", id);
    if (s == STATUS_OK) s = store_run(&store->write, NULL, err, "DELETE FROM idempotency WHERE job_id = ?", "s", id);
    if (s == STATUS_OK) s = store_run(&store->write, NULL, err, "DELETE FROM document WHERE job_id = ?", "s", id);
    if (s == STATUS_OK) s = store_run(&store->write, NULL, err, "DELETE FROM job WHERE id = ?", "s", id);
    return store_end(&store->write, s, err);
}

status store_job_erase(struct store *store, const char *id, struct error *err)
{
    pthread_mutex_lock(&store->write.lock);
    status s = erase(store, id, err);
    pthread_mutex_unlock(&store->write.lock);
    return store_report(store, s, id);
}

status store_job_version_bytes(struct store *store, const char *id, int64_t n_bytes, struct error *err)
{
    pthread_mutex_lock(&store->write.lock);
    status s = store_run(&store->write, NULL, err, "UPDATE job SET version_bytes = ? WHERE id = ?", "is", n_bytes, id);
    pthread_mutex_unlock(&store->write.lock);
    return s;
}
