#include "clients/cli/commands/cli.h"
#include "clients/cli/commands/cli_document.h"
#include "clients/cli/commands/cli_job_files.h"
#include "clients/cli/text/cli_report.h"
#include "clients/cli/text/cli_text.h"

#include "base/clock.h"
#include "base/files/durable.h"
#include "base/files/json_text.h"

#include <math.h>
#include <sodium.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

enum { DECLARE_AT_ONCE = 2000 /* files in a request: 300 bytes each leave them below its limit of 1 MiB */ };

struct submit {
    struct cli *cli;
    json_t *document, *job;
    struct cli_file_list list;
    char id[CLI_ID_BYTES];
    char key[2 * crypto_hash_sha256_BYTES + 1]; /* Idempotency-Key */
    /* progress over all files */
    const char *verb, *name;
    uint64_t n_total, n_before, n_now;
    double started_s, shown_s;
    bool drawn;
};

/* ---- progress line ---- */

static void draw(struct submit *u, bool force)
{
    double now = clock_monotonic_s();
    if (!u->cli->note_is_terminal || (!force && now - u->shown_s < 0.1)) return;
    u->shown_s = now;
    u->drawn = true;
    char bar[40], done[CLI_SHORT_TEXT], total[CLI_SHORT_TEXT], rate[CLI_SHORT_TEXT], eta[CLI_SHORT_TEXT], name[48],
        line[400];
    double n = (double)(u->n_before + u->n_now), all = (double)u->n_total, speed = n / fmax(now - u->started_s, 1e-3);
    text_bar(all > 0.0 ? n / all : 1.0, 24, bar, sizeof bar);
    text_size(n, done);
    text_size(all, total);
    text_size(speed, rate);
    text_duration(speed > 0.0 ? (all - n) / speed : NAN, eta);
    text_clean(u->name, name, sizeof name);
    int len =
        snprintf(line, sizeof line, "%s %s  %s of %s  %s/s  ETA %s  %s", u->verb, bar, done, total, rate, eta, name);
    size_t width = cli_columns(u->cli);
    if (len > 0 && (size_t)len >= width && width > 1 && width < sizeof line) line[width - 1] = '\0';
    fprintf(u->cli->note, "\r\033[K%s", line);
    fflush(u->cli->note);
}

static void draw_end(struct submit *u)
{
    if (u->drawn) fputs("\r\033[K", u->cli->note);
    u->drawn = false;
}

static void uploaded(void *context, uint64_t offset)
{
    struct submit *u = context;
    u->n_now = offset;
    draw(u, false);
}

static bool hashed(void *context, uint64_t n_done)
{
    struct submit *u = context;
    u->n_now = n_done;
    draw(u, false);
    return !http_stopped(u->cli->http);
}

/* ---- steps ---- */

void cli_folder_of(const char *path, char *folder, size_t n_bytes)
{
    const char *slash = strrchr(path, '/');
    snprintf(folder, n_bytes, "%.*s",
             slash == NULL   ? 1
             : slash == path ? 1
                             : (int)(slash - path),
             slash == NULL ? "." : path);
}

static status read_document(struct submit *u, const char *path, struct error *err)
{
    struct error fault = {0};
    char what[4200];
    status s = cli_document_check(path, err);
    if (s != STATUS_OK) return s;
    snprintf(what, sizeof what, "the job document '%s'", path);
    u->document = json_text_file(path, what, &fault);
    if (u->document == NULL && err != NULL) *err = fault;
    return fault.code;
}

/* --input-dir, else the folder of the document, else the current one. */
static status list_files(struct submit *u, struct error *err)
{
    const struct cli_args *a = u->cli->args;
    char folder[4096] = ".";
    if (a->input_dir != NULL)
        snprintf(folder, sizeof folder, "%s", a->input_dir);
    else if (a->operand != NULL)
        cli_folder_of(a->operand, folder, sizeof folder);
    return cli_job_files_list(u->document, folder, &u->list, err);
}

static status hash_files(struct submit *u, struct error *err)
{
    status s = STATUS_OK;
    u->verb = "checking ";
    u->started_s = clock_monotonic_s();
    u->n_before = u->n_now = u->n_total = 0;
    /* all sizes first, for the total of the progress bar */
    for (size_t i = 0; i < u->list.n_file && s == STATUS_OK; i++) {
        struct stat st;
        if (stat(u->list.file[i].path, &st) == 0) u->n_total += (uint64_t)st.st_size;
    }
    for (size_t i = 0; i < u->list.n_file && s == STATUS_OK; i++) {
        u->name = u->list.file[i].name;
        u->n_now = 0;
        s = cli_file_hash(&u->list.file[i], hashed, u, err);
        u->n_before += u->list.file[i].n_bytes;
        if (s == STATUS_OK && u->list.file[i].n_bytes == 0)
            s = error_set(err, STATUS_INVALID, "input file '%s' is empty", u->list.file[i].path);
    }
    u->n_total = u->n_before;
    draw_end(u);
    return s;
}

static void random_key(char *key, size_t n_key)
{
    unsigned char random[16];
    randombytes_buf(random, sizeof random);
    sodium_bin2hex(key, n_key, random, sizeof random);
}

/* The key of a sample: the hash of its document, as it is sent, and of the hashes of its files. */
static status content_key(struct submit *u, struct error *err)
{
    unsigned char digest[crypto_hash_sha256_BYTES];
    crypto_hash_sha256_state hash;
    char *text = json_dumps(u->document, JSON_COMPACT);
    if (text == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot write the job document: out of memory");
    crypto_hash_sha256_init(&hash);
    crypto_hash_sha256_update(&hash, (const unsigned char *)text, strlen(text));
    for (size_t i = 0; i < u->list.n_file; i++)
        crypto_hash_sha256_update(&hash, (const unsigned char *)u->list.file[i].sha256, CLI_SHA256_HEX);
    crypto_hash_sha256_final(&hash, digest);
    sodium_bin2hex(u->key, sizeof u->key, digest, sizeof digest);
    free(text);
    return STATUS_OK;
}

static status create_job(struct submit *u, struct error *err)
{
    if (u->key[0] == '\0') random_key(u->key, sizeof u->key);
    status s = http_json(u->cli->http, "POST", "/v1/jobs", u->key, u->document, &u->job, err);
    if (s != STATUS_OK) return error_prefix(err, s, "the job document was refused");
    const char *id = json_string_value(json_object_get(u->job, "id"));
    if (id == NULL) return error_set(err, STATUS_FORMAT, "the server's reply has no job id");
    snprintf(u->id, sizeof u->id, "%s", id);
    cli_job_files_note(u->document, u->cli->note);
    fprintf(u->cli->note, "job %s created\n", u->id);
    if (u->cli->args->id_file == NULL) return STATUS_OK;
    char line[sizeof u->id + 1];
    int n = snprintf(line, sizeof line, "%s\n", u->id);
    return durable_replace_volatile(u->cli->args->id_file, line, (size_t)n, err);
}

/* --resume: the job exists. A document given again replaces the server's if it differs. */
static status open_job(struct submit *u, struct error *err)
{
    char path[256];
    snprintf(u->id, sizeof u->id, "%s", u->cli->args->resume_id);
    status s = cli_job_path(u->id, "", path, sizeof path, err);
    if (s == STATUS_OK) s = http_json(u->cli->http, "GET", path, NULL, NULL, &u->job, err);
    if (s != STATUS_OK) return s;
    const json_t *theirs = json_object_get(u->job, "document");
    if (u->document == NULL) {
        u->document = json_deep_copy(theirs);
        if (u->document == NULL) return error_set(err, STATUS_FORMAT, "the server's reply has no job document");
        return STATUS_OK;
    }
    if (json_equal(theirs, u->document)) return STATUS_OK;
    snprintf(path + strlen(path), sizeof path - strlen(path), "/document");
    s = http_json(u->cli->http, "PUT", path, NULL, u->document, NULL, err);
    return s == STATUS_OK ? s : error_prefix(err, s, "the changed job document was refused");
}

static json_t *declaration(const struct cli_file *file)
{
    return json_pack("{s:s, s:s, s:I, s:s}", "name", file->name, "role", file->role, "size", (json_int_t)file->n_bytes,
                     "sha256", file->sha256);
}

static status declare(struct submit *u, const struct cli_file *file, json_t **answer, struct error *err)
{
    char path[256];
    status s = cli_job_path(u->id, "/files", path, sizeof path, err);
    if (s != STATUS_OK) return s;
    json_t *body = declaration(file);
    if (body == NULL) return error_set(err, STATUS_INVALID, "file name '%s' is not UTF-8", file->name);
    s = http_json(u->cli->http, "POST", path, NULL, body, answer, err);
    if (s == STATUS_CONFLICT && u->cli->args->resume_id != NULL) { /* the file has changed: replace the earlier one */
        char one[sizeof path + CLI_ESCAPED_BYTES], name[CLI_ESCAPED_BYTES];
        cli_name_escape(file->name, name);
        snprintf(one, sizeof one, "%s/%s", path, name);
        s = http_json(u->cli->http, "DELETE", one, NULL, NULL, NULL, err);
        if (s == STATUS_OK) s = http_json(u->cli->http, "POST", path, NULL, body, answer, err);
    }
    json_decref(body);
    return s == STATUS_OK ? s : error_prefix(err, s, "cannot declare '%s'", file->name);
}

/* Declares all files in few requests, because one after the other takes minutes for the slices of a scan. After a
 * refusal the files are declared one by one, which finds the file at fault; the server knows the others then. */
static void declare_all(struct submit *u)
{
    char path[256];
    if (cli_job_path(u->id, "/files", path, sizeof path, NULL) != STATUS_OK) return;
    for (size_t i = 0; u->list.n_file > 1 && i < u->list.n_file; i += DECLARE_AT_ONCE) {
        json_t *list = json_array(), *answer = NULL;
        for (size_t k = i; k < u->list.n_file && k < i + DECLARE_AT_ONCE; k++)
            json_array_append_new(list, declaration(&u->list.file[k]));
        bool taken = http_json(u->cli->http, "POST", path, NULL, list, &answer, NULL) == STATUS_OK;
        json_decref(answer);
        json_decref(list);
        if (!taken) return;
    }
}

static status send_files(struct submit *u, struct error *err)
{
    status s = STATUS_OK;
    size_t n_sent = 0;
    uint64_t piece_bytes = cli_piece_bytes(u->cli);
    u->verb = "uploading";
    u->started_s = clock_monotonic_s();
    u->n_before = u->n_now = 0;
    declare_all(u);
    for (size_t i = 0; i < u->list.n_file && s == STATUS_OK; i++) {
        const struct cli_file *file = &u->list.file[i];
        json_t *answer = NULL;
        u->name = file->name;
        u->n_now = 0;
        s = declare(u, file, &answer, err);
        const char *state = json_string_value(json_object_get(answer, "state"));
        const char *url = json_string_value(json_object_get(answer, "upload_url"));
        bool complete = state != NULL && strcmp(state, "complete") == 0;
        if (s == STATUS_OK && !complete && url == NULL)
            s = error_set(err, STATUS_FORMAT, "the server gives no address to upload '%s' to", file->name);
        if (s == STATUS_OK && !complete) {
            s = cli_upload_file(u->cli, file, url, piece_bytes, uploaded, u, err);
            if (s == STATUS_CHECKSUM) /* damaged in transfer: send it once more from the start */
                s = cli_upload_file(u->cli, file, url, piece_bytes, uploaded, u, err);
            n_sent += s == STATUS_OK;
        }
        u->n_before += file->n_bytes;
        json_decref(answer);
    }
    draw_end(u);
    char size[CLI_SHORT_TEXT];
    text_size((double)u->n_before, size);
    if (s == STATUS_OK)
        fprintf(u->cli->note, "%zu file%s in place (%s), %zu uploaded now, %zu on the server already, in %.1f s\n",
                u->list.n_file, u->list.n_file == 1 ? "" : "s", size, n_sent, u->list.n_file - n_sent,
                clock_monotonic_s() - u->started_s);
    return s;
}

static status start_job(struct submit *u, struct error *err)
{
    char path[256];
    status s = cli_job_path(u->id, "/start", path, sizeof path, err);
    if (s == STATUS_OK) s = http_json(u->cli->http, "POST", path, NULL, NULL, NULL, err);
    return s == STATUS_OK ? s : error_prefix(err, s, "cannot start the job");
}

/* Prints every fault and warning that the server's worker finds in the files, and the statements of the files.
 * STATUS_INVALID when there are faults. */
static status judge_files(struct submit *u, struct error *err)
{
    char path[256];
    json_t *report = NULL;
    status s = cli_job_path(u->id, "/check", path, sizeof path, err);
    if (s == STATUS_OK) s = http_json(u->cli->http, "POST", path, NULL, NULL, &report, err);
    if (s != STATUS_OK) return error_prefix(err, s, "cannot have the files judged");
    const size_t n = cli_print_faults(json_object_get(report, "errors"), "fault", u->cli->note);
    cli_print_faults(json_object_get(report, "warnings"), "warning", u->cli->note);
    cli_print_statements(json_object_get(report, "files"), u->cli->note);
    json_decref(report);
    return n == 0 ? STATUS_OK
                  : error_set(err, STATUS_INVALID, "the input has %zu fault%s, so the job is not started", n,
                              n == 1 ? "" : "s");
}

status cli_submit_document(struct cli *cli, const json_t *document, const char *folder, char id[CLI_ID_BYTES],
                           struct error *err)
{
    struct submit u = {.cli = cli, .document = json_deep_copy(document)};
    status s = u.document != NULL ? cli_job_files_list(u.document, folder, &u.list, err)
                                  : error_set(err, STATUS_NO_MEMORY, "cannot make the job document: out of memory");
    if (s == STATUS_OK) s = hash_files(&u, err);
    if (s == STATUS_OK) s = create_job(&u, err);
    if (s == STATUS_OK) s = send_files(&u, err);
    if (s == STATUS_OK) s = judge_files(&u, err);
    if (s == STATUS_OK) s = start_job(&u, err);
    draw_end(&u);
    snprintf(id, CLI_ID_BYTES, "%s", u.id);
    cli_job_files_release(&u.list);
    json_decref(u.document);
    json_decref(u.job);
    return s;
}

static status send_once(struct submit *u, bool (*unchanged)(void *context), void *context, struct error *err)
{
    char path[256];
    const char *state = json_string_value(json_object_get(u->job, "state"));
    if (state == NULL || strcmp(state, "draft") != 0) return STATUS_OK;
    status s = send_files(u, err);
    if (s != STATUS_OK) return s;
    if (unchanged(context)) return start_job(u, err);
    s = cli_job_path(u->id, "", path, sizeof path, err);
    if (s == STATUS_OK) s = http_json(u->cli->http, "DELETE", path, NULL, NULL, NULL, err);
    return s == STATUS_OK ? error_set(err, STATUS_STALE, "the files changed while they were sent") : s;
}

status cli_submit_once(struct cli *cli, const json_t *document, const char *folder, bool (*unchanged)(void *context),
                       void *context, char id[CLI_ID_BYTES], struct error *err)
{
    struct submit u = {.cli = cli, .document = json_deep_copy(document)};
    status s = u.document != NULL ? cli_job_files_list_strict(u.document, folder, &u.list, err)
                                  : error_set(err, STATUS_NO_MEMORY, "cannot make the job document: out of memory");
    if (s == STATUS_OK) s = hash_files(&u, err);
    if (s == STATUS_OK) s = content_key(&u, err);
    if (s == STATUS_OK) s = create_job(&u, err);
    if (s == STATUS_OK) s = send_once(&u, unchanged, context, err);
    snprintf(id, CLI_ID_BYTES, "%s", u.id);
    cli_job_files_release(&u.list);
    json_decref(u.document);
    json_decref(u.job);
    return s;
}

CLI_COMMAND(
    SUBMIT, cli_submit, .place = 10, .name = "submit", .operand = "JOB.json", .needs = "a job document",
    .options = "input-dir watch require resume draft id-file",
    .summary = "send a job document and its files, and start the job",
    .text =
        "Every file that the document names is taken from the document's folder (or --input-dir), declared with\n"
        "its SHA-256 and uploaded. An upload that breaks continues where it stopped; `selvedge submit --resume ID`\n"
        "continues a submit that was interrupted. Prints the job's id on standard output.\n")

status cli_submit(struct cli *cli, int *exit_code, struct error *err)
{
    struct submit u = {.cli = cli};
    status s = STATUS_OK;
    if (cli->args->operand != NULL && (s = read_document(&u, cli->args->operand, err)) != STATUS_OK) goto out;
    if (cli->args->resume_id != NULL && (s = open_job(&u, err)) != STATUS_OK) goto out;
    if ((s = list_files(&u, err)) != STATUS_OK) goto out;
    /* before the job is created, so that a missing file leaves no job behind */
    if ((s = hash_files(&u, err)) != STATUS_OK) goto out;
    if (cli->args->resume_id == NULL && (s = create_job(&u, err)) != STATUS_OK) goto out;
    if ((s = send_files(&u, err)) != STATUS_OK) goto out;
    if (!cli->args->draft && (s = judge_files(&u, err)) != STATUS_OK) goto out;
    if (!cli->args->draft && (s = start_job(&u, err)) != STATUS_OK) goto out;
    fprintf(cli->out, "%s\n", u.id);
    fflush(cli->out);
    if (cli->args->draft)
        fprintf(cli->note, "not started; start it with: selvedge submit --resume %s\n", u.id);
    else if (!cli->args->watch)
        fprintf(cli->note, "started; follow it with: selvedge watch %s, or at %s/#%s\n", u.id, http_server(cli->http),
                u.id);
    else
        s = cli_watch_job(cli, u.id, exit_code, err);
out:
    draw_end(&u);
    if (s != STATUS_OK && u.id[0] != '\0' && !(cli->args->watch && s == STATUS_CANCELLED))
        fprintf(cli->note, "continue with: selvedge submit --resume %s%s%s\n", u.id,
                cli->args->operand == NULL ? "" : " ", cli->args->operand == NULL ? "" : cli->args->operand);
    cli_job_files_release(&u.list);
    json_decref(u.document);
    json_decref(u.job);
    return s;
}
