/* Tags of jobs, and actions on many jobs at once. */
#include "server/endpoints/handlers.h"
#include "server/endpoints/request_json.h"
#include "server/http/http_reply.h"
#include "server/jobs/job_tags.h"
#include "server/jobs/problem_code.h"
#include "server/settings/job_paths.h"
#include "server/views/job_view.h"

#include <stdlib.h>
#include <string.h>

enum { ACTION_MOST = 500 };

void handle_list_tags(struct http_request *r)
{
    struct tag_count *tag = NULL;
    size_t n = 0;
    struct error err = {0};
    if (store_tag_count(r->service->store, r->grant.all ? NULL : r->grant.owner, &tag, &n, &err) != STATUS_OK) {
        reply_problem(r, NULL, &err, NULL);
        return;
    }
    json_t *list = json_array();
    for (size_t i = 0; i < n; i++)
        json_array_append_new(list, json_pack("{s:s,s:I}", "tag", tag[i].tag, "jobs", (json_int_t)tag[i].n));
    free(tag);
    reply_json_tagged(r, json_pack("{s:o}", "tags", list));
}

/* Refuses members of a body that are not among the names between spaces. */
static status check_members(const json_t *body, const char *known, struct error *err)
{
    const char *key;
    json_t *value;
    if (!json_is_object(body)) return error_set(err, STATUS_INVALID, "the body must be an object");
    json_object_foreach((json_t *)body, key, value)
    {
        const char *at = strchr(key, ' ') == NULL ? strstr(known, key) : NULL;
        if (at == NULL || key[0] == '\0' || at[-1] != ' ' || at[strlen(key)] != ' ')
            return error_set_field(err, STATUS_INVALID, key, "there is no member '%.60s' here", key);
    }
    return STATUS_OK;
}

void handle_put_tags(struct http_request *r)
{
    struct error err = {0};
    struct job_row row;
    bool changed;
    json_t *body = request_json(r), *view = NULL;
    if (body == NULL) return;
    const struct tag_edit edit = {.add = json_object_get(body, "tags"), .replace = true};
    status s = check_members(body, " tags ", &err);
    if (s == STATUS_OK && edit.add == NULL)
        s = error_set_field(&err, STATUS_INVALID, "tags", "the body must be {\"tags\": [...]}");
    if (s == STATUS_OK) s = job_tags_check(edit.add, "tags", &err);
    if (s == STATUS_OK) s = job_edit_tags(r->service, r->param[0], &edit, &changed, &err);
    if (s == STATUS_OK) s = job_look(r->service, r->param[0], &row, &err);
    if (s == STATUS_OK) s = job_view(r->service, &row, false, &view, &err);
    if (s == STATUS_OK)
        reply_json(r, MHD_HTTP_OK, view);
    else
        reply_problem(r, NULL, &err, NULL);
    json_decref(body);
}

/* A request to act on jobs. */
struct job_action {
    const char *name;
    struct tag_edit tags;
};

/* *changed: whether the job is other than before. */
static status act(struct job_service *v, const struct job_action *a, const char *id, bool *changed,
                  struct job_refusal *refusal, struct error *err)
{
    struct job_row before;
    bool running;
    if (strcmp(a->name, "tag") == 0) return job_edit_tags(v, id, &a->tags, changed, err);
    if (strcmp(a->name, "retry") == 0) return job_retry(v, id, NULL, changed, refusal, err);
    if (strcmp(a->name, "start") == 0) return job_start(v, id, NULL, changed, refusal, err);
    *changed = true;
    if (strcmp(a->name, "delete") == 0) return job_delete(v, id, err);
    status s = job_look(v, id, &before, err);
    if (s == STATUS_OK) s = job_cancel(v, id, &running, err);
    *changed = before.state < JOB_SUCCEEDED && !before.cancel_requested;
    return s;
}

static status check_owner(struct http_request *r, const char *id, struct error *err)
{
    char owner[STORE_OWNER_BYTES] = "";
    if (r->grant.all) return STATUS_OK;
    status s = id_valid(id) ? store_job_owner(r->service->store, id, owner, err) : STATUS_NOT_FOUND;
    if (s == STATUS_OK && strcmp(owner, r->grant.owner) == 0) return STATUS_OK;
    return error_set(err, STATUS_NOT_FOUND, "job '%.40s' does not exist", id);
}

static json_t *outcome_of(struct http_request *r, const struct job_action *a, const char *id)
{
    struct job_refusal refusal = {0};
    struct error err = {0};
    struct job_row row;
    bool changed = false;
    status s = check_owner(r, id, &err);
    if (s == STATUS_OK) s = act(r->service, a, id, &changed, &refusal, &err);
    json_decref(refusal.extra);
    if (s != STATUS_OK)
        return json_pack("{s:s,s:s,s:s,s:s}", "id", id, "outcome", "refused", "code",
                         refusal.code != NULL ? refusal.code : http_problem_of_status(s)->code, "detail", err.text);
    json_t *out = json_pack("{s:s,s:s}", "id", id, "outcome", changed ? "done" : "unchanged");
    if (job_look(r->service, id, &row, NULL) == STATUS_OK)
        json_object_set_new(out, "state", json_string(job_state_name(row.state)));
    return out;
}

static status read_action(const json_t *body, struct job_action *a, struct error *err)
{
    static const char *const known[] = {"cancel", "retry", "start", "delete", "tag"};
    const json_t *jobs = json_object_get(body, "jobs"), *one;
    size_t i = 0, k;
    status s = check_members(body, " action jobs add_tags remove_tags ", err);
    if (s != STATUS_OK) return s;
    a->name = json_string_value(json_object_get(body, "action"));
    while (a->name != NULL && i < 5 && strcmp(a->name, known[i]) != 0) i++;
    if (a->name == NULL || i == 5)
        return error_set_field(err, STATUS_INVALID, "action", "'action' must be cancel, retry, start, delete or tag");
    bool good = json_is_array(jobs) && json_array_size(jobs) <= ACTION_MOST;
    if (good) json_array_foreach(jobs, k, one) good = good && json_is_string(one);
    if (!good)
        return error_set_field(err, STATUS_INVALID, "jobs", "'jobs' must be a list of at most %d ids of jobs",
                               (int)ACTION_MOST);
    a->tags =
        (struct tag_edit){.add = json_object_get(body, "add_tags"), .remove = json_object_get(body, "remove_tags")};
    if (strcmp(a->name, "tag") != 0 && (a->tags.add != NULL || a->tags.remove != NULL))
        return error_set_field(err, STATUS_INVALID, a->tags.add != NULL ? "add_tags" : "remove_tags",
                               "only the action tag takes tags");
    s = job_tags_check(a->tags.add, "add_tags", err);
    return s == STATUS_OK ? job_tags_check(a->tags.remove, "remove_tags", err) : s;
}

void handle_act_on_jobs(struct http_request *r)
{
    struct error err = {0};
    struct job_action a = {0};
    json_t *body = request_json(r), *one;
    size_t i;
    if (body == NULL) return;
    if (read_action(body, &a, &err) != STATUS_OK)
        reply_problem(r, NULL, &err, NULL);
    else {
        json_t *list = json_array();
        json_array_foreach(json_object_get(body, "jobs"), i, one)
            json_array_append_new(list, outcome_of(r, &a, json_string_value(one)));
        reply_json(r, MHD_HTTP_OK, json_pack("{s:o}", "results", list));
    }
    json_decref(body);
}
