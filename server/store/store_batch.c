#include "server/store/store_batch.h"
#include "base/clock.h"
#include "server/store/store_rows.h"

#include <stdlib.h>
#include <string.h>

#define COLUMNS(texts) "SELECT serial, id, owner, name, created, updated, " texts " FROM batch "

void batch_row_release(struct batch_row *row)
{
    free(row->template_text);
    row->template_text = NULL;
}

void batch_rows_free(struct batch_row *row, size_t n)
{
    for (size_t i = 0; row != NULL && i < n; i++) batch_row_release(&row[i]);
    free(row);
}

static status copy_text(struct store_query *q, int column, char **out, struct error *err)
{
    const char *text = store_column_text(q, column);
    *out = text == NULL ? NULL : strdup(text);
    return text != NULL && *out == NULL ? error_set(err, STATUS_NO_MEMORY, "cannot read batch: out of memory")
                                        : STATUS_OK;
}

static status read_row(struct store_query *q, struct batch_row *row, struct error *err)
{
    memset(row, 0, sizeof *row);
    row->serial = store_int64(q, 0);
    store_text(q, 1, row->id, sizeof row->id);
    store_text(q, 2, row->owner, sizeof row->owner);
    store_text(q, 3, row->name, sizeof row->name);
    row->created_unix_s = store_real(q, 4);
    row->updated_unix_s = store_real(q, 5);
    return copy_text(q, 6, &row->template_text, err);
}

static status write_batch(struct store *store, struct batch_row *b, struct error *err)
{
    int n = 0;
    b->updated_unix_s = clock_wall_s();
    status s = store_run(&store->write, &n, err, "UPDATE batch SET template = ?, updated = ? WHERE id = ?", "sds",
                         b->template_text, b->updated_unix_s, b->id);
    if (s != STATUS_OK || n > 0) return s;
    b->created_unix_s = b->updated_unix_s;
    return store_run_serial(&store->write, &b->serial, err,
                            "INSERT INTO batch (id, owner, name, template, created, updated) VALUES (?,?,?,?,?,?) "
                            "RETURNING serial",
                            "ssssdd", b->id, b->owner, b->name, b->template_text, b->created_unix_s, b->updated_unix_s);
}

/* A new job of a batch, a draft: the columns that store_job_add and store_job_write would write, by one statement. */
static status add_job(struct store *store, struct job_row *r, struct error *err)
{
    r->updated_unix_s = r->created_unix_s;
    status s = store_run_serial(
        &store->write, &r->serial, err,
        "INSERT INTO job (id, sample, state, cancel_requested, dirty, deleted, attempt, lost_attempts, generation, "
        "token, created, updated, queued, started, finished, error_code, error_field, error_text, peak_rss, owner, "
        "batch, batch_place) VALUES (?,?,?,0,0,0,0,0,0,'',?,?,0,0,0,'','','',0,?,?,?) RETURNING serial",
        "ssiddssi", r->id, r->sample, (int64_t)r->state, r->created_unix_s, r->updated_unix_s, r->owner, r->batch,
        r->batch_place);
    return s != STATUS_OK ? s
                          : store_run(&store->write, NULL, err, "INSERT INTO document (job_id, text) VALUES (?,?)",
                                      "ss", r->id, r->document);
}

static status write_all(struct store *store, struct batch_row *batch, struct job_row *new_job, size_t n_new,
                        struct job_row *old_job, size_t n_old, struct error *err)
{
    status s = store_begin(&store->write, err);
    if (s != STATUS_OK) return s;
    s = write_batch(store, batch, err);
    for (size_t i = 0; s == STATUS_OK && i < n_new; i++) s = add_job(store, &new_job[i], err);
    for (size_t i = 0; s == STATUS_OK && i < n_old; i++) s = store_job_write(store, &old_job[i], err);
    return store_end(&store->write, s, err);
}

static status report(struct store *store, status s, const struct job_row *job, size_t n)
{
    for (size_t i = 0; i < n; i++) store_report(store, s, job[i].id);
    return s;
}

status store_batch_write(struct store *store, struct batch_row *batch, struct job_row *new_job, size_t n_new,
                         struct job_row *old_job, size_t n_old, struct error *err)
{
    pthread_mutex_lock(&store->write.lock);
    status s = write_all(store, batch, new_job, n_new, old_job, n_old, err);
    pthread_mutex_unlock(&store->write.lock);
    report(store, s, new_job, n_new);
    return report(store, s, old_job, n_old);
}

static status erase(struct store *store, const char *id, struct job_row *job, size_t n, struct error *err)
{
    status s = store_begin(&store->write, err);
    if (s != STATUS_OK) return s;
    for (size_t i = 0; s == STATUS_OK && i < n; i++) s = store_job_write(store, &job[i], err);
    /* tombstones keep no batch, so that nothing of it is left */
    if (s == STATUS_OK) s = store_run(&store->write, NULL, err, "UPDATE job SET batch = '' WHERE batch = ?", "s", id);
    if (s == STATUS_OK) s = store_run(&store->write, NULL, err, "DELETE FROM turn WHERE batch = ?", "s", id);
    if (s == STATUS_OK) s = store_run(&store->write, NULL, err, "DELETE FROM batch WHERE id = ?", "s", id);
    return store_end(&store->write, s, err);
}

status store_batch_erase(struct store *store, const char *id, struct job_row *job, size_t n, struct error *err)
{
    pthread_mutex_lock(&store->write.lock);
    status s = erase(store, id, job, n, err);
    pthread_mutex_unlock(&store->write.lock);
    return report(store, s, job, n);
}

/* Takes the only row of a query that was prepared with status s, and finalizes it. */
static status one_row(struct store *store, status s, struct store_query *q, const char *what, struct batch_row *row,
                      struct error *err)
{
    enum store_step rc = s == STATUS_OK ? store_step(q) : STORE_DONE;
    memset(row, 0, sizeof *row);
    if (s == STATUS_OK && rc == STORE_ROW)
        s = read_row(q, row, err);
    else if (s == STATUS_OK)
        s = rc == STORE_DONE ? error_set(err, STATUS_NOT_FOUND, "batch '%.255s' does not exist", what)
                             : store_error(&store->read, "cannot read batch", err);
    store_finish(q);
    if (s != STATUS_OK) batch_row_release(row);
    return s;
}

status store_batch_get(struct store *store, const char *id, struct batch_row *row, struct error *err)
{
    struct store_query *q = NULL;
    pthread_mutex_lock(&store->read.lock);
    status s = store_prepare(&store->read, &q, err, COLUMNS("template") "WHERE id = ?", "s", id);
    s = one_row(store, s, q, id, row, err);
    pthread_mutex_unlock(&store->read.lock);
    return s;
}

status store_batch_find(struct store *store, const char *owner, const char *name, struct batch_row *row,
                        struct error *err)
{
    struct store_query *q = NULL;
    pthread_mutex_lock(&store->read.lock);
    status s =
        store_prepare(&store->read, &q, err, COLUMNS("template") "WHERE owner = ? AND name = ?", "ss", owner, name);
    s = one_row(store, s, q, name, row, err);
    pthread_mutex_unlock(&store->read.lock);
    return s;
}

status store_batch_list(struct store *store, const char *owner, int64_t before_serial, size_t limit,
                        struct batch_row **out, size_t *n_out, struct error *err)
{
    struct store_query *q = NULL;
    struct batch_row *row = calloc(limit, sizeof *row);
    size_t n = 0;
    enum store_step rc = STORE_DONE;
    if (row == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot list batches: out of memory");
    pthread_mutex_lock(&store->read.lock);
    status s = store_prepare(&store->read, &q, err,
                             COLUMNS("NULL") "WHERE (?1 = 0 OR serial < ?1) AND (?2 IS NULL OR owner = ?2) "
                                             "ORDER BY serial DESC LIMIT ?3",
                             "isi", before_serial, owner, (int64_t)limit);
    while (s == STATUS_OK && n < limit && (rc = store_step(q)) == STORE_ROW) {
        s = read_row(q, &row[n], err);
        if (s == STATUS_OK) n++;
    }
    if (s == STATUS_OK && rc != STORE_DONE && rc != STORE_ROW)
        s = store_error(&store->read, "cannot list batches", err);
    store_finish(q);
    pthread_mutex_unlock(&store->read.lock);
    if (s != STATUS_OK) {
        batch_rows_free(row, n);
        return s;
    }
    *out = row;
    *n_out = n;
    return STATUS_OK;
}

status store_batch_count(struct store *store, const char *id, int64_t n[JOB_N_STATE], struct error *err)
{
    struct store_query *q = NULL;
    enum store_step rc = STORE_DONE;
    for (int i = 0; i < JOB_N_STATE; i++) n[i] = 0;
    pthread_mutex_lock(&store->read.lock);
    status s = store_prepare(&store->read, &q, err,
                             "SELECT state, count(*) FROM job WHERE batch = ? AND batch <> '' AND deleted = 0 GROUP BY "
                             "state",
                             "s", id);
    while (s == STATUS_OK && (rc = store_step(q)) == STORE_ROW) {
        int state = (int)store_int64(q, 0);
        if (state >= 0 && state < JOB_N_STATE) n[state] = store_int64(q, 1);
    }
    if (s == STATUS_OK && rc != STORE_DONE) s = store_error(&store->read, "cannot count the jobs of a batch", err);
    store_finish(q);
    pthread_mutex_unlock(&store->read.lock);
    return s;
}
