#include "server/store/store_access.h"
#include "server/store/store_rows.h"

#include <stdlib.h>
#include <string.h>
#include <uuid/uuid.h>

#define COLUMNS "t.serial, t.id, t.name, t.owner, t.scope, t.created, t.used, t.revoked, t.requests, t.bytes, t.jobs"

static const char *const scope_name[ACCESS_N_SCOPE] = {"open", "read", "submit", "admin"};

const char *access_scope_name(enum access_scope scope) { return scope_name[scope]; }

bool access_scope_parse(const char *name, enum access_scope *scope)
{
    for (int i = ACCESS_READ; i < ACCESS_N_SCOPE; i++)
        if (strcmp(name, scope_name[i]) == 0) {
            *scope = (enum access_scope)i;
            return true;
        }
    return false;
}

static void read_row(struct store_query *q, struct token_row *row)
{
    memset(row, 0, sizeof *row);
    row->serial = store_int64(q, 0);
    store_text(q, 1, row->id, sizeof row->id);
    store_text(q, 2, row->name, sizeof row->name);
    store_text(q, 3, row->owner, sizeof row->owner);
    row->scope = (enum access_scope)(int)store_int64(q, 4);
    row->created_unix_s = store_real(q, 5);
    row->used_unix_s = store_real(q, 6);
    row->revoked_unix_s = store_real(q, 7);
    row->quota = (struct access_quota){store_int64(q, 8), store_int64(q, 9), store_int64(q, 10)};
}

/* Takes the only row of a query that was prepared with status s: STATUS_NOT_FOUND with a text when there is none.
 * Finalizes the query. */
static status one_row(struct store *store, status s, struct store_query *q,
                      void (*take)(struct store_query *q, void *out), void *out, const char *missing, struct error *err)
{
    if (s == STATUS_OK) {
        enum store_step rc = store_step(q);
        if (rc == STORE_ROW)
            take(q, out);
        else
            s = rc == STORE_DONE ? error_set(err, STATUS_NOT_FOUND, "%s", missing)
                                 : store_error(&store->read, "cannot look up who may do what", err);
    }
    store_finish(q);
    return s;
}

/* One query for one row, under the lock of the reading connection. */
#define LOOK(store, take, out, missing, err, ...)                                                                      \
    do {                                                                                                               \
        struct store_query *q_ = NULL;                                                                                 \
        pthread_mutex_lock(&(store)->read.lock);                                                                       \
        status look_ = store_prepare(&(store)->read, &q_, err, __VA_ARGS__);                                           \
        look_ = one_row(store, look_, q_, take, out, missing, err);                                                    \
        pthread_mutex_unlock(&(store)->read.lock);                                                                     \
        return look_;                                                                                                  \
    } while (0)

static void take_token(struct store_query *q, void *out) { read_row(q, out); }
static void take_bool(struct store_query *q, void *out) { *(bool *)out = (int)store_int64(q, 0) != 0; }
static void take_owner(struct store_query *q, void *out) { store_text(q, 0, out, STORE_OWNER_BYTES); }
static void take_use(struct store_query *q, void *out)
{
    *(struct owner_use *)out = (struct owner_use){store_int64(q, 0), store_int64(q, 1)};
}

status store_token_any(struct store *store, bool *any, struct error *err)
{
    LOOK(store, take_bool, any, "", err, "SELECT EXISTS (SELECT 1 FROM access_token)", "");
}

status store_token_find(struct store *store, const unsigned char *hash, bool of_session, double now_unix_s,
                        struct token_row *row, struct error *err)
{
    static const char missing[] = "the token is unknown or revoked";
    if (!of_session)
        LOOK(store, take_token, row, missing, err,
             "SELECT " COLUMNS " FROM access_token t WHERE t.hash = ? AND t.revoked = 0", "b", hash,
             (int)STORE_SECRET_HASH_BYTES);
    LOOK(store, take_token, row, "the session has ended", err,
         "SELECT " COLUMNS
         " FROM session s JOIN access_token t ON t.id = s.token_id WHERE s.hash = ? AND s.expires > ? "
         "AND t.revoked = 0",
         "bd", hash, (int)STORE_SECRET_HASH_BYTES, now_unix_s);
}

status store_token_get(struct store *store, const char *id_or_name, struct token_row *row, struct error *err)
{
    LOOK(store, take_token, row, "there is no such token", err,
         "SELECT " COLUMNS " FROM access_token t WHERE t.id = ?1 OR (t.name = ?1 AND t.revoked = 0)", "s", id_or_name);
}

status store_job_owner(struct store *store, const char *job_id, char owner[STORE_OWNER_BYTES], struct error *err)
{
    LOOK(store, take_owner, owner, "there is no such job", err, "SELECT owner FROM job WHERE id = ? AND deleted = 0",
         "s", job_id);
}

status store_batch_owner(struct store *store, const char *batch_id, char owner[STORE_OWNER_BYTES], struct error *err)
{
    LOOK(store, take_owner, owner, "there is no such batch", err, "SELECT owner FROM batch WHERE id = ?", "s",
         batch_id);
}

status store_upload_owner(struct store *store, const char *upload_id, char owner[STORE_OWNER_BYTES], struct error *err)
{
    LOOK(store, take_owner, owner, "there is no such upload", err,
         "SELECT j.owner FROM file f JOIN job j ON j.id = f.job_id WHERE f.id = ? AND j.deleted = 0", "s", upload_id);
}

status store_owner_use(struct store *store, const char *owner, struct owner_use *use, struct error *err)
{
    LOOK(store, take_use, use, "", err,
         "SELECT coalesce(sum(jobs), 0), coalesce(sum(bytes), 0) FROM owner_use WHERE owner = ?", "s", owner);
}

status store_token_insert(struct store *store, struct token_row *r, struct error *err)
{
    pthread_mutex_lock(&store->write.lock);
    status s = store_run_serial(
        &store->write, &r->serial, err,
        "INSERT INTO access_token (id, name, owner, scope, hash, created, used, revoked, requests, "
        "bytes, jobs) VALUES (?,?,?,?,?,?,0,0,?,?,?) RETURNING serial",
        "sssibdiii", r->id, r->name, r->owner, (int64_t)r->scope, r->hash, (int)STORE_SECRET_HASH_BYTES,
        r->created_unix_s, r->quota.requests_per_minute, r->quota.stored_bytes, r->quota.jobs);
    if (s == STATUS_EXISTS)
        s = error_set_field(err, STATUS_EXISTS, "name", "a token named '%s' exists; revoke it first", r->name);
    pthread_mutex_unlock(&store->write.lock);
    return s;
}

status store_token_revoke(struct store *store, const char *id, double now_unix_s, struct error *err)
{
    int n = 0;
    pthread_mutex_lock(&store->write.lock);
    status s = store_begin(&store->write, err);
    if (s == STATUS_OK) {
        s = store_run(&store->write, &n, err,
                      "UPDATE access_token SET revoked = CASE revoked WHEN 0 THEN ? ELSE revoked END WHERE id = ?",
                      "ds", now_unix_s, id);
        if (s == STATUS_OK && n == 0) s = error_set(err, STATUS_NOT_FOUND, "there is no such token");
        if (s == STATUS_OK) s = store_run(&store->write, NULL, err, "DELETE FROM session WHERE token_id = ?", "s", id);
        s = store_end(&store->write, s, err);
    }
    pthread_mutex_unlock(&store->write.lock);
    return s;
}

status store_token_used(struct store *store, const struct token_row *row, size_t n, struct error *err)
{
    pthread_mutex_lock(&store->write.lock);
    status s = store_begin(&store->write, err);
    if (s == STATUS_OK) {
        for (size_t i = 0; s == STATUS_OK && i < n; i++)
            s = store_run(&store->write, NULL, err, "UPDATE access_token SET used = ?1 WHERE id = ?2 AND used < ?1",
                          "ds", row[i].used_unix_s, row[i].id);
        s = store_end(&store->write, s, err);
    }
    pthread_mutex_unlock(&store->write.lock);
    return s;
}

status store_token_list(struct store *store, int64_t before, size_t limit, struct token_row **out, size_t *n_out,
                        struct error *err)
{
    struct store_query *q = NULL;
    size_t n = 0;
    enum store_step rc = STORE_DONE;
    struct token_row *row = calloc(limit, sizeof *row);
    if (row == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot list tokens: out of memory");
    pthread_mutex_lock(&store->read.lock);
    status s = store_prepare(&store->read, &q, err,
                             "SELECT " COLUMNS " FROM access_token t WHERE serial < ? ORDER BY serial DESC LIMIT ?",
                             "ii", before > 0 ? before : INT64_MAX, (int64_t)limit);
    while (s == STATUS_OK && n < limit && (rc = store_step(q)) == STORE_ROW) read_row(q, &row[n++]);
    if (s == STATUS_OK && rc != STORE_DONE && rc != STORE_ROW) s = store_error(&store->read, "cannot list tokens", err);
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

status store_session_insert(struct store *store, const unsigned char *hash, const char *token_id, double now_unix_s,
                            double expires_unix_s, struct error *err)
{
    pthread_mutex_lock(&store->write.lock);
    status s = store_begin(&store->write, err);
    if (s == STATUS_OK) {
        s = store_run(&store->write, NULL, err, "DELETE FROM session WHERE expires <= ?", "d", now_unix_s);
        if (s == STATUS_OK)
            s = store_run(&store->write, NULL, err, "INSERT INTO session (hash, token_id, expires) VALUES (?,?,?)",
                          "bsd", hash, (int)STORE_SECRET_HASH_BYTES, token_id, expires_unix_s);
        s = store_end(&store->write, s, err);
    }
    pthread_mutex_unlock(&store->write.lock);
    return s;
}

status store_access_rebuilt(struct store *store, bool require, double now_unix_s, struct error *err)
{
    pthread_mutex_lock(&store->write.lock);
    status s = store_run(&store->write, NULL, err, "DELETE FROM session", "");
    /* a revoked token with the hash of no text says that tokens were once made */
    if (s == STATUS_OK && require) {
        char id[STORE_ID_BYTES];
        uuid_t u;
        uuid_generate_random(u);
        uuid_unparse_lower(u, id);
        s = store_run(
            &store->write, NULL, err,
            "INSERT INTO access_token (id, name, owner, scope, hash, created, used, revoked, requests, bytes, "
            "jobs) VALUES (?, 'lost', 'lost', ?, ?, ?, 0, ?, -1, -1, -1)",
            "sibdd", id, (int64_t)ACCESS_READ, "", 1, now_unix_s, now_unix_s);
    }
    pthread_mutex_unlock(&store->write.lock);
    return s;
}

status store_session_erase(struct store *store, const unsigned char *hash, struct error *err)
{
    pthread_mutex_lock(&store->write.lock);
    status s = store_run(&store->write, NULL, err, "DELETE FROM session WHERE hash = ?", "b", hash,
                         (int)STORE_SECRET_HASH_BYTES);
    pthread_mutex_unlock(&store->write.lock);
    return s;
}
