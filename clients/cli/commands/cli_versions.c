/* The command versions: the results of a job's runs. */
#include "clients/cli/commands/cli.h"
#include "clients/cli/text/cli_text.h"
#include "clients/cli/text/text_table.h"

#include <stdlib.h>
#include <string.h>
#include <time.h>

static void add_version(const json_t *one, struct text_table *table)
{
    char number[24], date[40] = "-", size[CLI_SHORT_TEXT];
    time_t end = (time_t)json_number_value(json_object_get(one, "finished_unix_s"));
    struct tm local;
    if (localtime_r(&end, &local) != NULL) strftime(date, sizeof date, "%Y-%m-%d %H:%M:%S", &local);
    const char *verdict = json_string_value(json_object_get(json_object_get(one, "verdict"), "code"));
    text_size(json_number_value(json_object_get(one, "bytes")), size);
    snprintf(number, sizeof number, "%lld", (long long)json_integer_value(json_object_get(one, "version")));
    text_table_add(table,
                   (const char *const[]){number, date, size, verdict == NULL ? "-" : verdict,
                                         json_is_true(json_object_get(one, "current")) ? "the present result" : ""});
}

static status list_versions(struct cli *cli, const char *id, struct error *err)
{
    char path[256];
    size_t i;
    json_t *list = NULL, *one;
    static const char *const head[] = {">version", "finished", ">size", "*verdict", "", NULL};
    struct text_table table = {.head = head, .colored = text_colored(cli->out)};
    status s = cli_job_path(id, "/versions", path, sizeof path, err);
    if (s == STATUS_OK) s = http_json(cli->http, "GET", path, NULL, NULL, &list, err);
    if (s != STATUS_OK) return s;
    const json_t *versions = json_object_get(list, "versions");
    if (cli->args->json)
        cli_print_json(versions, cli->out);
    else if (json_array_size(versions) == 0)
        fprintf(cli->note, "job %s has no results yet; `selvedge watch %s` waits for them\n", id, id);
    else {
        json_array_foreach(versions, i, one) add_version(one, &table);
        text_table_print(&table, cli->out);
    }
    json_decref(list);
    return STATUS_OK;
}

static status download(struct cli *cli, const char *id, const char *number, struct error *err)
{
    char path[256], tail[48], folder[4096];
    json_t *version = NULL;
    if (number[0] == '\0' || strlen(number) > 9 || strspn(number, "0123456789") != strlen(number))
        return error_set(err, STATUS_INVALID, "the number of a version is a whole number, not '%s'", number);
    snprintf(tail, sizeof tail, "/versions/%s", number);
    status s = cli_job_path(id, tail, path, sizeof path, err);
    if (s == STATUS_OK) s = http_json(cli->http, "GET", path, NULL, NULL, &version, err);
    if (s != STATUS_OK) return error_prefix(err, s, "version %s of job %s", number, id);
    if (cli->args->out_dir != NULL)
        snprintf(folder, sizeof folder, "%s", cli->args->out_dir);
    else
        snprintf(folder, sizeof folder, "selvedge-%s-%s", id, number);
    s = cli_files_fetch(cli, json_object_get(version, "files"), folder, err);
    if (s == STATUS_OK) fprintf(cli->out, "%s\n", folder);
    json_decref(version);
    return s;
}

CLI_COMMAND(
    VERSIONS, cli_versions, .place = 110, .name = "versions", .operand = "ID", .second = "NUMBER",
    .options = "out json", .summary = "list the results of a job's earlier runs, or download one",
    .text = "A job that is edited and run again keeps its earlier results, each under the number of its run. With a\n"
            "NUMBER its files go to the folder of --out (default: selvedge-ID-NUMBER).\n")

status cli_versions(struct cli *cli, int *exit_code, struct error *err)
{
    (void)exit_code;
    const char *id = cli->args->operand, *number = cli->args->second;
    return number == NULL ? list_versions(cli, id, err) : download(cli, id, number, err);
}
