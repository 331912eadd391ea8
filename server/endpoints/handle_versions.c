/* Earlier results of a job that was edited and run again. */
#include "server/endpoints/handlers.h"
#include "server/http/http_reply.h"
#include "server/views/job_view.h"
#include "server/views/result_version.h"

static void reply_view(struct http_request *r, const char *number)
{
    struct job_row row;
    struct error err = {0};
    json_t *view = NULL;
    status s = job_get(r->service, r->param[0], &row, &err);
    if (s == STATUS_OK && number == NULL)
        s = version_list(r->service, &row, &view, &err);
    else if (s == STATUS_OK)
        s = version_view(r->service, &row, number, &view, &err);
    job_row_release(&row);
    if (s != STATUS_OK)
        reply_problem(r, NULL, &err, NULL);
    else
        reply_json_tagged(r, view);
}

void handle_list_versions(struct http_request *r) { reply_view(r, NULL); }
void handle_get_version(struct http_request *r) { reply_view(r, r->param[1]); }

void handle_get_version_file(struct http_request *r)
{
    struct job_row row;
    struct error err = {0};
    int fd = -1;
    status s = job_get(r->service, r->param[0], &row, &err);
    if (s == STATUS_OK) s = version_open(r->service, &row, r->param[1], r->param[2], &fd, &err);
    job_row_release(&row);
    if (s != STATUS_OK)
        reply_problem(r, NULL, &err, NULL);
    else
        reply_foreign_file(r, fd, r->param[2]);
}
