#include "base/files/foreign_file.h"
#include "optimizer/job/job_folder.h"
#include "server/endpoints/handlers.h"
#include "server/http/http_reply.h"
#include "server/http/tar_stream.h"
#include "server/settings/job_paths.h"
#include "server/views/job_view.h"
#include "server/views/result_files.h"
#include "server/views/series_view.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { SERIES_MOST = 5000, SERIES_USUAL = 500, LOG_MOST_BYTES = 1 << 20, LOG_USUAL_BYTES = 65536 };

/* Returns false after deciding a 404. */
static bool find_job(struct http_request *r, struct job_row *row)
{
    struct error err = {0};
    if (job_get(r->service, r->param[0], row, &err) == STATUS_OK) return true;
    reply_problem(r, NULL, &err, NULL);
    return false;
}

void handle_get_series(struct http_request *r)
{
    struct job_row row;
    struct error err = {0};
    json_t *view = NULL;
    long long after, most;
    const char *rendered = MHD_lookup_connection_value(r->connection, MHD_GET_ARGUMENT_KIND, "rendered");
    if (!query_integer(r, "after_step", -1, INT64_MAX, -1, &after) ||
        !query_integer(r, "max_points", 2, SERIES_MOST, SERIES_USUAL, &most))
        return;
    if (rendered != NULL && strcmp(rendered, "all") != 0 && strcmp(rendered, "last") != 0) {
        error_set_field(&err, STATUS_INVALID, "rendered", "query parameter 'rendered' must be 'last' or 'all'");
        reply_problem(r, NULL, &err, NULL);
        return;
    }
    if (!find_job(r, &row)) return;
    status s = series_view(r->service, &row, after, (size_t)most, rendered != NULL && rendered[0] == 'a', &view, &err);
    job_row_release(&row);
    if (s != STATUS_OK)
        reply_problem(r, NULL, &err, NULL);
    else
        reply_json_tagged(r, view);
}

/* Reads at most n_most bytes of the log from *offset on. A negative *offset counts from the end of the file; one beyond
 * the end becomes 0. Returns the number of bytes read, 0 if there is no log yet, or -1 on failure. */
static ssize_t read_log(const char *folder, long long *offset, long long *size, char *out, size_t n_most)
{
    uint64_t n_bytes = 0;
    int fd = -1;
    *size = 0;
    status s = foreign_file_open(folder, JOB_FILE_LOG, &fd, &n_bytes, NULL);
    if (s != STATUS_OK) {
        *offset = 0;
        return s == STATUS_NOT_FOUND ? 0 : -1;
    }
    *size = (long long)n_bytes;
    if (*offset < 0) *offset = *size + *offset > 0 ? *size + *offset : 0;
    if (*offset > *size) *offset = 0;
    ssize_t n = pread(fd, out, n_most, (off_t)*offset);
    close(fd);
    return n;
}

void handle_get_log(struct http_request *r)
{
    struct job_row row;
    long long offset, most, size;
    char folder[PATH_BYTES];
    if (!query_integer(r, "offset", INT64_MIN, INT64_MAX, 0, &offset) ||
        !query_integer(r, "max_bytes", 1, LOG_MOST_BYTES, LOG_USUAL_BYTES, &most))
        return;
    if (!find_job(r, &row)) return;
    path_join(folder, r->service->settings->data, "jobs", row.id, NULL);
    job_row_release(&row);
    char *text = malloc((size_t)most);
    ssize_t n = text == NULL ? -1 : read_log(folder, &offset, &size, text, (size_t)most);
    if (n < 0)
        reply_code(r, "internal", "", "the log cannot be read");
    else {
        reply_text(r, MHD_HTTP_OK, "text/plain; charset=utf-8", text, (size_t)n);
        reply_header_int(r, "Selvedge-Next-Offset", offset + n);
        reply_header_int(r, "Selvedge-Log-Size", size);
        reply_header(r, "Cache-Control", "no-store");
    }
    free(text);
}

void handle_list_results(struct http_request *r)
{
    struct job_row row;
    struct error err = {0};
    struct result_file *file = NULL;
    size_t n = 0;
    char url[128];
    if (!find_job(r, &row)) return;
    status s = result_list(r->service, row.id, JOB_FOLDER_RESULTS, &file, &n, &err);
    if (s != STATUS_OK) {
        reply_problem(r, NULL, &err, NULL);
        free(file);
        job_row_release(&row);
        return;
    }
    snprintf(url, sizeof url, "/v1/jobs/%s/results", row.id);
    json_t *list = result_files_json(file, n, url);
    snprintf(url, sizeof url, "/v1/jobs/%s/results.tar", row.id);
    reply_json_tagged(r, json_pack("{s:o,s:s}", "files", list, "archive", url));
    free(file);
    job_row_release(&row);
}

void reply_foreign_file(struct http_request *r, int fd, const char *name)
{
    const char *type = content_type_of(name);
    reply_file(r, fd, type);
    if (strncmp(type, "text/html", 9) == 0) reply_policy(r, POLICY_SANDBOX_PAGE);
}

void handle_get_result(struct http_request *r)
{
    struct job_row row;
    struct error err = {0};
    int fd;
    if (!find_job(r, &row)) return;
    if (result_open(r->service, row.id, JOB_FOLDER_RESULTS, r->param[1], &fd, &err) != STATUS_OK)
        reply_problem(r, NULL, &err, NULL);
    else
        reply_foreign_file(r, fd, r->param[1]);
    job_row_release(&row);
}

void handle_get_archive(struct http_request *r)
{
    struct job_row row;
    struct error err = {0};
    struct MHD_Response *response = NULL;
    char text[128];
    if (!find_job(r, &row)) return;
    if (tar_stream_response(r->service, row.id, &response, &err) != STATUS_OK)
        reply_problem(r, NULL, &err, NULL);
    else {
        reply_response(r, MHD_HTTP_OK, response);
        reply_header(r, "Content-Type", "application/x-tar");
        snprintf(text, sizeof text, "attachment; filename=\"selvedge-%.8s.tar\"", row.id);
        reply_header(r, "Content-Disposition", text);
        reply_header(r, "Cache-Control", "no-store");
    }
    job_row_release(&row);
}
