#include "clients/cli/commands/cli.h"
#include "clients/cli/text/cli_text.h"

#include "base/files/durable.h"

#include <fcntl.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

struct transfer {
    struct cli *cli;
    uint64_t n_total, n_before;
    char name[80];
};

static void got(void *context, uint64_t n, uint64_t n_total)
{
    struct transfer *t = context;
    (void)n_total;
    if (!t->cli->note_is_terminal) return;
    char bar[40], done[CLI_SHORT_TEXT], total[CLI_SHORT_TEXT];
    double part = (double)(t->n_before + n);
    text_bar(t->n_total > 0 ? part / (double)t->n_total : 1.0, 24, bar, sizeof bar);
    text_size(part, done);
    text_size((double)t->n_total, total);
    fprintf(t->cli->note, "\r\033[Kdownloading %s  %s of %s  %.30s", bar, done, total, t->name);
    fflush(t->cli->note);
}

bool cli_path_is_safe(const char *path)
{
    if (path[0] == '\0' || path[0] == '/' || strlen(path) > 1000) return false;
    for (const char *p = path; *p != '\0'; p++)
        if ((unsigned char)*p < 0x20 || *p == '\\') return false;
    for (const char *p = path; p != NULL; p = strchr(p, '/')) {
        if (*p == '/') p++;
        if (strncmp(p, "..", 2) == 0 && (p[2] == '/' || p[2] == '\0')) return false;
    }
    return true;
}

static status fetch(struct transfer *t, const char *folder, const json_t *file, size_t *n_fetched, struct error *err)
{
    const char *path = json_string_value(json_object_get(file, "path")),
               *url = json_string_value(json_object_get(file, "url"));
    uint64_t n_bytes = (uint64_t)json_integer_value(json_object_get(file, "size"));
    char target[4096], parent[4096];
    struct stat info;
    if (path == NULL || url == NULL || url[0] != '/' || !cli_path_is_safe(path))
        return error_set(err, STATUS_FORMAT, "the server lists a result with an unusable name");
    if (snprintf(target, sizeof target, "%s/%s", folder, path) >= (int)sizeof target)
        return error_set(err, STATUS_INVALID, "the path '%.80s...' is too long", target);
    snprintf(parent, sizeof parent, "%s", target);
    *strrchr(parent, '/') = '\0';
    status s = durable_make_folder(parent, err);
    if (s != STATUS_OK) return s;
    double modified = json_number_value(json_object_get(file, "modified_unix_s"));
    bool whole = stat(target, &info) == 0 && (uint64_t)info.st_size == n_bytes &&
                 fabs((double)info.st_mtim.tv_sec + 1e-9 * (double)info.st_mtim.tv_nsec - modified) < 0.01;
    text_clean(path, t->name, sizeof t->name);
    if (!whole) {
        s = http_download(t->cli->http, url, target, got, t, err);
        if (s != STATUS_OK) return error_prefix(err, s, "cannot download '%s'", path);
        /* set the server's time of change, by which the next download recognises the file */
        struct timespec times[2] = {
            {.tv_nsec = UTIME_OMIT},
            {.tv_sec = (time_t)modified, .tv_nsec = (long)(1e9 * (modified - floor(modified)))}};
        (void)utimensat(AT_FDCWD, target, times, 0);
        (*n_fetched)++;
    }
    t->n_before += n_bytes;
    return STATUS_OK;
}

CLI_COMMAND(
    RESULTS, cli_results, .place = 100, .name = "results", .operand = "ID", .options = "out",
    .summary = "download the results",
    .text =
        "Files go to the folder of --out (default: selvedge-ID). A download that breaks continues where it stopped;\n"
        "complete files are not downloaded again.\n")

status cli_results(struct cli *cli, int *exit_code, struct error *err)
{
    (void)exit_code;
    return cli_results_to_out(cli, cli->args->operand, err);
}

status cli_results_to_out(struct cli *cli, const char *id, struct error *err)
{
    char folder[4096];
    if (cli->args->out_dir != NULL)
        snprintf(folder, sizeof folder, "%s", cli->args->out_dir);
    else
        snprintf(folder, sizeof folder, "selvedge-%s", id);
    status s = cli_results_of(cli, id, folder, err);
    if (s == STATUS_OK) fprintf(cli->out, "%s\n", folder);
    return s;
}

status cli_files_fetch(struct cli *cli, const json_t *files, const char *folder, struct error *err)
{
    char size[CLI_SHORT_TEXT];
    struct transfer t = {.cli = cli};
    size_t i, n_fetched = 0;
    const json_t *file;
    status s = STATUS_OK;
    json_array_foreach(files, i, file) t.n_total += (uint64_t)json_integer_value(json_object_get(file, "size"));
    json_array_foreach(files, i, file)
    {
        if ((s = fetch(&t, folder, file, &n_fetched, err)) != STATUS_OK) break;
    }
    if (cli->note_is_terminal) fputs("\r\033[K", cli->note);
    if (s != STATUS_OK) return s;
    text_size((double)t.n_total, size);
    fprintf(cli->note, "%zu files (%s) in %s, %zu of them new\n", json_array_size(files), size, folder, n_fetched);
    return STATUS_OK;
}

status cli_results_of(struct cli *cli, const char *id, const char *folder, struct error *err)
{
    char path[256];
    json_t *list = NULL;
    status s = cli_job_path(id, "/results", path, sizeof path, err);
    if (s == STATUS_OK) s = http_json(cli->http, "GET", path, NULL, NULL, &list, err);
    if (s != STATUS_OK) return s;
    const json_t *files = json_object_get(list, "files");
    if (json_array_size(files) == 0)
        s = error_set(err, STATUS_NOT_FOUND, "job %s has no results yet; `selvedge watch %s` waits for them", id, id);
    else
        s = cli_files_fetch(cli, files, folder, err);
    json_decref(list);
    return s;
}
