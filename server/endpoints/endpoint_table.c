#include "server/endpoints/endpoint_table.h"
#include "server/endpoints/handlers.h"

#include <stdio.h>
#include <string.h>

static const struct http_route route[] = {
    {"GET", "/v1/jobs", HTTP_BODY_NONE, ACCESS_READ, handle_list_jobs, NULL, NULL,
     "limit cursor wait state verdict tag batch sample id created_after created_before sort order view have"},
    {"POST", "/v1/jobs", HTTP_BODY_JSON, ACCESS_SUBMIT, handle_create_job, NULL, NULL, ""},
    {"POST", "/v1/check", HTTP_BODY_JSON, ACCESS_SUBMIT, handle_check_document, NULL, NULL, ""},
    {"GET", "/v1/jobs/{id}", HTTP_BODY_NONE, ACCESS_READ, handle_get_job, NULL, NULL, "wait"},
    {"DELETE", "/v1/jobs/{id}", HTTP_BODY_NONE, ACCESS_SUBMIT, handle_delete_job, NULL, NULL, ""},
    {"PUT", "/v1/jobs/{id}/document", HTTP_BODY_JSON, ACCESS_SUBMIT, handle_put_document, NULL, NULL, ""},
    {"POST", "/v1/jobs/{id}/start", HTTP_BODY_NONE, ACCESS_SUBMIT, handle_start_job, NULL, NULL, "priority check"},
    {"POST", "/v1/jobs/{id}/check", HTTP_BODY_NONE, ACCESS_SUBMIT, handle_check_job, NULL, NULL, ""},
    {"POST", "/v1/jobs/{id}/plan", HTTP_BODY_NONE, ACCESS_SUBMIT, handle_plan_job, NULL, NULL, ""},
    {"POST", "/v1/jobs/{id}/cancel", HTTP_BODY_NONE, ACCESS_SUBMIT, handle_cancel_job, NULL, NULL, ""},
    {"POST", "/v1/jobs/{id}/retry", HTTP_BODY_NONE, ACCESS_SUBMIT, handle_retry_job, NULL, NULL, "priority"},
    {"PUT", "/v1/jobs/{id}/tags", HTTP_BODY_JSON, ACCESS_SUBMIT, handle_put_tags, NULL, NULL, ""},
    {"GET", "/v1/tags", HTTP_BODY_NONE, ACCESS_READ, handle_list_tags, NULL, NULL, ""},
    {"POST", "/v1/actions", HTTP_BODY_JSON, ACCESS_SUBMIT, handle_act_on_jobs, NULL, NULL, ""},
    {"GET", "/v1/batches", HTTP_BODY_NONE, ACCESS_READ, handle_list_batches, NULL, NULL, "limit cursor"},
    {"POST", "/v1/batches", HTTP_BODY_BATCH, ACCESS_SUBMIT, handle_submit_batch, NULL, NULL, ""},
    {"GET", "/v1/batches/{batch}", HTTP_BODY_NONE, ACCESS_READ, handle_get_batch, NULL, NULL, "wait"},
    {"DELETE", "/v1/batches/{batch}", HTTP_BODY_NONE, ACCESS_SUBMIT, handle_delete_batch, NULL, NULL, "jobs"},
    {"POST", "/v1/batches/{batch}/start", HTTP_BODY_NONE, ACCESS_SUBMIT, handle_start_batch, NULL, NULL, "priority"},
    {"POST", "/v1/batches/{batch}/retry", HTTP_BODY_NONE, ACCESS_SUBMIT, handle_retry_batch, NULL, NULL, "priority"},
    {"POST", "/v1/batches/{batch}/cancel", HTTP_BODY_NONE, ACCESS_SUBMIT, handle_cancel_batch, NULL, NULL, ""},
    {"GET", "/v1/batches/{batch}/plan", HTTP_BODY_NONE, ACCESS_READ, handle_batch_plan, NULL, NULL, "cores"},
    {"GET", "/v1/batches/{batch}/results.json", HTTP_BODY_NONE, ACCESS_READ, handle_batch_results, NULL, NULL, ""},
    {"GET", "/v1/batches/{batch}/results.csv", HTTP_BODY_NONE, ACCESS_READ, handle_batch_csv, NULL, NULL, ""},
    {"GET", "/v1/jobs/{id}/files", HTTP_BODY_NONE, ACCESS_READ, handle_list_files, NULL, NULL, ""},
    {"POST", "/v1/jobs/{id}/files", HTTP_BODY_JSON, ACCESS_SUBMIT, handle_declare_files, NULL, NULL, ""},
    {"GET", "/v1/jobs/{id}/files/{name}", HTTP_BODY_NONE, ACCESS_READ, handle_get_file, NULL, NULL, ""},
    {"DELETE", "/v1/jobs/{id}/files/{name}", HTTP_BODY_NONE, ACCESS_SUBMIT, handle_delete_file, NULL, NULL, ""},
    {"GET", "/v1/inputs", HTTP_BODY_NONE, ACCESS_READ, handle_find_input, NULL, NULL, "sha256"},
    {"HEAD", "/v1/uploads/{upload}", HTTP_BODY_NONE, ACCESS_READ, handle_upload_offset, NULL, NULL, ""},
    {"PATCH", "/v1/uploads/{upload}", HTTP_BODY_UPLOAD, ACCESS_SUBMIT, handle_upload_end, handle_upload_begin,
     handle_upload_abandoned, ""},
    {"DELETE", "/v1/uploads/{upload}", HTTP_BODY_NONE, ACCESS_SUBMIT, handle_upload_delete, NULL, NULL, ""},
    {"OPTIONS", "/v1/uploads/{upload}", HTTP_BODY_NONE, ACCESS_READ, handle_upload_options, NULL, NULL, ""},
    {"GET", "/v1/jobs/{id}/series", HTTP_BODY_NONE, ACCESS_READ, handle_series, NULL, NULL,
     "after_step max_points rendered"},
    {"GET", "/v1/jobs/{id}/log", HTTP_BODY_NONE, ACCESS_READ, handle_log, NULL, NULL, "offset max_bytes"},
    {"GET", "/v1/jobs/{id}/results", HTTP_BODY_NONE, ACCESS_READ, handle_list_results, NULL, NULL, ""},
    {"GET", "/v1/jobs/{id}/results.tar", HTTP_BODY_NONE, ACCESS_READ, handle_archive, NULL, NULL, ""},
    {"GET", "/v1/jobs/{id}/results/{path...}", HTTP_BODY_NONE, ACCESS_READ, handle_get_result, NULL, NULL, ""},
    {"GET", "/v1/jobs/{id}/versions", HTTP_BODY_NONE, ACCESS_READ, handle_list_versions, NULL, NULL, ""},
    {"GET", "/v1/jobs/{id}/versions/{version}", HTTP_BODY_NONE, ACCESS_READ, handle_get_version, NULL, NULL, ""},
    {"GET", "/v1/jobs/{id}/versions/{version}/{path...}", HTTP_BODY_NONE, ACCESS_READ, handle_version_file, NULL, NULL,
     ""},
    {"PUT", "/v1/jobs/{id}/keep", HTTP_BODY_NONE, ACCESS_SUBMIT, handle_keep_job, NULL, NULL, ""},
    {"DELETE", "/v1/jobs/{id}/keep", HTTP_BODY_NONE, ACCESS_SUBMIT, handle_unkeep_job, NULL, NULL, ""},
    {"GET", "/v1/retention", HTTP_BODY_NONE, ACCESS_ADMIN, handle_plan_retention, NULL, NULL, "max_age_days max_bytes"},
    {"POST", "/v1/retention", HTTP_BODY_JSON, ACCESS_ADMIN, handle_remove_by_retention, NULL, NULL, ""},
    {"GET", "/v1/removals", HTTP_BODY_NONE, ACCESS_ADMIN, handle_list_removals, NULL, NULL, "limit"},
    {"GET", "/v1/deliveries", HTTP_BODY_NONE, ACCESS_READ, handle_list_deliveries, NULL, NULL, "job limit cursor"},
    {"GET", "/v1/tokens", HTTP_BODY_NONE, ACCESS_ADMIN, handle_list_tokens, NULL, NULL, "limit cursor"},
    {"POST", "/v1/tokens", HTTP_BODY_JSON, ACCESS_ADMIN, handle_make_token, NULL, NULL, ""},
    {"DELETE", "/v1/tokens/{token}", HTTP_BODY_NONE, ACCESS_ADMIN, handle_revoke_token, NULL, NULL, ""},
    {"GET", "/v1/session", HTTP_BODY_NONE, ACCESS_READ, handle_get_session, NULL, NULL, ""},
    {"POST", "/v1/session", HTTP_BODY_JSON, ACCESS_OPEN, handle_sign_in, NULL, NULL, ""},
    {"DELETE", "/v1/session", HTTP_BODY_NONE, ACCESS_OPEN, handle_sign_out, NULL, NULL, ""},
    {"GET", "/v1/about", HTTP_BODY_NONE, ACCESS_READ, handle_about, NULL, NULL, ""},
    {"GET", "/v1/options", HTTP_BODY_NONE, ACCESS_READ, handle_options, NULL, NULL, ""},
    {"GET", "/v1/openapi.json", HTTP_BODY_NONE, ACCESS_READ, handle_openapi, NULL, NULL, ""},
    {"GET", "/livez", HTTP_BODY_NONE, ACCESS_OPEN, handle_livez, NULL, NULL, NULL},
    {"GET", "/readyz", HTTP_BODY_NONE, ACCESS_READ, handle_readyz, NULL, NULL, NULL},
    {"GET", "/metrics", HTTP_BODY_NONE, ACCESS_READ, handle_metrics, NULL, NULL, NULL},
    {"GET", "/", HTTP_BODY_NONE, ACCESS_OPEN, handle_static, NULL, NULL, NULL},
    {"GET", "/{path...}", HTTP_BODY_NONE, ACCESS_OPEN, handle_static, NULL, NULL, NULL},
};

static bool match(const char *pattern, const char *url, char param[HTTP_N_PARAM][HTTP_PARAM_BYTES])
{
    size_t i_param = 0;
    while (*pattern != '\0') {
        if (*pattern != '{') {
            if (*pattern++ != *url++) return false;
            continue;
        }
        const char *end = strchr(pattern, '}');
        bool rest = strncmp(end - 3, "...", 3) == 0;
        size_t n = rest ? strlen(url) : strcspn(url, "/");
        if (n == 0 || n >= HTTP_PARAM_BYTES || i_param == HTTP_N_PARAM) return false;
        memcpy(param[i_param], url, n);
        param[i_param++][n] = '\0';
        url += n;
        pattern = end + 1;
    }
    return *url == '\0';
}

const struct http_route *endpoint_find(const char *method, const char *url, char param[HTTP_N_PARAM][HTTP_PARAM_BYTES],
                                       char *allow, size_t n_allow)
{
    size_t n = 0;
    allow[0] = '\0';
    bool head = strcmp(method, "HEAD") == 0;
    for (size_t i = 0; i < sizeof route / sizeof route[0]; i++) {
        const struct http_route *r = &route[i];
        if (r->handle == handle_static && strncmp(url, "/v1/", 4) == 0) continue;
        if (!match(r->path, url, param)) continue;
        if (strcmp(r->method, method) == 0 || (head && strcmp(r->method, "GET") == 0)) return r;
        if (n < n_allow) n += (size_t)snprintf(allow + n, n_allow - n, "%s%s", n > 0 ? ", " : "", r->method);
    }
    return NULL;
}
