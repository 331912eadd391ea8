/* Statements, in the part that all drivers share. */
#include "server/store/drivers/store_sql.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

enum { VALUES_MOST = 32 };

status store_error(struct store_link *link, const char *action, struct error *err)
{
    char why[STORE_WHY_BYTES] = "";
    status s = link->calls->fault(link->db, why, sizeof why);
    if (s == STATUS_CONFLICT)
        return error_set(err, s, "%s", why); /* it is about the row to be changed, not about the database */
    return error_set(err, s, "%s: database says '%s'", action, why);
}

status store_gate_check(struct store_gate *gate, struct error *err)
{
    if (gate == NULL || !atomic_load(&gate->entered) || !pthread_equal(atomic_load(&gate->thread), pthread_self()))
        return STATUS_OK;
    if (gate->fault != STATUS_OK) return error_set(err, gate->fault, "%s", gate->why.text);
    if (gate->link.calls->is_alive(gate->link.db)) return STATUS_OK;
    return error_set(err, STATUS_IO, "the connection that keeps other daemons from this change was lost");
}

static size_t read_values(struct store_value value[VALUES_MOST], const char *format, va_list args)
{
    size_t n = 0;
    for (; *format != '\0' && n < VALUES_MOST; format++, n++) {
        struct store_value *v = &value[n];
        *v = (struct store_value){.kind = *format};
        if (*format == 's') {
            v->bytes = va_arg(args, const char *);
            v->n_bytes = v->bytes == NULL ? 0 : strlen(v->bytes);
        } else if (*format == 'i')
            v->integer = va_arg(args, int64_t);
        else if (*format == 'd')
            v->real = va_arg(args, double);
        else {
            v->bytes = va_arg(args, const void *);
            v->n_bytes = (size_t)va_arg(args, int);
        }
    }
    return n;
}

static status prepare(struct store_link *link, struct store_query **query, struct error *err, const char *sql,
                      const char *format, va_list args)
{
    struct store_value value[VALUES_MOST];
    size_t n = read_values(value, format, args);
    *query = NULL;
    return link->calls->query(link->db, sql, value, n, query) == STATUS_OK
               ? STATUS_OK
               : store_error(link, "cannot run a query", err);
}

status store_prepare(struct store_link *link, struct store_query **query, struct error *err, const char *sql,
                     const char *format, ...)
{
    va_list args;
    va_start(args, format);
    status s = prepare(link, query, err, sql, format, args);
    va_end(args);
    return s;
}

/* Runs a statement to its end, and ends it. serial (may be NULL): the first column of the last row. */
static status run(struct store_link *link, struct store_query *query, int64_t *serial, int *n_changed,
                  struct error *err)
{
    enum store_step step;
    status s = STATUS_OK;
    while ((step = store_step(query)) == STORE_ROW)
        if (serial != NULL) *serial = store_int64(query, 0);
    if (step != STORE_DONE) s = store_error(link, "cannot write to the database", err);
    if (n_changed != NULL) *n_changed = s == STATUS_OK ? (int)link->calls->n_changed(query) : 0;
    store_finish(query);
    return s;
}

status store_run(struct store_link *link, int *n_changed, struct error *err, const char *sql, const char *format, ...)
{
    struct store_query *query = NULL;
    va_list args;
    va_start(args, format);
    status s = store_gate_check(link->gate, err);
    if (s == STATUS_OK) s = prepare(link, &query, err, sql, format, args);
    va_end(args);
    return s == STATUS_OK ? run(link, query, NULL, n_changed, err) : s;
}

status store_run_serial(struct store_link *link, int64_t *serial, struct error *err, const char *sql,
                        const char *format, ...)
{
    struct store_query *query = NULL;
    va_list args;
    va_start(args, format);
    status s = store_gate_check(link->gate, err);
    if (s == STATUS_OK) s = prepare(link, &query, err, sql, format, args);
    va_end(args);
    return s == STATUS_OK ? run(link, query, serial, NULL, err) : s;
}

status store_script(struct store_link *link, const char *sql, const char *what, struct error *err)
{
    return link->calls->script(link->db, sql) == STATUS_OK ? STATUS_OK : store_error(link, what, err);
}

status store_begin(struct store_link *link, struct error *err)
{
    status s = store_gate_check(link->gate, err);
    return s != STATUS_OK ? s : store_script(link, link->phrase->begin, "cannot write to the database", err);
}

/* A commit whose reply is lost may have been made or not: it counts as an error, so nobody acknowledges it. */
status store_end(struct store_link *link, status so_far, struct error *err)
{
    if (so_far == STATUS_OK) so_far = store_gate_check(link->gate, err);
    if (so_far == STATUS_OK) so_far = store_script(link, "COMMIT", "cannot write to the database", err);
    if (so_far != STATUS_OK) link->calls->script(link->db, "ROLLBACK");
    return so_far;
}

enum store_step store_step(struct store_query *query)
{
    return query == NULL ? STORE_FAILED : query->calls->step(query);
}
bool store_is_null(struct store_query *query, int column) { return query->calls->is_null(query, column); }
int64_t store_int64(struct store_query *query, int column) { return query->calls->integer(query, column); }
double store_real(struct store_query *query, int column) { return query->calls->real(query, column); }
const char *store_column_text(struct store_query *query, int column) { return query->calls->text(query, column); }

void store_text(struct store_query *query, int column, char *out, size_t n_out)
{
    const char *text = store_column_text(query, column);
    snprintf(out, n_out, "%s", text == NULL ? "" : text);
}

void store_finish(struct store_query *query)
{
    if (query != NULL) query->calls->finish(query);
}
