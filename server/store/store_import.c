/* Writes jobs that were read from their folders. */
#include "base/clock.h"
#include "server/store/store_rows.h"

#include <stdio.h>
#include <string.h>

/* Makes the row of a job that the database does not have, with its document and its key. */
static status add(struct store *store, struct job_row *row, const char *key, const char *body_hash, struct error *err)
{
    enum job_state state = row->state;
    row->state = JOB_DRAFT;
    status s = store_job_add(store, row, key, body_hash, err);
    row->state = state;
    return s;
}

/* Replaces document and key of a job that the database has. */
static status replace(struct store *store, const struct job_row *row, const char *key, const char *body_hash,
                      struct error *err)
{
    status s = store_run(
        &store->write, NULL, err,
        "INSERT INTO document (job_id, text) VALUES (?,?) ON CONFLICT (job_id) DO UPDATE SET text = excluded.text",
        "ss", row->id, row->document);
    if (s == STATUS_OK && key != NULL)
        s = store_run(&store->write, NULL, err, STORE_KEY_WRITE, "ssssd", row->owner, key, row->id, body_hash,
                      row->created_unix_s);
    if (s == STATUS_OK) s = store_run(&store->write, NULL, err, "DELETE FROM file WHERE job_id = ?", "s", row->id);
    return s;
}

/* A batch that is missing in the database is made from the journals of its jobs, without its template. A journal may
 * have been forged, so a batch of another owner is not joined. */
static status import_batch(struct store *store, struct job_row *row, struct error *err)
{
    static const char *const name[] = {"?3", "?3 || ' ' || substr(?1, 1, 8)"};
    char sql[240];
    int n = 0;
    status s = STATUS_OK;
    if (row->batch[0] == '\0') return STATUS_OK;
    for (size_t i = 0; s == STATUS_OK && i < 2; i++) { /* the second name where another batch has the first one */
        snprintf(sql, sizeof sql,
                 "INSERT INTO batch (id, owner, name, template, created, updated) SELECT ?1, ?2, %s, "
                 "'', ?4, ?4 WHERE length(?1) = 36 ON CONFLICT DO NOTHING",
                 name[i]);
        s = store_run(&store->write, NULL, err, sql, "sssd", row->batch, row->owner, row->batch_name,
                      row->created_unix_s);
    }
    if (s == STATUS_OK)
        s = store_run(&store->write, &n, err, "UPDATE batch SET updated = updated WHERE id = ? AND owner = ?", "ss",
                      row->batch, row->owner);
    if (s == STATUS_OK && n == 0) row->batch[0] = '\0';
    return s;
}

static status import(struct store *store, struct job_row *row, const struct file_row *file, size_t n_file,
                     const char *key, const char *body_hash, struct error *err)
{
    double updated_unix_s = row->updated_unix_s;
    status s = store_begin(&store->write, err);
    if (s != STATUS_OK) return s;
    if (s == STATUS_OK)
        s = row->serial > 0 ? replace(store, row, key, body_hash, err) : add(store, row, key, body_hash, err);
    if (s == STATUS_OK) s = store_file_add(store, file, n_file, err);
    if (s == STATUS_OK) s = import_batch(store, row, err);
    if (s == STATUS_OK) s = store_job_write(store, row, err);
    row->updated_unix_s = updated_unix_s;
    if (s == STATUS_OK)
        /* tags and ids of deliveries are made of the revision, so it must rise over all that clients may have seen */
        s = store_run(&store->write, NULL, err,
                      "UPDATE job SET updated = ?1, revision = CASE WHEN revision < ?2 THEN ?2 ELSE revision END "
                      "WHERE id = ?3",
                      "dis", updated_unix_s, (int64_t)clock_wall_s(), row->id);
    return store_end(&store->write, s, err);
}

status store_import(struct store *store, struct job_row *row, const struct file_row *file, size_t n_file,
                    const char *idempotency_key, const char *body_hash, struct error *err)
{
    pthread_mutex_lock(&store->write.lock);
    status s = import(store, row, file, n_file, idempotency_key, body_hash, err);
    pthread_mutex_unlock(&store->write.lock);
    return store_report(store, s, row->id);
}
