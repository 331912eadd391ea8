/* The picture and the twin that are made after the result of a job. */
#include "server/endpoints/handlers.h"
#include "server/http/http_reply.h"
#include "server/workers/picture_maker.h"

/* Replies with the stage of the job, or with the error. */
static void reply_pictures(struct http_request *r, status s, const struct error *err)
{
    if (s != STATUS_OK)
        reply_problem(r, NULL, err, NULL);
    else
        reply_json(r, MHD_HTTP_OK, picture_list_view(r->service, r->param[0]));
}

static status find(struct http_request *r, enum job_state *state, struct error *err)
{
    struct job_row row = {0};
    status s = job_get(r->service, r->param[0], &row, err);
    *state = row.state;
    job_row_release(&row);
    return s;
}

void handle_get_pictures(struct http_request *r)
{
    struct error err = {0};
    enum job_state state;
    reply_pictures(r, find(r, &state, &err), &err);
}

void handle_start_pictures(struct http_request *r)
{
    struct error err = {0};
    enum job_state state;
    status s = find(r, &state, &err);
    if (s == STATUS_OK && (state != JOB_SUCCEEDED || !picture_list_exists(r->service)))
        s = error_set(&err, STATUS_CONFLICT, "no pictures can be made: %s",
                      state != JOB_SUCCEEDED ? "the job has not succeeded" : "this service makes none (jobs.pictures)");
    if (s == STATUS_OK) picture_list_add(r->service, r->param[0]);
    reply_pictures(r, s, &err);
}

void handle_stop_pictures(struct http_request *r)
{
    struct error err = {0};
    enum job_state state;
    status s = find(r, &state, &err);
    if (s == STATUS_OK) picture_list_remove(r->service, r->param[0]);
    reply_pictures(r, s, &err);
}
