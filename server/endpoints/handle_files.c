#include "optimizer/job/job_folder.h"
#include "server/endpoints/handlers.h"
#include "server/http/http_reply.h"
#include "server/jobs/job_paths.h"
#include "server/jobs/job_view.h"

#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

void handle_list_files(struct http_request *r)
{
    struct job_row row;
    struct error err = {0};
    json_t *view = NULL;
    status s = job_get(r->service, r->param[0], &row, &err);
    if (s == STATUS_OK) s = job_view_files(r->service, &row, &view, &err);
    job_row_release(&row);
    if (s != STATUS_OK)
        reply_problem(r, NULL, &err, NULL);
    else
        reply_json_tagged(r, view);
}

static status member_text(const json_t *j, const char *name, char *out, size_t n_out, bool optional, struct error *err)
{
    const json_t *x = json_object_get(j, name);
    if (optional && (x == NULL || json_is_null(x))) return STATUS_OK;
    if (!json_is_string(x)) return error_set_field(err, STATUS_INVALID, name, "member '%s' must be a string", name);
    if (json_string_length(x) >= n_out || strlen(json_string_value(x)) != json_string_length(x))
        return error_set_field(err, STATUS_INVALID, name, "member '%s' is too long", name);
    snprintf(out, n_out, "%s", json_string_value(x));
    return STATUS_OK;
}

static status read_declaration(const json_t *j, struct file_row *row, struct error *err)
{
    static const char *const known[] = {"name", "role", "size", "sha256"};
    const char *key;
    json_t *value;
    if (!json_is_object(j))
        return error_set(err, STATUS_INVALID, "a file declaration is an object {name, role, size, sha256}");
    json_object_foreach((json_t *)(uintptr_t)j, key, value)
    {
        bool found = false;
        for (size_t i = 0; i < 4; i++) found = found || strcmp(key, known[i]) == 0;
        if (!found)
            return error_set_field(err, STATUS_INVALID, key,
                                   "a file declaration has no member '%.80s'; its members are name, role, size, sha256",
                                   key);
    }
    const json_t *size = json_object_get(j, "size");
    if (!json_is_integer(size))
        return error_set_field(err, STATUS_INVALID, "size", "member 'size' must be a whole number of bytes");
    row->size_bytes = json_integer_value(size);
    status s = member_text(j, "name", row->name, sizeof row->name, false, err);
    if (s == STATUS_OK) s = member_text(j, "role", row->role, sizeof row->role, false, err);
    return s == STATUS_OK ? member_text(j, "sha256", row->sha256, sizeof row->sha256, true, err) : s;
}

void handle_declare_file(struct http_request *r)
{
    struct error err = {0};
    struct file_row row = {0};
    struct job_refusal refusal = {0};
    bool existed = false;
    json_error_t where;
    char upload[80], text[256];
    json_t *j = json_loadb(r->body, r->n_body, JSON_REJECT_DUPLICATES, &where);
    if (j == NULL) {
        snprintf(text, sizeof text, "the body is not JSON: line %d, column %d: %s", where.line, where.column,
                 where.text);
        reply_code(r, "malformed", "", text);
        return;
    }
    status s = read_declaration(j, &row, &err);
    json_decref(j);
    if (s == STATUS_OK) s = job_declare_file(r->service, r->param[0], &row, &existed, &refusal, &err);
    if (s != STATUS_OK) {
        reply_problem(r, refusal.code, &err, NULL);
        return;
    }
    upload_refresh(r->service->upload, &row);
    reply_json(r, existed ? MHD_HTTP_OK : MHD_HTTP_CREATED, file_view(&row));
    snprintf(upload, sizeof upload, "/v1/uploads/%s", row.id);
    reply_header(r, "Location", upload);
}

void handle_get_file(struct http_request *r)
{
    struct job_row job;
    struct file_row file;
    struct error err = {0};
    char path[PATH_BYTES];
    status s = job_get(r->service, r->param[0], &job, &err);
    job_row_release(&job);
    /* the name only selects a row; the path is built from the row, never from the request */
    if (s == STATUS_OK) s = store_file_find(r->service->store, r->param[0], r->param[1], &file, &err);
    if (s == STATUS_OK && file.state != FILE_COMPLETE)
        s = error_set(&err, STATUS_CONFLICT, "file '%s' is not complete", file.name);
    if (s != STATUS_OK) {
        reply_problem(r, NULL, &err, NULL);
        return;
    }
    path_join(path, r->service->settings->data, "jobs", file.job_id, JOB_FOLDER_INPUT, file.name, NULL);
    int fd = open(path, O_RDONLY | O_NOFOLLOW | O_CLOEXEC);
    if (fd < 0) {
        error_set_errno(&err, "cannot read file '%s'", file.name);
        reply_problem(r, NULL, &err, NULL);
        return;
    }
    reply_file(r, fd, content_type_of(file.name));
    /* files from users are sandboxed, so that they never act as pages of this site */
    reply_header(r, "Content-Security-Policy", "sandbox");
}

void handle_delete_file(struct http_request *r)
{
    struct error err = {0};
    if (job_delete_file(r->service, r->param[0], r->param[1], &err) != STATUS_OK)
        reply_problem(r, NULL, &err, NULL);
    else
        reply_empty(r, MHD_HTTP_NO_CONTENT);
}
