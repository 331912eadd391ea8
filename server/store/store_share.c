#include "server/store/store_share.h"
#include "server/store/store_rows.h"

#include <stdlib.h>
#include <string.h>

#define COLUMNS "s.serial, s.id, s.job_id, s.made_by, s.created, s.expires, s.revoked"

static void read_row(struct store_query *q, struct share_row *row)
{
    memset(row, 0, sizeof *row);
    row->serial = store_int64(q, 0);
    store_text(q, 1, row->id, sizeof row->id);
    store_text(q, 2, row->job_id, sizeof row->job_id);
    store_text(q, 3, row->made_by, sizeof row->made_by);
    row->created_unix_s = store_real(q, 4);
    row->expires_unix_s = store_real(q, 5);
    row->revoked_unix_s = store_real(q, 6);
}

status store_share_insert(struct store *store, struct share_row *r, struct error *err)
{
    pthread_mutex_lock(&store->write.lock);
    status s = store_run_serial(&store->write, &r->serial, err,
                                "INSERT INTO share (id, job_id, made_by, hash, created, expires, revoked) "
                                "VALUES (?,?,?,?,?,?,0) RETURNING serial",
                                "sssbdd", r->id, r->job_id, r->made_by, r->hash, (int)STORE_SECRET_HASH_BYTES,
                                r->created_unix_s, r->expires_unix_s);
    pthread_mutex_unlock(&store->write.lock);
    return s;
}

status store_share_find(struct store *store, const unsigned char *hash, double now_unix_s, struct share_row *row,
                        struct error *err)
{
    struct store_query *q = NULL;
    pthread_mutex_lock(&store->read.lock);
    status s = store_prepare(&store->read, &q, err,
                             "SELECT " COLUMNS " FROM share s JOIN job j ON j.id = s.job_id WHERE s.hash = ? AND "
                             "s.expires > ? AND s.revoked = 0 AND j.deleted = 0",
                             "bd", hash, (int)STORE_SECRET_HASH_BYTES, now_unix_s);
    if (s == STATUS_OK) {
        const enum store_step step = store_step(q);
        if (step == STORE_ROW)
            read_row(q, row);
        else
            s = step == STORE_DONE ? error_set(err, STATUS_NOT_FOUND, "the link is unknown, has ended or was revoked")
                                   : store_error(&store->read, "cannot look up a link", err);
    }
    store_finish(q);
    pthread_mutex_unlock(&store->read.lock);
    return s;
}

status store_share_list(struct store *store, const char *job_id, size_t most, struct share_row **out, size_t *n_out,
                        struct error *err)
{
    struct store_query *q = NULL;
    size_t n = 0;
    enum store_step rc = STORE_DONE;
    struct share_row *row = calloc(most, sizeof *row);
    if (row == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot list links: out of memory");
    pthread_mutex_lock(&store->read.lock);
    status s = store_prepare(&store->read, &q, err,
                             "SELECT " COLUMNS " FROM share s WHERE s.job_id = ? ORDER BY s.serial DESC LIMIT ?", "si",
                             job_id, (int64_t)most);
    while (s == STATUS_OK && n < most && (rc = store_step(q)) == STORE_ROW) read_row(q, &row[n++]);
    if (s == STATUS_OK && rc != STORE_DONE && rc != STORE_ROW) s = store_error(&store->read, "cannot list links", err);
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

status store_share_revoke(struct store *store, const char *job_id, const char *id, double now_unix_s, struct error *err)
{
    int n = 0;
    pthread_mutex_lock(&store->write.lock);
    status s = store_run(&store->write, &n, err,
                         "UPDATE share SET revoked = CASE revoked WHEN 0 THEN ? ELSE revoked END WHERE id = ? AND "
                         "job_id = ?",
                         "dss", now_unix_s, id, job_id);
    pthread_mutex_unlock(&store->write.lock);
    if (s == STATUS_OK && n == 0) s = error_set(err, STATUS_NOT_FOUND, "the job has no such link");
    return s;
}
