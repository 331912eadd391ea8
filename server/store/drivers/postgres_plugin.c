/* The calls of the store for PostgreSQL, over libpq: a shared object that the daemon loads when its settings name
 * such a database. A connection that was lost is opened again before the next statement outside of a transaction.
 * Nothing that may have changed the database is ever sent twice. */
#include "base/utf8.h"
#include "server/store/drivers/store_driver.h"

#include <libpq-fe.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

enum {
    PARAMETERS_MOST = 32,
    READS_MOST = 16,
    NUMBER_BYTES = 40,
    OID_BYTEA = 17,
    OID_INT8 = 20,
    OID_TEXT = 25,
    OID_FLOAT8 = 701
};

struct pg_db {
    PGconn *c;
    const struct store_place *place;
    const char *application;
    bool only_reads, in_transaction;
    bool missed;      /* the connection was opened again since the last call of notices */
    time_t failed_at; /* when a connection was last tried in vain; 0: not since the last one */
    status fault;
    char why[STORE_WHY_BYTES];
};

struct pg_query {
    struct store_query base;
    PGresult *result;
    int row, n_row;
    unsigned char *bytes; /* of the last blob */
};

static struct pg_query *query_of(struct store_query *q) { return (struct pg_query *)(void *)q; }

static status fail(struct pg_db *d, status s, const char *why)
{
    size_t n = strcspn(why, "\n");
    d->fault = s;
    snprintf(d->why, sizeof d->why, "%.*s", (int)n, why);
    return s;
}

static status fail_by(struct pg_db *d, const PGresult *r)
{
    const char *state = r == NULL ? NULL : PQresultErrorField(r, PG_DIAG_SQLSTATE);
    const char *why = r == NULL ? PQerrorMessage(d->c) : PQresultErrorMessage(r);
    if (state == NULL) state = "";
    /* a lock that was waited for in vain, and a deadlock */
    if (strcmp(state, "55P03") == 0 || strcmp(state, "40P01") == 0)
        return fail(d, STATUS_CONFLICT, "another daemon is changing this; repeat the request");
    return fail(d,
                strncmp(state, "23", 2) == 0  ? STATUS_EXISTS
                : strcmp(state, "53100") == 0 ? STATUS_DISK_FULL
                                              : STATUS_IO,
                why);
}

/* ---- the connection */

static bool is_lost(const struct pg_db *d) { return d->c == NULL || PQstatus(d->c) != CONNECTION_OK; }

static bool is_alive(void *db)
{
    struct pg_db *d = db;
    /* a server that stops sends a last message before it closes the connection, so all that has come is read */
    for (int i = 0; i < READS_MOST; i++) {
        if (is_lost(d) || PQconsumeInput(d->c) == 0 || PQstatus(d->c) != CONNECTION_OK) return false;
        struct pollfd more = {.fd = PQsocket(d->c), .events = POLLIN};
        if (poll(&more, 1, 0) <= 0) break;
    }
    return true;
}

static status set_up(struct pg_db *d)
{
    /* Some servers answer commits before they are on disk by default; ask this one not to. */
    PGresult *r = PQexec(d->c, "SET lock_timeout = '30s'; SET idle_in_transaction_session_timeout = '60s'; "
                               "SET bytea_output = hex; SET standard_conforming_strings = on; SELECT "
                               "set_config('synchronous_commit', 'on', false) WHERE "
                               "current_setting('synchronous_commit') = 'off'");
    bool done = PQresultStatus(r) == PGRES_TUPLES_OK;
    if (done && d->only_reads) {
        PQclear(r);
        r = PQexec(d->c, "LISTEN selvedge_job; SET default_transaction_read_only = on");
        done = PQresultStatus(r) == PGRES_COMMAND_OK;
    }
    status s = done ? STATUS_OK : fail_by(d, r);
    PQclear(r);
    return s;
}

static void ignore_notice(void *context, const char *text) { (void)context, (void)text; }

/* Returns whether libpq can mean this part of an address as it reads it: it is not a piece of a password. */
static bool is_sound(const PQconninfoOption *part)
{
    if (part->val == NULL) return true;
    if (strcmp(part->keyword, "port") == 0) return part->val[strspn(part->val, "0123456789,")] == '\0';
    if (strcmp(part->keyword, "host") != 0 && strcmp(part->keyword, "dbname") != 0) return true;
    return strchr(part->val + (part->val[0] == '@'), '@') == NULL; /* an abstract socket begins with '@' */
}

/* libpq's messages quote parts of an address. A password that has '/', '@' or '%' and is not percent-encoded is cut at
 * them, and its rest would be quoted as a host, a port or a database. */
static status check_address(struct pg_db *d)
{
    PQconninfoOption *parsed = PQconninfoParse(d->place->address, NULL);
    bool sound = parsed != NULL;
    for (const PQconninfoOption *part = parsed; sound && part->keyword != NULL; part++) sound = is_sound(part);
    PQconninfoFree(parsed);
    if (sound) return STATUS_OK;
    return fail(d, STATUS_INVALID,
                "the address is malformed (percent-encode the password, or use server.store_password_file)");
}

static status connect_db(struct pg_db *d)
{
    /* later parts override earlier ones */
    const char *const key[] = {"connect_timeout",
                               "tcp_user_timeout",
                               "keepalives_idle",
                               "keepalives_interval",
                               "keepalives_count",
                               "dbname",
                               "client_encoding",
                               "application_name",
                               d->place->password != NULL ? "password" : NULL,
                               NULL};
    const char *const value[] = {
        "5", "20000", "10", "5", "3", d->place->address, "UTF8", d->application, d->place->password, NULL};
    if (d->c != NULL) PQfinish(d->c);
    d->c = NULL;
    if (d->failed_at == time(NULL)) return STATUS_IO; /* `why` says it still */
    d->c = PQconnectdbParams(key, value, 1);
    status s = is_lost(d) ? fail(d, STATUS_IO, d->c == NULL ? "out of memory" : PQerrorMessage(d->c)) : STATUS_OK;
    if (s == STATUS_OK) PQsetNoticeProcessor(d->c, ignore_notice, NULL);
    if (s == STATUS_OK) s = set_up(d);
    d->failed_at = s == STATUS_OK ? 0 : time(NULL);
    d->missed = true;
    if (s != STATUS_OK && d->c != NULL) {
        PQfinish(d->c);
        d->c = NULL;
    }
    return s;
}

/* Makes sure, as far as that can be known, that there is a connection. One that was lost in a transaction stays lost
 * until the transaction is ended. */
static status ensure(struct pg_db *d)
{
    if (d->in_transaction)
        return is_lost(d) ? fail(d, STATUS_IO, "the connection to the server was lost during a change") : STATUS_OK;
    return is_alive(d) ? STATUS_OK : connect_db(d);
}

static status open_db(const struct store_place *place, const char *application, bool only_reads, bool create,
                      void **out)
{
    struct pg_db *d = calloc(1, sizeof *d);
    (void)create;
    *out = d;
    if (d == NULL) return STATUS_NO_MEMORY;
    d->place = place;
    d->application = application;
    d->only_reads = only_reads;
    status s = check_address(d);
    if (s == STATUS_OK) s = connect_db(d);
    d->missed = false;
    return s;
}

static void close_db(void *db)
{
    struct pg_db *d = db;
    if (d->c != NULL) PQfinish(d->c);
    free(d);
}

static status fault(void *db, char *text, size_t n_text)
{
    const struct pg_db *d = db;
    snprintf(text, n_text, "%s", d->why);
    return d->fault == STATUS_OK ? STATUS_IO : d->fault;
}

/* ---- statements */

static bool succeeded(const PGresult *r)
{
    ExecStatusType t = PQresultStatus(r);
    return t == PGRES_TUPLES_OK || t == PGRES_COMMAND_OK;
}

static status script(void *db, const char *sql)
{
    struct pg_db *d = db;
    const bool begins = strcmp(sql, "BEGIN") == 0, commits = strcmp(sql, "COMMIT") == 0;
    if (strcmp(sql, "ROLLBACK") == 0 && (!d->in_transaction || is_lost(d))) {
        d->in_transaction = false;
        return STATUS_OK;
    }
    status s = ensure(d);
    if (s != STATUS_OK) return s;
    PGresult *r = PQexec(d->c, sql);
    if (begins && is_lost(d) && connect_db(d) == STATUS_OK) { /* nothing has begun */
        PQclear(r);
        r = PQexec(d->c, sql);
    }
    if (commits && is_lost(d))
        s = fail(d, STATUS_IO, "the connection to the server was lost in a commit, which may have been made or not");
    else if (!succeeded(r))
        s = fail_by(d, r);
    else if (commits && strcmp(PQcmdStatus(r), "COMMIT") != 0)
        s = fail(d, STATUS_IO, "the server has rolled the change back");
    PQclear(r);
    if (begins) d->in_transaction = s == STATUS_OK;
    if (commits || strcmp(sql, "ROLLBACK") == 0) d->in_transaction = false;
    return s;
}

/* Copies SQL with ?, ?1 as $1. Nothing in quotes has a question mark. Returns NULL when memory is out. */
static char *numbered(const char *sql)
{
    size_t n = 0, n_out = strlen(sql) * 4 + 1;
    int next = 1;
    char *out = malloc(n_out);
    for (; out != NULL && *sql != '\0'; sql++) {
        if (*sql != '?')
            out[n++] = *sql;
        else if (sql[1] >= '0' && sql[1] <= '9')
            out[n++] = '$';
        else
            n += (size_t)snprintf(out + n, n_out - n, "$%d", next++);
    }
    if (out != NULL) out[n] = '\0';
    return out;
}

struct parameters {
    Oid type[PARAMETERS_MOST];
    const char *value[PARAMETERS_MOST];
    int length[PARAMETERS_MOST], format[PARAMETERS_MOST];
    char number[PARAMETERS_MOST][NUMBER_BYTES];
    char *text[PARAMETERS_MOST]; /* owned */
};

static bool set_text(struct parameters *p, size_t i, const struct store_value *v)
{
    p->type[i] = OID_TEXT;
    if (v->bytes == NULL) return true;
    p->text[i] = malloc(v->n_bytes + 1);
    if (p->text[i] == NULL) return false;
    memcpy(p->text[i], v->bytes, v->n_bytes + 1);
    utf8_repair(p->text[i]); /* a text that was cut within a character would be refused by the server */
    p->value[i] = p->text[i];
    return true;
}

static bool set_parameter(struct parameters *p, size_t i, const struct store_value *v)
{
    if (v->kind == 's') return set_text(p, i, v);
    if (v->kind == 'b') {
        p->type[i] = OID_BYTEA;
        p->value[i] = v->bytes;
        p->length[i] = (int)v->n_bytes;
        p->format[i] = 1;
        return true;
    }
    p->type[i] = v->kind == 'i' ? OID_INT8 : OID_FLOAT8;
    if (v->kind == 'i')
        snprintf(p->number[i], NUMBER_BYTES, "%lld", (long long)v->integer);
    else
        snprintf(p->number[i], NUMBER_BYTES, "%.17g", v->real);
    p->value[i] = p->number[i];
    return true;
}

static PGresult *execute(struct pg_db *d, const char *sql, const struct parameters *p, size_t n)
{
    return PQexecParams(d->c, sql, (int)n, p->type, p->value, p->length, p->format, 0);
}

static status run(struct pg_db *d, const char *sql, const struct parameters *p, size_t n, PGresult **result)
{
    status s = ensure(d);
    if (s != STATUS_OK) return s;
    PGresult *r = execute(d, sql, p, n);
    /* a statement that only reads can be repeated */
    if (!succeeded(r) && is_lost(d) && d->only_reads && connect_db(d) == STATUS_OK) {
        PQclear(r);
        r = execute(d, sql, p, n);
    }
    if (succeeded(r)) {
        *result = r;
        return STATUS_OK;
    }
    s = is_lost(d) ? fail(d, STATUS_IO, "the connection to the server was lost") : fail_by(d, r);
    PQclear(r);
    return s;
}

extern const struct store_calls selvedge_store_calls;

static status query(void *db, const char *sql, const struct store_value *value, size_t n, struct store_query **out)
{
    struct pg_db *d = db;
    struct parameters *p = calloc(1, sizeof *p);
    struct pg_query *q = calloc(1, sizeof *q);
    char *text = numbered(sql);
    bool made = p != NULL && q != NULL && text != NULL && n <= PARAMETERS_MOST;
    for (size_t i = 0; made && i < n; i++) made = set_parameter(p, i, &value[i]);
    status s = made ? run(d, text, p, n, &q->result) : fail(d, STATUS_NO_MEMORY, "out of memory");
    for (size_t i = 0; p != NULL && i < n && i < PARAMETERS_MOST; i++) free(p->text[i]);
    free(text);
    free(p);
    if (s != STATUS_OK) {
        free(q);
        return s;
    }
    q->base.calls = &selvedge_store_calls;
    q->row = -1;
    q->n_row = PQntuples(q->result);
    *out = &q->base;
    return STATUS_OK;
}

static enum store_step step(struct store_query *base)
{
    struct pg_query *q = query_of(base);
    if (q->row < q->n_row) q->row++;
    return q->row < q->n_row ? STORE_ROW : STORE_DONE;
}

static bool is_null(struct store_query *q, int column)
{
    return PQgetisnull(query_of(q)->result, query_of(q)->row, column) == 1;
}

static const char *text_of(struct store_query *q, int column)
{
    return PQgetvalue(query_of(q)->result, query_of(q)->row, column);
}

/* A truth value is shown as t or f. */
static int64_t integer(struct store_query *q, int column)
{
    const char *value = text_of(q, column);
    return value[0] == 't' ? 1 : strtoll(value, NULL, 10);
}

static double real(struct store_query *q, int column) { return strtod(text_of(q, column), NULL); }
static const char *text(struct store_query *q, int column) { return is_null(q, column) ? NULL : text_of(q, column); }

static const void *blob(struct store_query *base, int column, size_t *n)
{
    struct pg_query *q = query_of(base);
    *n = 0;
    if (is_null(base, column)) return NULL;
    PQfreemem(q->bytes);
    q->bytes = PQunescapeBytea((const unsigned char *)text_of(base, column), n);
    return q->bytes;
}

static int64_t n_changed(struct store_query *q)
{
    const char *n = PQcmdTuples(query_of(q)->result);
    return strtoll(n, NULL, 10);
}

static void finish(struct store_query *base)
{
    struct pg_query *q = query_of(base);
    PQclear(q->result);
    PQfreemem(q->bytes);
    free(q);
}

static void notices(void *db, void (*changed)(void *context, const char *job_id), void *context)
{
    struct pg_db *d = db;
    if (ensure(d) != STATUS_OK) return;
    if (d->missed) changed(context, NULL);
    d->missed = false;
    for (PGnotify *n; (n = PQnotifies(d->c)) != NULL; PQfreemem(n)) changed(context, n->extra);
}

const struct store_calls selvedge_store_calls = {
    STORE_CALLS_VERSION, open_db, close_db, script,   query,  step, is_null, integer, real, text, blob,
    n_changed,           finish,  fault,    is_alive, notices};
