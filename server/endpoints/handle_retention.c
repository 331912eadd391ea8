/* Removing finished jobs by age and size, and keeping single ones. */
#include "server/endpoints/handlers.h"
#include "server/endpoints/request_json.h"
#include "server/http/http_reply.h"
#include "server/retention/job_keep.h"
#include "server/retention/retention.h"

enum { LIST_MOST = 500, LIST_USUAL = 50, MAX_AGE_DAYS = 36500, JOBS_MOST = 1000 };

static json_t *limit_or_null(long long limit) { return limit > 0 ? json_integer((json_int_t)limit) : json_null(); }

void handle_plan_retention(struct http_request *r)
{
    const struct settings *set = r->service->settings;
    struct retention_plan plan;
    struct error err = {0};
    long long days, bytes;
    if (!query_integer(r, "max_age_days", 0, MAX_AGE_DAYS, set->retention_max_age_days, &days) ||
        !query_integer(r, "max_bytes", 0, INT64_MAX / 2, set->retention_max_bytes, &bytes))
        return;
    const struct retention_limits limits = {.max_age_days = days, .max_bytes = bytes};
    if (retention_plan_make(r->service, &limits, &plan, &err) != STATUS_OK) {
        reply_problem(r, NULL, &err, NULL);
        return;
    }
    json_t *list = json_array();
    for (size_t i = 0; i < plan.n; i++) json_array_append_new(list, retention_job_view(&plan.job[i]));
    reply_json(r, MHD_HTTP_OK,
               json_pack("{s:o,s:o,s:o,s:I,s:I,s:I}", "max_age_days", limit_or_null(days), "max_bytes",
                         limit_or_null(bytes), "jobs", list, "removed_bytes", (json_int_t)plan.removed_bytes,
                         "total_bytes", (json_int_t)plan.total_bytes, "n_kept", (json_int_t)plan.n_kept));
    retention_plan_release(&plan);
}

/* The list "jobs" of the body, or NULL after a reply. */
static json_t *read_jobs(struct http_request *r)
{
    json_t *body = request_json(r);
    if (body == NULL) return NULL;
    json_t *jobs = json_incref(json_object_get(body, "jobs")), *one;
    bool good = json_is_array(jobs) && json_array_size(jobs) <= JOBS_MOST && json_object_size(body) == 1;
    size_t i;
    json_array_foreach(jobs, i, one) good = good && json_is_string(one);
    json_decref(body);
    if (good) return jobs;
    json_decref(jobs);
    struct error err = {0};
    error_set_field(&err, STATUS_INVALID, "jobs",
                    "the body must be {\"jobs\": [...]}, a list of at most %d ids of jobs", (int)JOBS_MOST);
    reply_problem(r, NULL, &err, NULL);
    return NULL;
}

void handle_remove_by_retention(struct http_request *r)
{
    json_t *jobs = read_jobs(r), *one, *removed = json_array(), *left = json_array();
    int64_t bytes = 0;
    size_t i;
    if (jobs == NULL) goto out;
    json_array_foreach(jobs, i, one)
    {
        struct retention_job job = {0};
        struct error err = {0};
        const char *id = json_string_value(one);
        if (retention_remove(r->service, id, RETENTION_REQUEST, &job, &err) == STATUS_OK) {
            bytes += job.bytes;
            json_array_append_new(removed, retention_job_view(&job));
        } else
            json_array_append_new(left, json_pack("{s:s,s:s}", "id", id, "why", err.text));
    }
    reply_json(r, MHD_HTTP_OK,
               json_pack("{s:O,s:I,s:O}", "removed", removed, "removed_bytes", (json_int_t)bytes, "not_removed", left));
out:
    json_decref(jobs);
    json_decref(removed);
    json_decref(left);
}

void handle_list_removals(struct http_request *r)
{
    struct error err = {0};
    long long limit;
    json_t *list = NULL;
    if (!query_integer(r, "limit", 1, LIST_MOST, LIST_USUAL, &limit)) return;
    if (retention_removals(r->service, (size_t)limit, &list, &err) != STATUS_OK)
        reply_problem(r, NULL, &err, NULL);
    else
        reply_json_tagged(r, json_pack("{s:o}", "removals", list));
}

static void set_kept(struct http_request *r, bool keep)
{
    struct error err = {0};
    if (job_keep(r->service, r->param[0], keep, &err) != STATUS_OK)
        reply_problem(r, NULL, &err, NULL);
    else
        reply_empty(r, MHD_HTTP_NO_CONTENT);
}

void handle_keep_job(struct http_request *r) { set_kept(r, true); }
void handle_unkeep_job(struct http_request *r) { set_kept(r, false); }
