/* The list of jobs, and ids that are not written out. */
#include "base/clock.h"
#include "clients/cli/commands/cli.h"
#include "clients/cli/text/cli_report.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static bool filtered(const struct cli_args *a)
{
    return a->state != NULL || a->verdict != NULL || a->tag != NULL || a->sample != NULL || a->days != NULL;
}

/* Appends "&key=value" with the value escaped. */
static status add(char *path, size_t n_path, const char *key, const char *value, struct error *err)
{
    static const char plain[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-_.~,";
    size_t n = strlen(path);
    if (value == NULL) return STATUS_OK;
    n += (size_t)snprintf(path + n, n_path - n, "&%s=", key);
    for (; *value != '\0' && n + 4 < n_path; value++)
        n += (size_t)snprintf(path + n, n_path - n, strchr(plain, *value) != NULL ? "%c" : "%%%02X",
                              (unsigned char)*value);
    return *value == '\0' ? STATUS_OK : error_set(err, STATUS_INVALID, "the value of '--%s' is too long", key);
}

static status list_path(const struct cli *cli, char *path, size_t n_path, struct error *err)
{
    const struct cli_args *a = cli->args;
    char since[40] = "", *end = NULL;
    snprintf(path, n_path, "/v1/jobs?limit=100");
    if (a->days != NULL) {
        double days = strtod(a->days, &end);
        if (*end != '\0' || !(days > 0) || days > 1e5)
            return error_set(err, STATUS_INVALID, "--days is '%.40s'; it must be a number of days above 0", a->days);
        snprintf(since, sizeof since, "%.3f", fmax(clock_wall_s() - 86400 * days, 0));
    }
    status s = add(path, n_path, "state", a->state, err);
    if (s == STATUS_OK) s = add(path, n_path, "verdict", a->verdict, err);
    if (s == STATUS_OK) s = add(path, n_path, "tag", a->tag, err);
    if (s == STATUS_OK) s = add(path, n_path, "sample", a->sample, err);
    return s == STATUS_OK ? add(path, n_path, "created_after", a->days == NULL ? NULL : since, err) : s;
}

CLI_COMMAND(LIST, cli_list, .place = 70, .name = "list", .options = "json selection",
            .summary = "list the jobs, newest first")

status cli_list(struct cli *cli, int *exit_code, struct error *err)
{
    (void)exit_code;
    char base[2048], path[3072];
    size_t n_job = 0;
    struct text_table table = {.head = report_list_head, .colored = text_colored(cli->out)};
    status s = list_path(cli, base, sizeof base, err);
    if (s != STATUS_OK) return s;
    snprintf(path, sizeof path, "%s", base);
    json_t *all = json_array();
    for (;;) { /* one page of the list at a time */
        json_t *page = NULL, *job;
        size_t i;
        if ((s = http_json(cli->http, "GET", path, NULL, NULL, &page, err)) != STATUS_OK) break;
        json_array_foreach(json_object_get(page, "jobs"), i, job)
        {
            if (cli->args->json) json_array_append(all, job);
            if (!cli->args->json) report_list_add(job, &table);
            n_job++;
        }
        text_table_print(&table, cli->out);
        const char *cursor = json_string_value(json_object_get(page, "next_cursor"));
        if (cursor != NULL) snprintf(path, sizeof path, "%s&cursor=%s", base, cursor);
        bool more = cursor != NULL && json_array_size(json_object_get(page, "jobs")) > 0;
        json_decref(page);
        if (!more || ferror(cli->out)) break; /* whoever reads may have seen enough */
    }
    if (s == STATUS_OK && cli->args->json) cli_print_json(all, cli->out);
    if (s == STATUS_OK && !cli->args->json && n_job == 0)
        fprintf(cli->note, "%s\n",
                filtered(cli->args) ? "no job fits" : "no jobs; `selvedge submit JOB.json` makes one");
    json_decref(all);
    return s;
}

status cli_whole_id(struct cli *cli, const char *text, char id[CLI_ID_BYTES], struct error *err)
{
    char path[160];
    size_t n = strlen(text);
    json_t *page = NULL;
    snprintf(id, CLI_ID_BYTES, "%s", text);
    if (n < 4 || n >= 36 || strspn(text, "0123456789abcdef-") != n) return STATUS_OK; /* the server judges it */
    snprintf(path, sizeof path, "/v1/jobs?view=row&limit=2&id=%s", text);
    status s = http_json(cli->http, "GET", path, NULL, NULL, &page, err);
    if (s != STATUS_OK) return s;
    const json_t *jobs = json_object_get(page, "jobs");
    const char *found = json_string_value(json_object_get(json_array_get(jobs, 0), "id"));
    if (found == NULL)
        s = error_set(err, STATUS_NOT_FOUND, "no job has an id that begins with '%s'", text);
    else if (json_array_size(jobs) > 1)
        s = error_set(err, STATUS_INVALID, "the ids of several jobs begin with '%s'; give more of it", text);
    else
        snprintf(id, CLI_ID_BYTES, "%s", found);
    json_decref(page);
    return s;
}
