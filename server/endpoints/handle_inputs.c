/* Checks before a client sends or starts something: faults of a document or of a job's files, and inputs that the
 * server has already. */
#include "optimizer/job/checks/job_faults.h"
#include "optimizer/job/job_outline.h"
#include "server/endpoints/handlers.h"
#include "server/endpoints/request_json.h"
#include "server/files/known_input.h"
#include "server/http/http_reply.h"
#include "server/jobs/job_service.h"
#include "server/workers/input_judge.h"

#include <stdlib.h>
#include <string.h>

/* Makes nothing; the answer to a document with faults is no error. */
void handle_check_document(struct http_request *r)
{
    struct error err = {0};
    struct job_outline outline = {.n_file = 0};
    json_t *body = request_json(r), *files = json_array();
    if (body == NULL) {
        json_decref(files);
        return;
    }
    json_decref(body);
    struct job_fault_list *list = calloc(1, sizeof *list);
    if (list != NULL) job_outline_inspect(r->body, r->n_body, &outline, list);
    for (size_t i = 0; i < outline.n_file; i++)
        json_array_append_new(files,
                              json_pack("{s:s,s:s}", "name", outline.file[i].name, "role", outline.file[i].role));
    if (list == NULL) {
        json_decref(files);
        error_set(&err, STATUS_NO_MEMORY, "cannot check the document: out of memory");
        reply_problem(r, NULL, &err, NULL);
    } else
        reply_json(r, MHD_HTTP_OK,
                   json_pack("{s:b,s:o,s:o}", "valid", list->n == 0, "errors", job_faults_json(list), "files", files));
    job_outline_release(&outline);
    free(list);
}

/* The faults of the job's files; NULL after a reply. */
static json_t *judge(struct http_request *r)
{
    json_t *report = NULL;
    struct error err = {0};
    struct job_refusal refusal = {0};
    if (input_judge(r->service, r->param[0], &report, &refusal, &err) == STATUS_OK) return report;
    reply_problem(r, refusal.code, &err, NULL);
    return NULL;
}

void handle_check_job(struct http_request *r)
{
    json_t *report = judge(r);
    if (report != NULL) reply_json(r, MHD_HTTP_OK, report);
}

void handle_plan_job(struct http_request *r)
{
    json_t *plan = NULL;
    struct error err = {0};
    struct job_refusal refusal = {0};
    if (input_plan(r->service, r->param[0], &plan, &refusal, &err) == STATUS_OK)
        reply_json(r, MHD_HTTP_OK, plan);
    else
        reply_problem(r, refusal.code, &err, NULL);
}

bool check_inputs(struct http_request *r)
{
    struct error err = {0};
    json_t *report = judge(r);
    if (report == NULL) return false;
    json_t *errors = json_object_get(report, "errors"), *first = json_array_get(errors, 0);
    const size_t n = json_array_size(errors);
    if (n > 0) {
        const char *field = json_string_value(json_object_get(first, "field")),
                   *detail = json_string_value(json_object_get(first, "detail"));
        error_set_field(&err, STATUS_INVALID, field != NULL ? field : "",
                        n == 1 ? "%s" : "%s (the first of %zu faults of the input)", detail != NULL ? detail : "", n);
        reply_problem(r, NULL, &err,
                      json_pack("{s:O, s:O}", "errors", errors, "warnings", json_object_get(report, "warnings")));
    }
    json_decref(report);
    return n == 0;
}

void handle_find_input(struct http_request *r)
{
    struct error err = {0};
    struct file_row file;
    const char *sum = MHD_lookup_connection_value(r->connection, MHD_GET_ARGUMENT_KIND, "sha256");
    if (sum == NULL || strlen(sum) != 64 || strspn(sum, "0123456789abcdef") != 64) {
        error_set_field(&err, STATUS_INVALID, "sha256",
                        "query parameter 'sha256' must be a SHA-256 of 64 hexadecimal digits in lower case");
        reply_problem(r, NULL, &err, NULL);
        return;
    }
    status s = known_input_find(r->service->store, r->service->settings->data, r->grant.owner, sum, &file, &err);
    if (s != STATUS_OK && s != STATUS_NOT_FOUND)
        reply_problem(r, NULL, &err, NULL);
    else if (s == STATUS_NOT_FOUND)
        reply_json(r, MHD_HTTP_OK,
                   json_pack("{s:s,s:b,s:n,s:n,s:n}", "sha256", sum, "known", 0, "size", "job", "name"));
    else
        reply_json(r, MHD_HTTP_OK,
                   json_pack("{s:s,s:b,s:I,s:s,s:s}", "sha256", sum, "known", 1, "size", (json_int_t)file.size_bytes,
                             "job", file.job_id, "name", file.name));
}
