/* Submits a batch: reads the table, sends it, and uploads the files that the server does not have. */
#include "base/files/json_text.h"
#include "clients/cli/batch/batch_rows.h"
#include "clients/cli/batch/cli_batch.h"

#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

struct submission {
    struct cli *cli;
    json_t *template_, *batch;
    struct batch_rows rows;
    json_t *sums; /* SHA-256 and size of each path that was read */
    json_t *sent; /* SHA-256 of the files uploaded just now */
    size_t n_sent, n_known;
};

static bool may_go_on(void *context, uint64_t n_done)
{
    (void)n_done;
    return !http_stopped(((struct submission *)context)->cli->http);
}

/* Files that several samples share are read once. */
static status hash_file(struct submission *u, struct cli_file *file, struct error *err)
{
    const json_t *known = json_object_get(u->sums, file->path);
    if (known != NULL) {
        snprintf(file->sha256, sizeof file->sha256, "%s", json_string_value(json_array_get(known, 0)));
        file->n_bytes = (uint64_t)json_integer_value(json_array_get(known, 1));
        return STATUS_OK;
    }
    status s = cli_file_hash(file, may_go_on, u, err);
    if (s == STATUS_OK)
        json_object_set_new(u->sums, file->path, json_pack("[s,I]", file->sha256, (json_int_t)file->n_bytes));
    return s;
}

static status table_body(struct submission *u, const char *name, json_t **out, struct error *err)
{
    json_t *samples = json_array();
    status s = STATUS_OK;
    for (size_t i = 0; s == STATUS_OK && i < u->rows.n; i++) {
        struct batch_row *row = &u->rows.row[i];
        json_t *files = json_array();
        for (size_t k = 0; s == STATUS_OK && k < row->list.n_file; k++) {
            struct cli_file *f = &row->list.file[k];
            s = hash_file(u, f, err);
            if (s == STATUS_OK)
                json_array_append_new(files, json_pack("{s:s,s:I,s:s}", "name", f->name, "size", (json_int_t)f->n_bytes,
                                                       "sha256", f->sha256));
        }
        if (s != STATUS_OK) error_prefix(err, s, "sample '%s'", row->sample);
        json_array_append_new(
            samples, json_pack("{s:s,s:O,s:o}", "sample", row->sample, "replace", row->replace, "files", files));
    }
    *out = json_pack("{s:s,s:O,s:o,s:b}", "name", name, "template", u->template_, "samples", samples, "update",
                     u->cli->args->update);
    if (s == STATUS_OK && *out == NULL) s = error_set(err, STATUS_INVALID, "a name of the batch is not UTF-8");
    return s;
}

static const struct cli_file *file_named(const struct batch_row *row, const char *name)
{
    for (size_t i = 0; name != NULL && i < row->list.n_file; i++)
        if (strcmp(row->list.file[i].name, name) == 0) return &row->list.file[i];
    return NULL;
}

/* Declares a file anew whose bytes were uploaded to another job meanwhile: it is complete then, if they can be linked.
 * *url: where to send it otherwise (a new text). */
static status declare_again(struct submission *u, const char *files_path, const struct cli_file *file, char **url,
                            struct error *err)
{
    char path[320 + CLI_ESCAPED_BYTES], name[CLI_ESCAPED_BYTES];
    json_t *answer = NULL;
    json_t *body = json_pack("{s:s,s:s,s:I,s:s}", "name", file->name, "role", file->role, "size",
                             (json_int_t)file->n_bytes, "sha256", file->sha256);
    cli_name_escape(file->name, name);
    snprintf(path, sizeof path, "%s/%s", files_path, name);
    status s = http_json(u->cli->http, "DELETE", path, NULL, NULL, NULL, err);
    if (s == STATUS_OK) s = http_json(u->cli->http, "POST", files_path, NULL, body, &answer, err);
    const char *address = json_string_value(json_object_get(answer, "upload_url"));
    free(*url);
    *url = address == NULL ? NULL : strdup(address);
    json_decref(answer);
    json_decref(body);
    return s;
}

static status send_file(struct submission *u, const char *files_path, const struct cli_file *file, const char *to,
                        struct error *err)
{
    char *url = strdup(to);
    status s = STATUS_OK;
    if (json_object_get(u->sent, file->sha256) != NULL) s = declare_again(u, files_path, file, &url, err);
    if (s == STATUS_OK && url == NULL)
        u->n_known++;
    else if (s == STATUS_OK) {
        s = cli_upload_file(u->cli, file, url, cli_piece_bytes(u->cli), NULL, NULL, err);
        json_object_set_new(u->sent, file->sha256, json_true());
        u->n_sent += s == STATUS_OK;
    }
    free(url);
    return s;
}

/* Uploads the missing files of a job. */
static status send_files(struct submission *u, const struct batch_row *row, const char *job, struct error *err)
{
    char path[200];
    json_t *answer = NULL, *one;
    size_t i;
    status s = cli_job_path(job, "/files", path, sizeof path, err);
    if (s == STATUS_OK) s = http_json(u->cli->http, "GET", path, NULL, NULL, &answer, err);
    json_array_foreach(json_object_get(answer, "files"), i, one)
    {
        const char *url = json_string_value(json_object_get(one, "upload_url"));
        const struct cli_file *file = file_named(row, json_string_value(json_object_get(one, "name")));
        if (s == STATUS_OK && url == NULL) u->n_known++;
        if (s == STATUS_OK && url != NULL && file != NULL) s = send_file(u, path, file, url, err);
    }
    json_decref(answer);
    return s == STATUS_OK ? s : error_prefix(err, s, "sample '%s'", row->sample);
}

static status send_all(struct submission *u, struct error *err)
{
    const json_t *samples = json_object_get(u->batch, "samples"), *left = json_object_get(u->batch, "left");
    size_t n_taken = 0;
    status s = STATUS_OK;
    for (size_t i = 0; s == STATUS_OK && i < json_array_size(samples); i++) {
        const json_t *one = json_array_get(samples, i);
        const char *job = json_string_value(json_object_get(one, "job")),
                   *outcome = json_string_value(json_object_get(one, "outcome"));
        n_taken += outcome != NULL && strcmp(outcome, "taken_over") == 0;
        if (job == NULL || i >= u->rows.n) return error_set(err, STATUS_FORMAT, "the server's reply has no jobs");
        s = send_files(u, &u->rows.row[i], job, err);
    }
    if (s == STATUS_OK)
        fprintf(u->cli->note,
                "%zu samples: %zu new or changed, %zu taken over, %zu jobs left the batch; %zu files uploaded, %zu on "
                "the server already\n",
                u->rows.n, u->rows.n - n_taken, n_taken, json_array_size(left), u->n_sent, u->n_known);
    return s;
}

static status start_batch(struct submission *u, struct error *err)
{
    char path[160];
    json_t *answer = NULL;
    const char *id = json_string_value(json_object_get(u->batch, "id"));
    if (id == NULL) return error_set(err, STATUS_FORMAT, "the server's reply has no id of the batch");
    snprintf(path, sizeof path, "/v1/batches/%.80s/start", id);
    status s = u->cli->args->draft ? STATUS_OK : http_json(u->cli->http, "POST", path, NULL, NULL, &answer, err);
    if (s == STATUS_OK && u->cli->args->json)
        cli_print_json(u->batch, u->cli->out);
    else if (s == STATUS_OK)
        fprintf(u->cli->out, "%s\n", id);
    if (s == STATUS_OK && json_array_size(json_object_get(answer, "refused")) > 0) {
        cli_batch_print(u->cli, answer);
        s = error_set(err, STATUS_CONFLICT, "%zu samples were not started",
                      json_array_size(json_object_get(answer, "refused")));
    }
    json_decref(answer);
    return s;
}

static status read_rows(struct submission *u, struct error *err)
{
    const struct cli_args *a = u->cli->args;
    char folder[4096];
    struct error fault = {0};
    struct stat st;
    if (a->second == NULL || a->third == NULL)
        return error_set(err, STATUS_INVALID,
                         "'selvedge batch submit' needs a template and a table: selvedge batch submit TEMPLATE.json "
                         "TABLE.csv");
    snprintf(folder, sizeof folder, "the template '%s'", a->second);
    u->template_ = json_text_file(a->second, folder, &fault);
    if (u->template_ == NULL) return error_set(err, fault.code, "%s", fault.text);
    if (!json_is_object(u->template_))
        return error_set(err, STATUS_INVALID, "template '%s' is not a JSON object", a->second);
    if (stat(a->third, &st) != 0) return error_set_errno(err, "cannot read '%s'", a->third);
    if (S_ISDIR(st.st_mode)) return batch_rows_of_folder(a->third, u->template_, &u->rows, err);
    cli_folder_of(a->third, folder, sizeof folder);
    return batch_rows_of_table(a->third, a->files != NULL ? a->files : folder, u->template_, &u->rows, err);
}

/* --name, else the name of the table without its ending. */
static void name_of(const struct cli_args *a, char *name, size_t n_name)
{
    const char *slash = strrchr(a->third, '/');
    const char *last = slash != NULL && slash[1] != '\0' ? slash + 1 : a->third;
    snprintf(name, n_name, "%s", a->name != NULL ? a->name : last);
    char *dot = a->name != NULL ? NULL : strrchr(name, '.');
    if (dot != NULL && dot != name && strcmp(dot, ".csv") == 0) *dot = '\0';
    size_t n = strlen(name);
    if (a->name == NULL && n > 1 && name[n - 1] == '/') name[n - 1] = '\0';
}

status cli_batch_submit(struct cli *cli, struct error *err)
{
    struct submission u = {.cli = cli, .sums = json_object(), .sent = json_object()};
    json_t *body = NULL;
    char name[256] = "";
    status s = read_rows(&u, err);
    if (s == STATUS_OK) name_of(cli->args, name, sizeof name);
    if (s == STATUS_OK) s = table_body(&u, name, &body, err);
    if (s == STATUS_OK) s = http_json(cli->http, "POST", "/v1/batches", NULL, body, &u.batch, err);
    if (s == STATUS_OK) fprintf(cli->note, "batch '%s' submitted\n", name);
    if (s == STATUS_EXISTS || s == STATUS_CONFLICT) s = error_prefix(err, s, "--update makes it like this table");
    if (s == STATUS_OK) s = send_all(&u, err);
    if (s == STATUS_OK) s = start_batch(&u, err);
    batch_rows_release(&u.rows);
    json_decref(body);
    json_decref(u.template_);
    json_decref(u.batch);
    json_decref(u.sums);
    json_decref(u.sent);
    return s;
}
