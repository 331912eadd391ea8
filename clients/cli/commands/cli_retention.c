/* The commands about which jobs stay: keep, unkeep, retention. */
#include "clients/cli/commands/cli.h"
#include "clients/cli/text/cli_text.h"
#include "clients/cli/text/text_table.h"

#include <stdlib.h>
#include <string.h>
#include <time.h>

enum { PIECE = 1000 }; /* jobs that one request removes at most */

static status set_kept(struct cli *cli, const char *method, const char *done, struct error *err)
{
    char path[256];
    status s = cli_job_path(cli->args->operand, "/keep", path, sizeof path, err);
    if (s == STATUS_OK) s = http_json(cli->http, method, path, NULL, NULL, NULL, err);
    if (s == STATUS_OK) fprintf(cli->out, "%s: %s\n", cli->args->operand, done);
    return s;
}

CLI_COMMAND(KEEP, cli_keep, .place = 170, .name = "keep", .operand = "ID",
            .summary = "keep a job, whatever the limits of retention say")

status cli_keep(struct cli *cli, int *exit_code, struct error *err)
{
    (void)exit_code;
    return set_kept(cli, "PUT", "kept", err);
}

CLI_COMMAND(UNKEEP, cli_unkeep, .place = 180, .name = "unkeep", .operand = "ID", .summary = "take that back")

status cli_unkeep(struct cli *cli, int *exit_code, struct error *err)
{
    (void)exit_code;
    return set_kept(cli, "DELETE", "no longer kept", err);
}

/* Appends "name=value" to a query; only digits reach the address. */
static status add_limit(char *path, size_t n_path, const char *name, const char *option, const char *value,
                        struct error *err)
{
    if (value == NULL) return STATUS_OK;
    if (strspn(value, "0123456789") != strlen(value) || strlen(value) > 18)
        return error_set(err, STATUS_INVALID, "option '--%s' takes a whole number, not '%s'", option, value);
    size_t n = strlen(path);
    snprintf(path + n, n_path - n, "%c%s=%s", strchr(path, '?') == NULL ? '?' : '&', name, value);
    return STATUS_OK;
}

static void add_job(const json_t *job, struct text_table *table)
{
    char day[32] = "-", size[CLI_SHORT_TEXT];
    const char *id = json_string_value(json_object_get(job, "id")),
               *state = json_string_value(json_object_get(job, "state")),
               *reason = json_string_value(json_object_get(job, "reason")),
               *name = json_string_value(json_object_get(job, "sample"));
    time_t end = (time_t)json_number_value(json_object_get(job, "finished_unix_s"));
    struct tm date;
    if (localtime_r(&end, &date) != NULL) strftime(day, sizeof day, "%Y-%m-%d", &date);
    text_size(json_number_value(json_object_get(job, "bytes")), size);
    text_table_add(table, (const char *const[]){id == NULL ? "?" : id, state == NULL ? "?" : state, day, size,
                                                reason == NULL ? "?" : reason, name == NULL ? "" : name});
}

static void print_jobs(const json_t *jobs, FILE *out)
{
    static const char *const head[] = {"id", "*state", "ended", ">size", "for its", "sample", NULL};
    struct text_table table = {.head = head, .colored = text_colored(out)};
    size_t i;
    const json_t *job;
    json_array_foreach(jobs, i, job) add_job(job, &table);
    text_table_print(&table, out);
}

static void print_plan(const struct cli *cli, const json_t *plan)
{
    char removed[CLI_SHORT_TEXT], total[CLI_SHORT_TEXT];
    const json_t *jobs = json_object_get(plan, "jobs");
    text_size(json_number_value(json_object_get(plan, "removed_bytes")), removed);
    text_size(json_number_value(json_object_get(plan, "total_bytes")), total);
    if (json_is_null(json_object_get(plan, "max_age_days")) && json_is_null(json_object_get(plan, "max_bytes")))
        fprintf(cli->note, "the service has no limits of age or size; --max-age-days and --max-bytes set some here\n");
    print_jobs(jobs, cli->out);
    fprintf(cli->note, "%zu jobs with %s of %s would go; %lld jobs are kept\n", json_array_size(jobs), removed, total,
            (long long)json_integer_value(json_object_get(plan, "n_kept")));
    if (json_array_size(jobs) > 0 && !cli->args->yes) fprintf(cli->note, "nothing was removed; --yes removes them\n");
}

/* Removes the listed jobs from number `first` on, as many as one request may name, and adds to the outcome. */
static status remove_piece(struct cli *cli, const json_t *jobs, size_t first, json_t *outcome, struct error *err)
{
    json_t *ids = json_array(), *reply = NULL;
    for (size_t i = first; i < json_array_size(jobs) && i < first + PIECE; i++)
        json_array_append(ids, json_object_get(json_array_get(jobs, i), "id"));
    json_t *body = json_pack("{s:o}", "jobs", ids);
    status s = http_json(cli->http, "POST", "/v1/retention", NULL, body, &reply, err);
    json_decref(body);
    if (s == STATUS_OK) {
        json_array_extend(json_object_get(outcome, "removed"), json_object_get(reply, "removed"));
        json_array_extend(json_object_get(outcome, "not_removed"), json_object_get(reply, "not_removed"));
        json_int_t sum = json_integer_value(json_object_get(outcome, "removed_bytes")) +
                         json_integer_value(json_object_get(reply, "removed_bytes"));
        json_object_set_new(outcome, "removed_bytes", json_integer(sum));
    }
    json_decref(reply);
    return s;
}

static void print_outcome(const struct cli *cli, const json_t *outcome)
{
    char size[CLI_SHORT_TEXT], why[512];
    const json_t *removed = json_object_get(outcome, "removed"), *left = json_object_get(outcome, "not_removed"), *one;
    size_t i;
    print_jobs(removed, cli->out);
    text_size(json_number_value(json_object_get(outcome, "removed_bytes")), size);
    fprintf(cli->note, "%zu jobs with %s were removed\n", json_array_size(removed), size);
    json_array_foreach(left, i, one)
    {
        const char *text = json_string_value(json_object_get(one, "why"));
        text_clean(text == NULL ? "" : text, why, sizeof why);
        fprintf(cli->note, "not removed: %s\n", why);
    }
}

CLI_COMMAND(
    RETENTION, cli_retention, .place = 190, .name = "retention", .options = "max-age-days max-bytes yes json",
    .summary = "list the finished jobs that limits of age and size would remove; --yes removes them",
    .text =
        "Without options the limits are those of the service's settings. Only jobs that have ended are removed, but\n"
        "not those that are kept (`selvedge keep ID`), nor those whose geometry an unfinished job asks for. With\n"
        "--yes exactly the listed jobs are removed, and each is named.\n")

status cli_retention(struct cli *cli, int *exit_code, struct error *err)
{
    char path[160] = "/v1/retention";
    json_t *plan = NULL, *outcome = NULL;
    status s = add_limit(path, sizeof path, "max_age_days", "max-age-days", cli->args->max_age, err);
    if (s == STATUS_OK) s = add_limit(path, sizeof path, "max_bytes", "max-bytes", cli->args->max_bytes, err);
    if (s == STATUS_OK) s = http_json(cli->http, "GET", path, NULL, NULL, &plan, err);
    if (s != STATUS_OK) return s;
    const json_t *jobs = json_object_get(plan, "jobs");
    if (!cli->args->json && !cli->args->yes) print_plan(cli, plan);
    if (cli->args->yes) {
        outcome = json_pack("{s:[],s:i,s:[]}", "removed", "removed_bytes", 0, "not_removed");
        for (size_t i = 0; s == STATUS_OK && i < json_array_size(jobs); i += PIECE)
            s = remove_piece(cli, jobs, i, outcome, err);
        if (!cli->args->json) print_outcome(cli, outcome);
        if (json_array_size(json_object_get(outcome, "not_removed")) > 0) *exit_code = CLI_EXIT_ERROR;
    }
    if (cli->args->json) {
        json_dumpf(outcome != NULL ? outcome : plan, cli->out, JSON_INDENT(2));
        fputc('\n', cli->out);
    }
    json_decref(outcome);
    json_decref(plan);
    return s;
}
