/* A job that shows the result of a finished one without a new fit: its document, its files, its start. Each step may
 * be repeated, so a client that sends the request again with its Idempotency-Key gets the job whole, even if the daemon
 * was killed in between. */
#include "base/files/derived_document.h"
#include "base/files/foreign_json.h"
#include "optimizer/job/job_folder.h"
#include "optimizer/job/options/option_key.h"
#include "server/endpoints/handlers.h"
#include "server/endpoints/request_json.h"
#include "server/http/http_reply.h"
#include "server/jobs/job_tags.h"
#include "server/settings/job_paths.h"
#include "server/views/result_files.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

enum { PIECE_BYTES = 1 << 20, N_FILE = 4 };

static const char *const held[] = {"sample", "model", "parameters", NULL};
static const struct foreign_bounds result_bounds = {
    .file_bytes = (size_t)256 << 20, .held_bytes = 16 << 20, .depth = 16, .member = held};

/* A file of the new job, and the file of the finished job that it is a copy of. */
struct taken_file {
    const char *name, *role, *folder, *from;
};

struct derivation {
    struct http_request *request;
    struct job_row from; /* with its document */
    char *document;
    size_t n_file;
    struct taken_file file[N_FILE];
    char id[STORE_ID_BYTES]; /* of the new job */
    bool replayed;
    struct job_refusal refusal;
    json_t *wanted, *document_of_from;
};

static status make_document(struct derivation *d, struct error *err)
{
    char folder[PATH_BYTES];
    json_t *result = NULL, *made = NULL;
    struct derived_files files;
    path_join(folder, d->request->service->settings->data, "jobs", d->from.id, NULL);
    if (d->from.state != JOB_SUCCEEDED)
        return error_set(err, STATUS_CONFLICT, "job %s has no fitted model to show: it has not succeeded", d->from.id);
    d->document_of_from = json_loads(d->from.document, 0, NULL);
    status s = foreign_json_read(folder, JOB_FOLDER_RESULTS "/" DERIVED_RESULT, &result_bounds, &result, err);
    if (s == STATUS_OK) s = derived_document_make(d->document_of_from, result, d->wanted, &made, &files, err);
    json_decref(result);
    if (s != STATUS_OK) return job_option_name_field(s, err);
    d->file[d->n_file++] = (struct taken_file){DERIVED_FIBERS, "fibers", JOB_FOLDER_RESULTS, DERIVED_FIBERS};
    d->file[d->n_file++] = files.result != NULL
                               ? (struct taken_file){DERIVED_RESULT, "result", JOB_FOLDER_INPUT, files.result}
                               : (struct taken_file){DERIVED_RESULT, "result", JOB_FOLDER_RESULTS, DERIVED_RESULT};
    if (files.environment != NULL)
        d->file[d->n_file++] =
            (struct taken_file){files.environment, "environment", JOB_FOLDER_INPUT, files.environment};
    if (files.report)
        d->file[d->n_file++] = (struct taken_file){DERIVED_REPORT, "report", JOB_FOLDER_RESULTS, DERIVED_REPORT};
    d->document = json_dumps(made, JSON_INDENT(1) | JSON_REAL_PRECISION(17));
    json_decref(made);
    return d->document != NULL ? STATUS_OK : error_set(err, STATUS_NO_MEMORY, "cannot make a job: out of memory");
}

static status create(struct derivation *d, struct error *err)
{
    const struct job_request request = {d->document, strlen(d->document), request_header(d->request, "Idempotency-Key"),
                                        &d->request->grant};
    status s = job_create(d->request->service, &request, d->id, &d->replayed, &d->refusal, err);
    if (s != STATUS_OK || d->replayed) return s;
    /* a tag tells the jobs that show a result from others */
    bool changed;
    char tag[16];
    snprintf(tag, sizeof tag, "of:%.8s", d->from.id);
    json_t *tags = json_pack("[s]", tag);
    s = job_edit_tags(d->request->service, d->id, &(struct tag_edit){.add = tags}, &changed, err);
    json_decref(tags);
    return s;
}

/* Copies the bytes behind the present offset of an upload, and completes it. */
static status copy_bytes(struct upload_set *set, const struct file_row *declared, int fd, struct error *err)
{
    struct upload *upload;
    struct file_row row;
    uint64_t ticket;
    status s = upload_hold(set, declared->id, &upload, err);
    if (s != STATUS_OK) return s;
    char *piece = malloc(PIECE_BYTES);
    s = upload_take(upload, &ticket, &row, err);
    if (s == STATUS_OK && piece == NULL) s = error_set(err, STATUS_NO_MEMORY, "cannot copy a file: out of memory");
    while (s == STATUS_OK && row.offset_bytes < row.size_bytes) {
        const int64_t rest = row.size_bytes - row.offset_bytes;
        const ssize_t n = pread(fd, piece, rest < PIECE_BYTES ? (size_t)rest : PIECE_BYTES, (off_t)row.offset_bytes);
        if (n < 0 && errno == EINTR) continue;
        if (n <= 0) s = error_set(err, STATUS_IO, "cannot copy '%s': it ends early", declared->name);
        if (s == STATUS_OK) s = upload_write(upload, ticket, piece, (size_t)n, err);
        row.offset_bytes += n;
    }
    if (s == STATUS_OK) s = upload_commit(upload, ticket, NULL, err);
    free(piece);
    upload_release(set, upload);
    return s;
}

static status copy_file(struct derivation *d, const struct taken_file *file, struct error *err)
{
    struct job_service *v = d->request->service;
    struct job_declaration declared = {.known = false};
    struct stat st;
    int fd = -1;
    size_t i_fault;
    status s = result_open(v, d->from.id, file->folder, file->from, &fd, err);
    if (s == STATUS_NOT_FOUND)
        return error_set(err, STATUS_CONFLICT, "job %s has no file '%s' to take over", d->from.id, file->from);
    if (s != STATUS_OK) return s;
    if (fstat(fd, &st) != 0) s = error_set_errno(err, "cannot read '%s'", file->from);
    snprintf(declared.row.name, sizeof declared.row.name, "%s", file->name);
    snprintf(declared.row.role, sizeof declared.row.role, "%s", file->role);
    declared.row.size_bytes = (int64_t)st.st_size;
    if (s == STATUS_OK) s = job_declare_files(v, &d->request->grant, d->id, &declared, 1, &i_fault, &d->refusal, err);
    if (s == STATUS_OK && declared.row.state != FILE_COMPLETE) s = copy_bytes(v->upload, &declared.row, fd, err);
    close(fd);
    return s;
}

/* Starts the job unless files are missing, such as a mesh that the client uploads next. */
static status start(struct derivation *d, struct error *err)
{
    struct job_row row;
    json_t *missing = NULL;
    bool changed;
    status s = job_get(d->request->service, d->id, &row, err);
    if (s == STATUS_OK) s = job_missing_files(d->request->service, &row, &missing, err);
    if (s == STATUS_OK && json_array_size(missing) == 0)
        s = job_start(d->request->service, d->id, NULL, &changed, &d->refusal, err);
    json_decref(missing);
    job_row_release(&row);
    return s;
}

static status derive(struct derivation *d, struct error *err)
{
    status s = job_get(d->request->service, d->request->param[0], &d->from, err);
    if (s == STATUS_OK) s = make_document(d, err);
    if (s == STATUS_OK) s = create(d, err);
    if (s != STATUS_OK) return s;
    struct job_row row;
    s = job_look(d->request->service, d->id, &row, err);
    if (s == STATUS_OK && row.state != JOB_DRAFT) return STATUS_OK; /* a repeated request: it has started */
    for (size_t i = 0; i < d->n_file && s == STATUS_OK; i++) s = copy_file(d, &d->file[i], err);
    if (s == STATUS_OK) s = start(d, err);
    if (s != STATUS_OK && !d->replayed) job_delete(d->request->service, d->id, NULL);
    return s;
}

void handle_derive_job(struct http_request *r)
{
    struct error err = {0};
    struct derivation d = {.request = r, .wanted = request_json(r)};
    if (d.wanted == NULL) return;
    if (derive(&d, &err) != STATUS_OK)
        reply_problem(r, d.refusal.code, &err, d.refusal.extra);
    else
        reply_new_job(r, d.id, d.replayed);
    json_decref(d.wanted);
    json_decref(d.document_of_from);
    free(d.document);
    job_row_release(&d.from);
}
