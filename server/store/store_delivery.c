#include "server/store/store_delivery.h"
#include "server/store/store_rows.h"

#include <stdlib.h>
#include <string.h>

#define COLUMNS                                                                                                        \
    "serial, id, job_id, sample, job_state, attempt, error_code, error_field, error_text, created, state, tries, "     \
    "next, status, error, delivered, verdict"

static void read_row(struct store_query *q, struct delivery_row *row)
{
    memset(row, 0, sizeof *row);
    row->serial = store_int64(q, 0);
    store_text(q, 1, row->id, sizeof row->id);
    store_text(q, 2, row->job_id, sizeof row->job_id);
    store_text(q, 3, row->sample, sizeof row->sample);
    row->job_state = (enum job_state)(int)store_int64(q, 4);
    row->attempt = store_int64(q, 5);
    store_text(q, 6, row->error_code, sizeof row->error_code);
    store_text(q, 7, row->error_field, sizeof row->error_field);
    store_text(q, 8, row->error_text, sizeof row->error_text);
    row->created_unix_s = store_real(q, 9);
    row->state = (enum delivery_state)(int)store_int64(q, 10);
    row->n_try = store_int64(q, 11);
    row->next_unix_s = store_real(q, 12);
    row->http_status = store_int64(q, 13);
    store_text(q, 14, row->error, sizeof row->error);
    row->delivered_unix_s = store_real(q, 15);
    store_text(q, 16, row->verdict, sizeof row->verdict);
}

/* One statement that changes something, under the lock. */
#define CHANGE(store, err, ...)                                                                                        \
    do {                                                                                                               \
        pthread_mutex_lock(&(store)->write.lock);                                                                      \
        status changed_ = store_run(&(store)->write, NULL, err, __VA_ARGS__);                                          \
        pthread_mutex_unlock(&(store)->write.lock);                                                                    \
        return changed_;                                                                                               \
    } while (0)

status store_webhook_enable(struct store *store, bool enabled, struct error *err)
{
    struct store_link *w = &store->write;
    if (enabled) CHANGE(store, err, "INSERT INTO webhook (one) VALUES (1) ON CONFLICT DO NOTHING", "");
    pthread_mutex_lock(&w->lock);
    status s = store_begin(w, err);
    if (s == STATUS_OK) {
        s = store_run(w, NULL, err, "UPDATE delivery SET state=?, error='the webhook was switched off' WHERE state=?",
                      "ii", (int64_t)DELIVERY_FAILED, (int64_t)DELIVERY_WAITING);
        if (s == STATUS_OK) s = store_run(w, NULL, err, "DELETE FROM webhook", "");
        s = store_end(w, s, err);
    }
    pthread_mutex_unlock(&w->lock);
    return s;
}

status store_delivery_update(struct store *store, const struct delivery_row *r, struct error *err)
{
    CHANGE(store, err, "UPDATE delivery SET state=?, tries=?, next=?, status=?, error=?, delivered=? WHERE serial=?",
           "iidisdi", (int64_t)r->state, r->n_try, r->next_unix_s, r->http_status, r->error, r->delivered_unix_s,
           r->serial);
}

status store_delivery_prune(struct store *store, int64_t most, struct error *err)
{
    CHANGE(store, err,
           "DELETE FROM delivery WHERE state <> 0 AND serial <= (SELECT serial FROM delivery ORDER BY serial DESC "
           "LIMIT 1 OFFSET ?)",
           "i", most);
}

status store_delivery_next(struct store *store, struct delivery_row *row, struct error *err)
{
    struct store_query *q = NULL;
    memset(row, 0, sizeof *row);
    pthread_mutex_lock(&store->read.lock);
    status s = store_prepare(&store->read, &q, err,
                             "SELECT " COLUMNS " FROM delivery WHERE state = 0 ORDER BY next, serial LIMIT 1", "");
    if (s != STATUS_OK) goto out;
    enum store_step rc = store_step(q);
    if (rc == STORE_ROW)
        read_row(q, row);
    else
        s = rc == STORE_DONE ? error_set(err, STATUS_NOT_FOUND, "no delivery waits")
                             : store_error(&store->read, "cannot read deliveries", err);
out:
    store_finish(q);
    pthread_mutex_unlock(&store->read.lock);
    return s;
}

status store_delivery_list(struct store *store, const char *owner, const char *job_id, int64_t before, size_t limit,
                           struct delivery_row **out, size_t *n_out, struct error *err)
{
#define WANTED "SELECT " COLUMNS " FROM delivery WHERE serial < ?1 "
#define NEWEST " ORDER BY serial DESC LIMIT ?2"
    /* one statement for each index, as for jobs; the deliveries of a job are few */
    static const char *const sql[2][2] = {
        {WANTED "AND ?3 = '' AND ?4 = ''" NEWEST, WANTED "AND ?3 = '' AND owner = ?4" NEWEST},
        {WANTED "AND job_id = ?3 AND ?4 = ''" NEWEST, WANTED "AND job_id = ?3 AND owner || '' = ?4" NEWEST}};
#undef WANTED
#undef NEWEST
    struct store_query *q = NULL;
    size_t n = 0;
    enum store_step rc = STORE_DONE;
    struct delivery_row *row = calloc(limit, sizeof *row);
    if (row == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot list deliveries: out of memory");
    if (before <= 0) before = INT64_MAX;
    pthread_mutex_lock(&store->read.lock);
    status s = store_prepare(&store->read, &q, err, sql[job_id != NULL][owner != NULL], "iiss", before, (int64_t)limit,
                             job_id == NULL ? "" : job_id, owner == NULL ? "" : owner);
    while (s == STATUS_OK && n < limit && (rc = store_step(q)) == STORE_ROW) read_row(q, &row[n++]);
    if (s == STATUS_OK && rc != STORE_DONE && rc != STORE_ROW)
        s = store_error(&store->read, "cannot list deliveries", err);
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
