#include "server/store/store_cluster.h"
#include "server/store/store_rows.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <uuid/uuid.h>

#define NOW "extract(epoch FROM clock_timestamp())"
#define APPLICATION "selvedge/"
#define LIVES(daemon) "EXISTS (SELECT 1 FROM daemon WHERE daemon.id = " daemon ")"

bool store_is_shared(const struct store *store) { return store->driver->shared; }

void store_daemon_id(struct store *store, char id[STORE_ID_BYTES])
{
    pthread_mutex_lock(&store->name_lock);
    snprintf(id, STORE_ID_BYTES, "%s", store->daemon);
    pthread_mutex_unlock(&store->name_lock);
}

/* Runs one statement on a connection. */
#define CHANGE(link, n, err, ...)                                                                                      \
    do {                                                                                                               \
        pthread_mutex_lock(&(link)->lock);                                                                             \
        status changed_ = store_run(link, n, err, __VA_ARGS__);                                                        \
        pthread_mutex_unlock(&(link)->lock);                                                                           \
        return changed_;                                                                                               \
    } while (0)

/* Asks the connection that writes for one value; text is "" where there is none. first and second (NULL: none) are the
 * parameters. */
static status ask(struct store *store, char *text, size_t n_text, struct error *err, const char *sql, const char *first,
                  const char *second)
{
    struct store_query *q = NULL;
    pthread_mutex_lock(&store->write.lock);
    status s = store_prepare(&store->write, &q, err, sql, first == NULL ? "" : "ss", first, second);
    enum store_step step = s == STATUS_OK ? store_step(q) : STORE_DONE;
    text[0] = '\0';
    if (step == STORE_ROW) store_text(q, 0, text, n_text);
    if (step == STORE_FAILED) s = store_error(&store->write, "cannot read the database", err);
    store_finish(q);
    pthread_mutex_unlock(&store->write.lock);
    return s;
}

status store_identity(struct store *store, char id[STORE_ID_BYTES], struct error *err)
{
    return ask(store, id, STORE_ID_BYTES, err, "SELECT id FROM identity WHERE one = 1", NULL, NULL);
}

void store_server_read(const char *letters, struct store_server *server)
{
    const size_t n = strlen(letters);
    server->syncs = n > 0 && letters[0] == 't';
    server->encrypted = n > 1 && letters[1] == 't';
    server->local = n > 2 && letters[2] == 't';
}

status store_server_look(struct store *store, struct store_server *server, struct error *err)
{
    char how[8];
    *server = (struct store_server){0};
    status s = ask(store, server->version, sizeof server->version, err, "SELECT current_setting('server_version')",
                   NULL, NULL);
    if (s == STATUS_OK)
        s = ask(store, how, sizeof how, err,
                "SELECT concat(current_setting('fsync') = 'on' AND current_setting('full_page_writes') = 'on', "
                "coalesce((SELECT ssl FROM pg_stat_ssl WHERE pid = pg_backend_pid()), false), "
                "coalesce(inet_client_addr() = inet_server_addr() OR inet_client_addr() <<= '127.0.0.0/8', true))",
                NULL, NULL);
    if (s != STATUS_OK) return s;
    server->version[strcspn(server->version, " ")] = '\0';
    store_server_read(how, server);
    return STATUS_OK;
}

status store_clock(struct store *store, double *now_unix_s, struct error *err)
{
    char text[64];
    status s = ask(store, text, sizeof text, err, "SELECT " NOW, NULL, NULL);
    *now_unix_s = strtod(text, NULL);
    return s;
}

/* ---- daemons */

/* For callers that hold link->lock. The name holds for connections that are opened later too. */
static void name_locked(struct store_link *link, const char *id)
{
    snprintf(link->application, sizeof link->application, APPLICATION "%s", id);
    if (link->db != NULL)
        store_run(link, NULL, NULL, "SELECT set_config('application_name', ?, false)", "s", link->application);
}

static void name_connection(struct store_link *link, const char *id)
{
    pthread_mutex_lock(&link->lock);
    name_locked(link, id);
    pthread_mutex_unlock(&link->lock);
}

/* A row that somebody else has locked must not hold a renewal up for longer than the lease. */
static status limit_waiting(struct store_link *link, double lease_s, struct error *err)
{
    return store_run(link, NULL, err, "SELECT set_config('lock_timeout', CAST(? AS TEXT), false)", "i",
                     (int64_t)(lease_s > 0.1 ? lease_s * 500 : 50));
}

status store_daemon_begin(struct store *store, const char *host, int64_t pid, double lease_s, struct error *err)
{
    uuid_t u;
    char id[STORE_ID_BYTES];
    if (!store_is_shared(store)) return STATUS_OK;
    uuid_generate_random(u);
    uuid_unparse_lower(u, id);
    pthread_mutex_lock(&store->name_lock);
    snprintf(store->daemon, sizeof store->daemon, "%s", id);
    pthread_mutex_unlock(&store->name_lock);
    pthread_mutex_lock(&store->lease.lock);
    name_locked(&store->lease, id);
    status s = store_run(&store->lease, NULL, err,
                         "INSERT INTO daemon (id, host, pid, url, started, until) SELECT ?, ?, ?, '', " NOW ", " NOW
                         " + CAST(? AS DOUBLE PRECISION)",
                         "ssid", id, host, pid, lease_s);
    pthread_mutex_unlock(&store->lease.lock);
    if (s != STATUS_OK) return s;
    name_connection(&store->write, id);
    name_connection(&store->read, id);
    name_connection(&store->gate.link, id);
    return STATUS_OK;
}

status store_daemon_announce(struct store *store, const char *url, struct error *err)
{
    char mine[STORE_ID_BYTES];
    if (!store_is_shared(store)) return STATUS_OK;
    store_daemon_id(store, mine);
    CHANGE(&store->write, NULL, err, "UPDATE daemon SET url = ? WHERE id = ?", "ss", url, mine);
}

status store_daemon_renew(struct store *store, double lease_s, bool *held, struct error *err)
{
    int n = 0;
    char mine[STORE_ID_BYTES];
    *held = true;
    if (!store_is_shared(store)) return STATUS_OK;
    store_daemon_id(store, mine);
    pthread_mutex_lock(&store->lease.lock);
    status s = limit_waiting(&store->lease, lease_s, err);
    if (s == STATUS_OK)
        s = store_run(&store->lease, &n, err,
                      "UPDATE daemon SET until = " NOW " + CAST(? AS DOUBLE PRECISION) WHERE id = ?", "ds", lease_s,
                      mine);
    pthread_mutex_unlock(&store->lease.lock);
    if (s == STATUS_OK) *held = n > 0;
    return s;
}

status store_daemon_remove(struct store *store, const char *id, struct error *err)
{
    CHANGE(&store->lease, NULL, err, "DELETE FROM daemon WHERE id = ?", "s", id);
}

status store_daemon_end(struct store *store, struct error *err)
{
    char mine[STORE_ID_BYTES];
    store_daemon_id(store, mine);
    return store_is_shared(store) ? store_daemon_remove(store, mine, err) : STATUS_OK;
}

status store_daemons_remove(struct store *store, double grace_s, int *n_ended, struct error *err)
{
    char mine[STORE_ID_BYTES];
    *n_ended = 0;
    if (!store_is_shared(store)) return STATUS_OK;
    store_daemon_id(store, mine);
    pthread_mutex_lock(&store->lease.lock);
    status s = store_run(&store->lease, n_ended, err,
                         "DELETE FROM daemon WHERE id IN (SELECT id FROM daemon WHERE until < " NOW
                         " AND id <> ? FOR UPDATE SKIP LOCKED)",
                         "s", mine);
    if (s == STATUS_OK)
        s = store_run(&store->lease, NULL, err,
                      "SELECT pg_terminate_backend(a.pid) FROM pg_stat_activity a WHERE a.datname = current_database() "
                      "AND a.usename = current_user AND a.application_name LIKE '" APPLICATION "%' AND a.pid <> "
                      "pg_backend_pid() AND extract(epoch FROM clock_timestamp() - a.backend_start) > "
                      "CAST(? AS DOUBLE PRECISION) AND NOT EXISTS (SELECT 1 FROM daemon d WHERE a.application_name = "
                      "'" APPLICATION "' || d.id)",
                      "d", grace_s);
    pthread_mutex_unlock(&store->lease.lock);
    return s;
}

status store_daemon_list(struct store *store, struct daemon_row **out, size_t *n_out, struct error *err)
{
    enum { DAEMONS_MOST = 1000 };
    struct store_query *q = NULL;
    size_t n = 0;
    enum store_step rc = STORE_DONE;
    *out = NULL;
    *n_out = 0;
    if (!store_is_shared(store)) return STATUS_OK;
    struct daemon_row *row = calloc(DAEMONS_MOST, sizeof *row);
    if (row == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot list daemons: out of memory");
    pthread_mutex_lock(&store->read.lock);
    status s = store_prepare(&store->read, &q, err,
                             "SELECT id, host, pid, url, started, until, until < " NOW
                             " FROM daemon ORDER BY started, id LIMIT ?",
                             "i", (int64_t)DAEMONS_MOST);
    while (s == STATUS_OK && n < DAEMONS_MOST && (rc = store_step(q)) == STORE_ROW) {
        struct daemon_row *r = &row[n++];
        store_text(q, 0, r->id, sizeof r->id);
        store_text(q, 1, r->host, sizeof r->host);
        r->pid = store_int64(q, 2);
        store_text(q, 3, r->url, sizeof r->url);
        r->started_unix_s = store_real(q, 4);
        r->until_unix_s = store_real(q, 5);
        r->ended = store_int64(q, 6) != 0;
    }
    if (s == STATUS_OK && rc == STORE_FAILED) s = store_error(&store->read, "cannot list daemons", err);
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

/* ---- claims */

status store_job_claim(struct store *store, const char *id, struct error *err)
{
    int n = 0;
    char mine[STORE_ID_BYTES];
    if (!store_is_shared(store)) return STATUS_OK;
    store_daemon_id(store, mine);
    pthread_mutex_lock(&store->write.lock);
    status s =
        store_run(&store->write, &n, err,
                  "UPDATE job SET holder = ?1 WHERE serial = (SELECT serial FROM job WHERE id = ?2 AND state = 1 "
                  "AND deleted = 0 AND (holder IN ('', ?1) OR NOT " LIVES("holder") ") FOR UPDATE SKIP LOCKED) "
                                                                                    "AND " LIVES("?1"),
                  "ss", mine, id);
    pthread_mutex_unlock(&store->write.lock);
    if (s == STATUS_OK && n == 0) s = error_set(err, STATUS_CONFLICT, "job %s is started by another daemon", id);
    return s;
}

status store_job_take(struct store *store, const char *id, struct error *err)
{
    int n = 0;
    char mine[STORE_ID_BYTES];
    if (!store_is_shared(store)) return STATUS_OK;
    store_daemon_id(store, mine);
    pthread_mutex_lock(&store->write.lock);
    status s =
        store_run(&store->write, &n, err,
                  "UPDATE job SET holder = ?1 WHERE serial = (SELECT serial FROM job WHERE id = ?2 AND state = 2 "
                  "AND deleted = 0 AND NOT " LIVES("holder") " FOR UPDATE SKIP LOCKED) AND " LIVES("?1"),
                  "ss", mine, id);
    pthread_mutex_unlock(&store->write.lock);
    if (s == STATUS_OK && n == 0) s = error_set(err, STATUS_CONFLICT, "job %s has another daemon", id);
    return s;
}

status store_job_unclaim(struct store *store, const char *id, struct error *err)
{
    char mine[STORE_ID_BYTES];
    if (!store_is_shared(store)) return STATUS_OK;
    store_daemon_id(store, mine);
    CHANGE(&store->write, NULL, err, "UPDATE job SET holder = '' WHERE id = ? AND state = 1 AND holder = ?", "ss", id,
           mine);
}

status store_job_elsewhere(struct store *store, const char *id, bool *elsewhere, struct error *err)
{
    char text[STORE_ID_BYTES] = "", mine[STORE_ID_BYTES];
    *elsewhere = false;
    if (!store_is_shared(store)) return STATUS_OK;
    store_daemon_id(store, mine);
    status s = ask(store, text, sizeof text, err,
                   "SELECT holder FROM job WHERE id = ?1 AND holder <> ?2 AND " LIVES("holder"), id, mine);
    *elsewhere = text[0] != '\0';
    return s;
}

status store_job_orphans(struct store *store, char (**out)[STORE_ID_BYTES], size_t *n_out, struct error *err)
{
    struct store_query *q = NULL;
    char(*id)[STORE_ID_BYTES] = NULL;
    size_t n = 0;
    enum store_step rc = STORE_DONE;
    *out = NULL;
    *n_out = 0;
    if (!store_is_shared(store)) return STATUS_OK;
    pthread_mutex_lock(&store->read.lock);
    status s = store_prepare(&store->read, &q, err,
                             "SELECT id FROM job WHERE deleted = 0 AND state = 2 AND NOT " LIVES("holder"), "");
    while (s == STATUS_OK && (rc = store_step(q)) == STORE_ROW) {
        char(*more)[STORE_ID_BYTES] = realloc(id, (n + 1) * sizeof *more);
        if (more == NULL) {
            s = error_set(err, STATUS_NO_MEMORY, "cannot list jobs: out of memory");
            break;
        }
        id = more;
        store_text(q, 0, id[n++], STORE_ID_BYTES);
    }
    if (s == STATUS_OK && rc == STORE_FAILED) s = store_error(&store->read, "cannot list jobs", err);
    store_finish(q);
    pthread_mutex_unlock(&store->read.lock);
    if (s != STATUS_OK) {
        free(id);
        return s;
    }
    *out = id;
    *n_out = n;
    return STATUS_OK;
}

void store_read_changes(struct store *store)
{
    if (store->read.calls->notices == NULL || store->changed == NULL) return;
    pthread_mutex_lock(&store->read.lock);
    store->read.calls->notices(store->read.db, store->changed, store->changed_context);
    pthread_mutex_unlock(&store->read.lock);
}

bool store_duty_is_mine(struct store *store, const char *duty)
{
    char found[STORE_DUTY_BYTES], mine[STORE_ID_BYTES];
    int n = 0;
    if (!store_is_shared(store)) return true;
    store_daemon_id(store, mine);
    if (ask(store, found, sizeof found, NULL, "SELECT name FROM duty WHERE name = ?1 AND daemon = ?2 AND " LIVES("?2"),
            duty, mine) != STATUS_OK)
        return false;
    if (found[0] != '\0') return true;
    pthread_mutex_lock(&store->write.lock);
    status s =
        store_run(&store->write, &n, NULL,
                  "INSERT INTO duty AS d (name, daemon) SELECT ?1, ?2 WHERE " LIVES(
                      "?2") " ON CONFLICT (name) DO UPDATE SET daemon = excluded.daemon WHERE NOT " LIVES("d.daemon"),
                  "ss", duty, mine);
    pthread_mutex_unlock(&store->write.lock);
    return s == STATUS_OK && n > 0;
}

/* ---- the gate */

static status enter(struct store_gate *gate, const char *job_id, const char *owner, struct error *err)
{
    enum { LOCK_ALL = 7878002, LOCK_OWNER, LOCK_JOB };
    struct store_link *link = &gate->link;
    if (job_id == NULL && owner == NULL)
        return store_run(link, NULL, err, "SELECT pg_advisory_lock(CAST(? AS INTEGER), 0)", "i", (int64_t)LOCK_ALL);
    /* one statement, because the connection may be opened again before each; a lock of a null is not taken */
    return store_run(link, NULL, err,
                     "SELECT pg_advisory_lock_shared(CAST(? AS INTEGER), 0), "
                     "pg_advisory_lock(CAST(? AS INTEGER), hashtext(?)), "
                     "pg_advisory_lock(CAST(? AS INTEGER), hashtext(?))",
                     "iisis", (int64_t)LOCK_ALL, (int64_t)LOCK_OWNER, owner, (int64_t)LOCK_JOB, job_id);
}

void store_gate_enter(struct store *store, const char *job_id, const char *owner)
{
    struct store_gate *gate = &store->gate;
    if (!store_is_shared(store)) return;
    pthread_mutex_lock(&gate->link.lock);
    gate->fault = enter(gate, job_id, owner, &gate->why);
    atomic_store(&gate->thread, pthread_self());
    atomic_store(&gate->entered, true);
}

void store_gate_leave(struct store *store)
{
    struct store_gate *gate = &store->gate;
    if (!store_is_shared(store)) return;
    atomic_store(&gate->entered, false);
    /* a lost connection has no locks */
    if (gate->link.calls->is_alive(gate->link.db))
        store_run(&gate->link, NULL, NULL, "SELECT pg_advisory_unlock_all()", "");
    pthread_mutex_unlock(&gate->link.lock);
}
