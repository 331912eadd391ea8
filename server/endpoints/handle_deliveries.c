#include "server/endpoints/handlers.h"
#include "server/http/http_reply.h"
#include "server/store/store_delivery.h"

#include <stdio.h>
#include <stdlib.h>

enum { LIST_MOST = 500, LIST_USUAL = 50 };
static const char *const state_name[] = {"waiting", "delivered", "failed"};

static json_t *time_or_null(double t) { return t > 0 ? json_real(t) : json_null(); }

static json_t *view(const struct delivery_row *d)
{
    char event[32];
    snprintf(event, sizeof event, "job.%s", job_state_name(d->job_state));
    bool waits = d->state == DELIVERY_WAITING;
    return json_pack("{s:s,s:s,s:s,s:s,s:f,s:I,s:o,s:o,s:o,s:o}", "id", d->id, "job", d->job_id, "event", event,
                     "state", state_name[d->state], "created_unix_s", d->created_unix_s, "n_try", (json_int_t)d->n_try,
                     "next_try_unix_s", time_or_null(waits ? d->next_unix_s : 0), "delivered_unix_s",
                     time_or_null(d->delivered_unix_s), "last_status",
                     d->http_status > 0 ? json_integer((json_int_t)d->http_status) : json_null(), "last_error",
                     d->error[0] != '\0' ? json_string(d->error) : json_null());
}

void handle_list_deliveries(struct http_request *r)
{
    struct delivery_row *row = NULL;
    size_t n = 0;
    struct error err = {0};
    long long limit, cursor;
    char next[32] = "";
    const char *job = MHD_lookup_connection_value(r->connection, MHD_GET_ARGUMENT_KIND, "job");
    if (!query_integer(r, "limit", 1, LIST_MOST, LIST_USUAL, &limit) ||
        !query_integer(r, "cursor", 1, INT64_MAX, 0, &cursor))
        return;
    const char *owner = r->grant.all ? NULL : r->grant.owner;
    if (store_delivery_list(r->service->store, owner, job, cursor, (size_t)limit + 1, &row, &n, &err) != STATUS_OK) {
        reply_problem(r, NULL, &err, NULL);
        return;
    }
    json_t *list = json_array();
    for (size_t i = 0; i < n && i < (size_t)limit; i++) json_array_append_new(list, view(&row[i]));
    if (n > (size_t)limit) snprintf(next, sizeof next, "%lld", (long long)row[limit - 1].serial);
    free(row);
    reply_json_tagged(
        r, json_pack("{s:o,s:o}", "deliveries", list, "next_cursor", next[0] ? json_string(next) : json_null()));
}
