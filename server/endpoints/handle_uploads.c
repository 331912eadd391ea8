/* The tus 1.0.0 resumable upload protocol: core and termination. */
#include "server/endpoints/handlers.h"
#include "server/http/http_reply.h"
#include "server/settings/job_paths.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static bool check_version(struct http_request *r)
{
    const char *version = request_header(r, "Tus-Resumable");
    if (version != NULL && strcmp(version, "1.0.0") == 0) return true;
    reply_code(r, "tus_version", "Tus-Resumable", "uploads use the tus protocol; send Tus-Resumable: 1.0.0");
    reply_header(r, "Tus-Version", "1.0.0");
    return false;
}

static void reply_upload_error(struct http_request *r, const struct error *err, const struct file_row *row)
{
    reply_problem(r, err->code == STATUS_CONFLICT ? "offset" : NULL, err, NULL);
    if (row->id[0] != '\0') reply_header_int(r, "Upload-Offset", row->offset_bytes);
}

/* Becomes the only writer of the upload named in the request. On failure decides a reply and holds nothing. */
static bool take_upload(struct http_request *r, struct upload **upload, struct file_row *row)
{
    struct error err = {0};
    uint64_t ticket;
    *row = (struct file_row){0};
    status s = id_valid(r->param[0]) ? upload_hold(r->service->upload, r->param[0], upload, &err)
                                     : error_set(&err, STATUS_NOT_FOUND, "upload '%.40s' does not exist", r->param[0]);
    if (s != STATUS_OK) {
        reply_upload_error(r, &err, row);
        return false;
    }
    s = upload_take(*upload, &ticket, row, &err);
    r->ticket = ticket;
    if (s == STATUS_OK || s == STATUS_CHECKSUM) return true;
    upload_release(r->service->upload, *upload);
    reply_upload_error(r, &err, row);
    return false;
}

void handle_upload_offset(struct http_request *r)
{
    struct upload *upload;
    struct file_row row;
    if (!check_version(r) || !take_upload(r, &upload, &row)) return;
    upload_release(r->service->upload, upload);
    reply_empty(r, MHD_HTTP_OK);
    reply_header_int(r, "Upload-Offset", row.offset_bytes);
    reply_header_int(r, "Upload-Length", row.size_bytes);
    reply_header(r, "Cache-Control", "no-store");
}

void handle_upload_bytes_begin(struct http_request *r)
{
    struct upload *upload;
    struct file_row row;
    struct error err = {0};
    const char *text = request_header(r, "Upload-Offset");
    if (!check_version(r)) return;
    if (text == NULL || *text == '\0' || strlen(text) > 18 || strspn(text, "0123456789") != strlen(text)) {
        reply_code(r, "malformed", "Upload-Offset", "Upload-Offset must be a whole number of at most 18 digits");
        return;
    }
    if (!take_upload(r, &upload, &row)) return;
    long long offset = strtoll(text, NULL, 10);
    if (offset != row.offset_bytes)
        error_set_field(&err, STATUS_CONFLICT, "Upload-Offset", "the upload of '%s' is at offset %lld, not %lld",
                        row.name, (long long)row.offset_bytes, offset);
    else if (r->content_length > row.size_bytes - row.offset_bytes)
        error_set_field(&err, STATUS_TOO_LARGE, "Content-Length",
                        "'%s' was declared with %lld bytes; %lld of them are missing, but the request has %lld",
                        row.name, (long long)row.size_bytes, (long long)(row.size_bytes - row.offset_bytes),
                        (long long)r->content_length);
    if (err.code == STATUS_OK) {
        r->upload = upload;
        return;
    }
    upload_release(r->service->upload, upload);
    reply_upload_error(r, &err, &row);
}

static void release_upload(struct http_request *r)
{
    upload_release(r->service->upload, r->upload);
    r->upload = NULL;
}

void handle_upload_bytes(struct http_request *r)
{
    struct file_row row = {0};
    struct error err = {0};
    status s = upload_commit(r->upload, r->ticket, &row, &err);
    if (s == STATUS_OK && r->upload_status != STATUS_OK) {
        s = r->upload_status;
        err = r->upload_error;
    }
    release_upload(r);
    if (s != STATUS_OK) {
        reply_upload_error(r, &err, &row);
        return;
    }
    reply_empty(r, MHD_HTTP_NO_CONTENT);
    reply_header_int(r, "Upload-Offset", row.offset_bytes);
}

void handle_upload_bytes_abandoned(struct http_request *r)
{
    struct error err = {0};
    status s = upload_commit(r->upload, r->ticket, NULL, &err);
    if (s != STATUS_OK && s != STATUS_STALE)
        log_warning(r->service->log, "what an interrupted upload had received could not be stored: %s", err.text);
    release_upload(r);
}

void handle_terminate_upload(struct http_request *r)
{
    struct error err = {0};
    if (!check_version(r)) return;
    if (job_delete_upload(r->service, r->param[0], &err) != STATUS_OK)
        reply_problem(r, NULL, &err, NULL);
    else
        reply_empty(r, MHD_HTTP_NO_CONTENT);
}

void handle_upload_options(struct http_request *r)
{
    reply_empty(r, MHD_HTTP_NO_CONTENT);
    reply_header(r, "Tus-Version", "1.0.0");
    reply_header(r, "Tus-Extension", "termination");
    reply_header_int(r, "Tus-Max-Size", r->service->settings->max_file_bytes);
}
