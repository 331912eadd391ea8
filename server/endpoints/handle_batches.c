/* Batches: many samples with one template. */
#include "server/batches/batch_plan.h"
#include "server/batches/batch_service.h"
#include "server/batches/batch_view.h"
#include "server/endpoints/handlers.h"
#include "server/endpoints/request_json.h"
#include "server/endpoints/verdict_filter.h"
#include "server/http/http_reply.h"
#include "server/http/long_poll.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { LIST_MOST = 500, LIST_USUAL = 50, PRIORITY_MOST = 10, CORE_MOST = 100000 };

/* Reads a batch as a client sees it. */
static status view_of(struct http_request *r, const char *id, json_t **view, struct error *err)
{
    struct batch_row row;
    status s = batch_get(r->service, id, &row, err);
    if (s == STATUS_OK) s = batch_view(r->service, &row, view, err);
    batch_row_release(&row);
    return s;
}

void handle_submit_batch(struct http_request *r)
{
    struct batch_table table = {0};
    struct batch_outcome outcome = {0};
    struct job_refusal refusal = {0};
    struct error err = {0};
    char location[80];
    json_t *body = request_json(r), *faults = NULL, *view = NULL;
    if (body == NULL) return;
    status s = batch_table_read(r->service, body, &table, &faults, &err);
    json_decref(body);
    if (s != STATUS_OK)
        refusal.extra = json_array_size(faults) > 0 ? json_pack("{s:O}", "errors", faults) : NULL;
    else
        s = batch_submit(r->service, &r->grant, &table, &outcome, &refusal, &err);
    if (s == STATUS_OK) s = view_of(r, outcome.id, &view, &err);
    if (s != STATUS_OK)
        reply_problem(r, refusal.code, &err, refusal.extra);
    else {
        json_object_set(view, "samples", outcome.samples);
        json_object_set(view, "left", outcome.left);
        reply_json(r, outcome.created ? MHD_HTTP_CREATED : MHD_HTTP_OK, view);
        snprintf(location, sizeof location, "/v1/batches/%s", outcome.id);
        if (outcome.created) reply_header(r, "Location", location);
        if (outcome.replayed) reply_header(r, "Idempotent-Replay", "true");
    }
    json_decref(faults);
    json_decref(outcome.samples);
    json_decref(outcome.left);
    batch_table_release(&table);
}

static status list_rows(struct http_request *r, int64_t before, size_t limit, json_t *list, int64_t *next,
                        struct error *err)
{
    struct batch_row *row = NULL;
    size_t n = 0;
    status s =
        store_batch_list(r->service->store, r->grant.all ? NULL : r->grant.owner, before, limit + 1, &row, &n, err);
    for (size_t i = 0; s == STATUS_OK && i < n && i < limit; i++) {
        json_t *view = NULL;
        s = batch_summary(r->service, &row[i], &view, err);
        if (s == STATUS_OK) json_array_append_new(list, view);
    }
    *next = s == STATUS_OK && n > limit ? row[limit - 1].serial : 0;
    batch_rows_free(row, n);
    return s;
}

void handle_list_batches(struct http_request *r)
{
    struct error err = {0};
    long long limit, before;
    int64_t next = 0;
    char cursor[24];
    if (!query_integer(r, "limit", 1, LIST_MOST, LIST_USUAL, &limit) ||
        !query_integer(r, "cursor", 1, INT64_MAX, 0, &before))
        return;
    json_t *list = json_array();
    if (list_rows(r, before, (size_t)limit, list, &next, &err) != STATUS_OK) {
        json_decref(list);
        reply_problem(r, NULL, &err, NULL);
        return;
    }
    snprintf(cursor, sizeof cursor, "%lld", (long long)next);
    reply_json_tagged(
        r, json_pack("{s:o,s:o}", "batches", list, "next_cursor", next > 0 ? json_string(cursor) : json_null()));
}

void handle_get_batch(struct http_request *r)
{
    struct long_poll poll;
    if (!long_poll_begin(r, NULL, &poll)) return;
    do {
        struct error err = {0};
        json_t *view = NULL;
        if (view_of(r, r->param[0], &view, &err) != STATUS_OK)
            reply_problem(r, NULL, &err, NULL);
        else
            reply_json_tagged(r, view);
    } while (long_poll_again(r, &poll));
}

void handle_delete_batch(struct http_request *r)
{
    struct error err = {0};
    const char *jobs = MHD_lookup_connection_value(r->connection, MHD_GET_ARGUMENT_KIND, "jobs");
    bool delete_them = jobs != NULL && strcmp(jobs, "delete") == 0;
    if (!delete_them && (jobs == NULL || strcmp(jobs, "keep") != 0)) {
        error_set_field(&err, STATUS_INVALID, "jobs",
                        "say what becomes of the jobs of the batch: jobs=keep or jobs=delete");
        reply_problem(r, NULL, &err, NULL);
        return;
    }
    if (batch_delete(r->service, r->param[0], delete_them, &err) != STATUS_OK)
        reply_problem(r, NULL, &err, NULL);
    else
        reply_empty(r, MHD_HTTP_NO_CONTENT);
}

static void act(struct http_request *r, enum batch_action action)
{
    struct error err = {0};
    long long priority = 0;
    size_t n_changed = 0;
    json_t *refused = NULL, *view = NULL;
    bool given = MHD_lookup_connection_value(r->connection, MHD_GET_ARGUMENT_KIND, "priority") != NULL;
    if (given && !query_integer(r, "priority", -PRIORITY_MOST, PRIORITY_MOST, 0, &priority)) return;
    const int64_t wanted = priority;
    status s = batch_act(r->service, r->param[0], action, given ? &wanted : NULL, &n_changed, &refused, &err);
    if (s == STATUS_OK) s = view_of(r, r->param[0], &view, &err);
    if (s != STATUS_OK)
        reply_problem(r, NULL, &err, NULL);
    else {
        json_object_set_new(view, "n_changed", json_integer((json_int_t)n_changed));
        json_object_set(view, "refused", refused);
        reply_json(r, n_changed > 0 ? MHD_HTTP_ACCEPTED : MHD_HTTP_OK, view);
    }
    json_decref(refused);
}

void handle_start_batch(struct http_request *r) { act(r, BATCH_START); }
void handle_retry_batch(struct http_request *r) { act(r, BATCH_RETRY); }
void handle_cancel_batch(struct http_request *r) { act(r, BATCH_CANCEL); }

void handle_get_batch_plan(struct http_request *r)
{
    struct error err = {0};
    struct batch_row row;
    long long n_core;
    json_t *plan = NULL;
    if (!query_integer(r, "cores", 1, CORE_MOST, 0, &n_core)) return;
    status s = batch_get(r->service, r->param[0], &row, &err);
    if (s == STATUS_OK) s = batch_plan(r->service, &row, (size_t)n_core, &plan, &err);
    batch_row_release(&row);
    if (s == STATUS_OK)
        reply_json(r, MHD_HTTP_OK, plan);
    else
        reply_problem(r, NULL, &err, NULL);
}

/* The table of results; NULL after a reply. */
static json_t *results_of(struct http_request *r)
{
    struct error err = {0};
    struct batch_row row;
    json_t *table = NULL;
    char filter[VERDICT_FILTER_BYTES];
    if (!verdict_filter_read(r, filter)) return NULL;
    status s = batch_get(r->service, r->param[0], &row, &err);
    batch_row_release(&row);
    if (s == STATUS_OK) s = batch_results(r->service, r->param[0], filter, &table, &err);
    if (s == STATUS_OK) return table;
    reply_problem(r, NULL, &err, NULL);
    return NULL;
}

void handle_get_batch_results(struct http_request *r)
{
    json_t *table = results_of(r);
    if (table != NULL) reply_json_tagged(r, table);
}

void handle_get_batch_table(struct http_request *r)
{
    json_t *table = results_of(r);
    if (table == NULL) return;
    char *text = batch_results_csv(table);
    json_decref(table);
    if (text == NULL) {
        struct error err = {0};
        error_set(&err, STATUS_NO_MEMORY, "cannot write the table: out of memory");
        reply_problem(r, NULL, &err, NULL);
        return;
    }
    reply_text(r, MHD_HTTP_OK, "text/csv; charset=utf-8", text, strlen(text));
    reply_header(r, "Content-Disposition", "attachment; filename=\"results.csv\"");
    free(text);
}
