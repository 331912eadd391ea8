#include "clients/cli/commands/cli_derive.h"
#include "base/files/durable.h"
#include "clients/cli/commands/cli_job_files.h"

#include <libgen.h>
#include <sodium.h>
#include <stdlib.h>
#include <string.h>

static void ignore(void *context, uint64_t offset) { (void)context, (void)offset; }

/* Uploads the mesh of the new job, and starts it. */
static status send_mesh(struct cli *cli, const char *id, const char *mesh, struct error *err)
{
    char path[256], copy[4096], *own = strdup(mesh);
    json_t *answer = NULL;
    if (own == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot send '%s': out of memory", mesh);
    snprintf(copy, sizeof copy, "%s", mesh);
    struct cli_file file = {.name = basename(copy), .path = own, .role = "mesh"};
    status s = cli_file_hash(&file, NULL, NULL, err);
    if (s == STATUS_OK) s = cli_job_path(id, "/files", path, sizeof path, err);
    if (s == STATUS_OK) {
        json_t *body = json_pack("{s:s, s:s, s:I, s:s}", "name", file.name, "role", file.role, "size",
                                 (json_int_t)file.n_bytes, "sha256", file.sha256);
        s = body != NULL ? http_json(cli->http, "POST", path, NULL, body, &answer, err)
                         : error_set(err, STATUS_INVALID, "file name '%s' is not UTF-8", file.name);
        json_decref(body);
    }
    const char *url = json_string_value(json_object_get(answer, "upload_url"));
    if (s == STATUS_OK && url != NULL) s = cli_upload_file(cli, &file, url, cli_piece_bytes(cli), ignore, NULL, err);
    json_decref(answer);
    if (s == STATUS_OK) s = cli_job_path(id, "/start", path, sizeof path, err);
    if (s == STATUS_OK) s = http_json(cli->http, "POST", path, NULL, NULL, NULL, err);
    free(own);
    return s;
}

static status note_id(struct cli *cli, const char *id, struct error *err)
{
    char line[CLI_ID_BYTES + 1];
    fprintf(cli->note, "job %s created\n", id);
    if (cli->args->id_file == NULL) return STATUS_OK;
    const int n = snprintf(line, sizeof line, "%s\n", id);
    return durable_replace_volatile(cli->args->id_file, line, (size_t)n, err);
}

status cli_derive(struct cli *cli, const char *id, const json_t *wanted, const char *mesh, char made[CLI_ID_BYTES],
                  int *exit_code, struct error *err)
{
    char path[256], key[33];
    unsigned char random[16];
    json_t *job = NULL;
    randombytes_buf(random, sizeof random);
    sodium_bin2hex(key, sizeof key, random, sizeof random);
    status s = cli_job_path(id, "/derive", path, sizeof path, err);
    if (s == STATUS_OK) s = http_json(cli->http, "POST", path, key, wanted, &job, err);
    const char *text = json_string_value(json_object_get(job, "id"));
    if (s == STATUS_OK && text == NULL) s = error_set(err, STATUS_FORMAT, "the server's reply has no job id");
    snprintf(made, CLI_ID_BYTES, "%s", s == STATUS_OK ? text : "");
    json_decref(job);
    if (s == STATUS_OK) s = note_id(cli, made, err);
    if (s == STATUS_OK && mesh != NULL) s = send_mesh(cli, made, mesh, err);
    if (s == STATUS_OK) s = cli_watch_job(cli, made, exit_code, err);
    if (s != STATUS_OK && s != STATUS_CONFLICT && made[0] != '\0') /* a conflict is a job that has failed */
        fprintf(cli->note, "continue with: selvedge watch %s, then selvedge results %s\n", made, made);
    return s;
}

status cli_fetch_results(struct cli *cli, const char *id, const char *prefix, struct error *err)
{
    char path[256], folder[4096];
    json_t *list = NULL, *wanted = json_array();
    const json_t *file;
    size_t i;
    snprintf(folder, sizeof folder, "%s%s", cli->args->out_dir != NULL ? cli->args->out_dir : "selvedge-",
             cli->args->out_dir != NULL ? "" : id);
    status s = cli_job_path(id, "/results", path, sizeof path, err);
    if (s == STATUS_OK) s = http_json(cli->http, "GET", path, NULL, NULL, &list, err);
    json_array_foreach(json_object_get(list, "files"), i, file)
    {
        const char *name = json_string_value(json_object_get(file, "path"));
        if (name != NULL && strncmp(name, prefix, strlen(prefix)) == 0) json_array_append(wanted, (json_t *)file);
    }
    if (s == STATUS_OK && json_array_size(wanted) == 0)
        s = error_set(err, STATUS_NOT_FOUND, "job %s has made no files '%s': its warnings say why", id, prefix);
    if (s == STATUS_OK) s = cli_files_fetch(cli, wanted, folder, err);
    if (s == STATUS_OK) fprintf(cli->out, "%s\n", folder);
    json_decref(wanted);
    json_decref(list);
    return s;
}
