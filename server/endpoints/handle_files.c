#include "base/files/foreign_file.h"
#include "optimizer/job/job_folder.h"
#include "server/endpoints/handlers.h"
#include "server/endpoints/request_json.h"
#include "server/http/http_reply.h"
#include "server/settings/job_paths.h"
#include "server/views/job_view.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

void handle_list_files(struct http_request *r)
{
    struct job_row row;
    struct error err = {0};
    json_t *view = NULL;
    char tag[JOB_TAG_BYTES] = "";
    status s = job_get(r->service, r->param[0], &row, &err);
    if (s == STATUS_OK) job_view_files_tag(r->service, &row, tag);
    bool known = s == STATUS_OK && reply_not_modified(r, tag);
    if (s == STATUS_OK && !known) s = job_view_files(r->service, &row, &view, &err);
    job_row_release(&row);
    if (known) return;
    if (s != STATUS_OK) {
        reply_problem(r, NULL, &err, NULL);
        return;
    }
    reply_json(r, MHD_HTTP_OK, view);
    reply_header(r, "ETag", tag);
}

static status member_text(const json_t *j, const char *name, char *out, size_t n_out, bool optional, struct error *err)
{
    const json_t *x = json_object_get(j, name);
    if (optional && (x == NULL || json_is_null(x))) return STATUS_OK;
    if (!json_is_string(x)) return error_set_field(err, STATUS_INVALID, name, "member '%s' must be a string", name);
    if (json_string_length(x) >= n_out || strlen(json_string_value(x)) != json_string_length(x))
        return error_set_field(err, STATUS_INVALID, name, "member '%s' is too long", name);
    if (optional && json_string_length(x) == 0)
        return error_set_field(err, STATUS_INVALID, name, "member '%s' is empty; null leaves it out", name);
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

/* Puts the place in the list before the name of the field: "[3].name". */
static void name_place(struct error *err, size_t i)
{
    char field[sizeof err->field];
    snprintf(field, sizeof field, "[%zu]%s%.100s", i, err->field[0] != '\0' ? "." : "", err->field);
    snprintf(err->field, sizeof err->field, "%s", field);
}

static status read_declarations(const json_t *list, struct job_declaration *file, size_t *i_fault, struct error *err)
{
    status s = STATUS_OK;
    const json_t *one;
    size_t i;
    json_array_foreach(list, i, one)
    {
        s = read_declaration(one, &file[i].row, err);
        *i_fault = i;
        if (s != STATUS_OK) break;
    }
    return s;
}

static void reply_declared(struct http_request *r, bool in_list, const struct job_declaration *file, size_t n)
{
    char upload[80];
    bool existed = true;
    json_t *list = json_array();
    for (size_t i = 0; i < n; i++) {
        struct file_row row = file[i].row;
        upload_refresh(r->service->upload, &row);
        json_array_append_new(list, file_view(&row));
        existed = existed && file[i].existed;
    }
    json_t *body = in_list ? json_pack("{s:O}", "files", list) : json_incref(json_array_get(list, 0));
    json_decref(list);
    reply_json(r, existed ? MHD_HTTP_OK : MHD_HTTP_CREATED, body);
    snprintf(upload, sizeof upload, "/v1/uploads/%s", file[0].row.id);
    if (!in_list) reply_header(r, "Location", upload);
}

/* Declares one file, or a list of files: all or none. */
static void declare(struct http_request *r, const json_t *list, bool in_list)
{
    struct error err = {0};
    struct job_refusal refusal = {0};
    size_t n = json_array_size(list), i_fault = 0;
    struct job_declaration *file = calloc(n > 0 ? n : 1, sizeof *file);
    status s = STATUS_OK;
    if (file == NULL)
        s = error_set(&err, STATUS_NO_MEMORY, "cannot declare files: out of memory");
    else if (n == 0)
        s = error_set(&err, STATUS_INVALID, "a list of declarations must not be empty");
    else
        s = read_declarations(list, file, &i_fault, &err);
    if (s != STATUS_OK && n > 0 && in_list) name_place(&err, i_fault);
    if (s == STATUS_OK) {
        s = job_declare_files(r->service, &r->grant, r->param[0], file, n, &i_fault, &refusal, &err);
        if (s != STATUS_OK && i_fault < n && in_list) name_place(&err, i_fault);
    }
    if (s != STATUS_OK)
        reply_problem(r, refusal.code, &err, refusal.extra);
    else
        reply_declared(r, in_list, file, n);
    free(file);
}

void handle_declare_files(struct http_request *r)
{
    json_t *j = request_json(r);
    if (j == NULL) return;
    bool in_list = json_is_array(j);
    json_t *list = in_list ? json_incref(j) : json_pack("[O]", j);
    declare(r, list, in_list);
    json_decref(list);
    json_decref(j);
}

void handle_get_file(struct http_request *r)
{
    struct job_row job;
    struct file_row file;
    struct error err = {0};
    char folder[PATH_BYTES], name[sizeof file.name + sizeof JOB_FOLDER_INPUT];
    int fd = -1;
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
    path_join(folder, r->service->settings->data, "jobs", file.job_id, NULL);
    snprintf(name, sizeof name, JOB_FOLDER_INPUT "/%s", file.name);
    s = foreign_file_open(folder, name, &fd, NULL, &err);
    if (s == STATUS_NOT_FOUND) error_set(&err, s, "file '%s' is no longer in the job's folder", file.name);
    if (s != STATUS_OK) {
        reply_problem(r, NULL, &err, NULL);
        return;
    }
    reply_foreign_file(r, fd, file.name);
}

void handle_delete_file(struct http_request *r)
{
    struct error err = {0};
    if (job_delete_file(r->service, r->param[0], r->param[1], &err) != STATUS_OK)
        reply_problem(r, NULL, &err, NULL);
    else
        reply_empty(r, MHD_HTTP_NO_CONTENT);
}
