#include "optimizer/job/checks/job_faults.h"
#include "optimizer/job/job_outline.h"
#include "server/endpoints/handlers.h"
#include "server/endpoints/request_json.h"
#include "server/http/http_reply.h"
#include "server/http/long_poll.h"
#include "server/views/job_view.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { PRIORITY_MOST = 10 };

/* Decides a 304 when the client has the present job. The document is not even read for it. */
static bool job_not_modified(struct http_request *r)
{
    struct job_row row;
    char tag[JOB_TAG_BYTES];
    if (request_header(r, "If-None-Match") == NULL) return false;
    status s = job_look(r->service, r->param[0], &row, NULL);
    if (s == STATUS_OK) s = job_view_tag(r->service, &row, tag, NULL);
    return s == STATUS_OK && reply_not_modified(r, tag);
}

static void reply_job(struct http_request *r, const char *id, unsigned status_code, bool created, bool replayed)
{
    struct job_row row;
    struct error err = {0};
    json_t *view = NULL;
    char tag[JOB_TAG_BYTES], location[80];
    status s = job_get(r->service, id, &row, &err);
    if (s == STATUS_OK)
        s = job_view_tag(r->service, &row, tag, &err); /* first, because a change from now on changes the next tag */
    if (s == STATUS_OK) s = job_view(r->service, &row, true, &view, &err);
    if (s != STATUS_OK) {
        reply_problem(r, NULL, &err, NULL);
        job_row_release(&row);
        return;
    }
    json_object_set_new(view, "heartbeat_age_s", job_view_heartbeat_age(r->service, &row));
    reply_json(r, status_code, view);
    reply_header(r, "ETag", tag);
    snprintf(location, sizeof location, "/v1/jobs/%s", row.id);
    if (created) reply_header(r, "Location", location);
    if (replayed) reply_header(r, "Idempotent-Replay", "true");
    job_row_release(&row);
}

/* Everything that is wrong with a job document, as the member "errors" of a problem; NULL when there is nothing. */
static json_t *document_faults(const struct http_request *r)
{
    struct job_fault_list *list = calloc(1, sizeof *list);
    struct job_outline outline = {.n_file = 0};
    json_t *extra = NULL;
    if (list == NULL) return NULL;
    job_outline_inspect(r->body, r->n_body, &outline, list);
    if (list->n > 0) extra = json_pack("{s:o}", "errors", job_faults_json(list));
    job_outline_release(&outline);
    free(list);
    return extra;
}

static void reply_refusal(struct http_request *r, const struct job_refusal *refusal, const struct error *err)
{
    reply_problem(r, refusal->code, err, refusal->extra);
}

/* Replies and returns false when the body is not JSON. JSON that is not a valid job document gets a 422 later. */
static bool body_is_json(struct http_request *r)
{
    json_t *j = request_json(r);
    json_decref(j);
    return j != NULL;
}

void handle_create_job(struct http_request *r)
{
    char id[STORE_ID_BYTES];
    bool replayed;
    struct job_refusal refusal = {0};
    struct error err = {0};
    const char *key = request_header(r, "Idempotency-Key");
    size_t n_key = key == NULL ? 1 : strlen(key);
    for (size_t i = 0; key != NULL && i < n_key; i++)
        if (key[i] < 33 || key[i] > 126) n_key = 0;
    if (n_key < 1 || n_key > 128) {
        error_set_field(&err, STATUS_INVALID, "Idempotency-Key", "the key must have 1 to 128 printable characters");
        reply_problem(r, NULL, &err, NULL);
        return;
    }
    if (!body_is_json(r)) return;
    const struct job_request request = {r->body, r->n_body, key, &r->grant};
    if (job_create(r->service, &request, id, &replayed, &refusal, &err) != STATUS_OK)
        if (err.code == STATUS_INVALID && refusal.code == NULL)
            reply_problem(r, NULL, &err, document_faults(r));
        else
            reply_refusal(r, &refusal, &err);
    else
        reply_new_job(r, id, replayed);
}

void handle_get_job(struct http_request *r)
{
    struct long_poll poll;
    if (!long_poll_begin(r, r->param[0], &poll)) return;
    do {
        if (!job_not_modified(r)) reply_job(r, r->param[0], MHD_HTTP_OK, false, false);
    } while (long_poll_again(r, &poll));
}

struct precondition {
    struct http_request *request;
    const char *wanted; /* If-Match */
    bool failed;
};

static status check_tag(void *context, const struct job_row *row, struct error *err)
{
    struct precondition *p = context;
    char tag[JOB_TAG_BYTES];
    status s = job_view_tag(p->request->service, row, tag, err);
    if (s != STATUS_OK) return s;
    p->failed = !tag_matches(p->wanted, tag);
    return p->failed ? error_set_field(err, STATUS_CONFLICT, "If-Match",
                                       "the job has changed since it was read; get it again")
                     : STATUS_OK;
}

void handle_replace_document(struct http_request *r)
{
    struct error err = {0};
    struct precondition p = {.request = r, .wanted = request_header(r, "If-Match")};
    if (!body_is_json(r)) return;
    status s = job_replace_document(r->service, r->param[0], r->body, r->n_body, p.wanted != NULL ? check_tag : NULL,
                                    &p, &err);
    if (s != STATUS_OK)
        reply_problem(r, p.failed ? "precondition" : NULL, &err, s == STATUS_INVALID ? document_faults(r) : NULL);
    else
        reply_job(r, r->param[0], MHD_HTTP_OK, false, false);
}

void handle_delete_job(struct http_request *r)
{
    struct error err = {0};
    if (job_delete(r->service, r->param[0], &err) != STATUS_OK)
        reply_problem(r, NULL, &err, NULL);
    else
        reply_empty(r, MHD_HTTP_NO_CONTENT);
}

void reply_new_job(struct http_request *r, const char *id, bool replayed)
{
    reply_job(r, id, MHD_HTTP_CREATED, true, replayed);
}

static void begin_job(struct http_request *r, bool retry)
{
    bool changed;
    struct job_refusal refusal = {0};
    struct error err = {0};
    long long priority;
    bool given = MHD_lookup_connection_value(r->connection, MHD_GET_ARGUMENT_KIND, "priority") != NULL;
    if (!query_integer(r, "priority", -PRIORITY_MOST, PRIORITY_MOST, 0, &priority)) return;
    const int64_t wanted = priority;
    status s =
        (retry ? job_retry : job_start)(r->service, r->param[0], given ? &wanted : NULL, &changed, &refusal, &err);
    if (s != STATUS_OK)
        reply_refusal(r, &refusal, &err);
    else
        reply_job(r, r->param[0], changed ? MHD_HTTP_ACCEPTED : MHD_HTTP_OK, false, false);
}

/* Whether a start would queue the job: only then are its files judged, on request. */
static bool would_start(struct http_request *r)
{
    struct job_row row;
    return job_look(r->service, r->param[0], &row, NULL) == STATUS_OK &&
           (row.state == JOB_DRAFT || row.state == JOB_FAILED || row.state == JOB_CANCELLED);
}

void handle_start_job(struct http_request *r)
{
    long long check;
    if (!query_integer(r, "check", 0, 1, 0, &check)) return;
    if (check == 0 || !would_start(r) || check_inputs(r)) begin_job(r, false);
}
void handle_retry_job(struct http_request *r) { begin_job(r, true); }

void handle_cancel_job(struct http_request *r)
{
    bool running;
    struct error err = {0};
    if (job_cancel(r->service, r->param[0], &running, &err) != STATUS_OK)
        reply_problem(r, NULL, &err, NULL);
    else
        reply_job(r, r->param[0], running ? MHD_HTTP_ACCEPTED : MHD_HTTP_OK, false, false);
}
