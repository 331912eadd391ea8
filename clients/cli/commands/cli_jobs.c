/* The short commands, which make one or two calls and print the reply. */
#include "clients/cli/commands/cli.h"
#include "clients/cli/text/cli_report.h"
#include "clients/cli/text/cli_text.h"

#include <stdlib.h>
#include <string.h>

status cli_job_path(const char *id, const char *tail, char *path, size_t n_path, struct error *err)
{
    size_t n = strlen(id);
    bool good = n > 0 && n < 80;
    for (size_t i = 0; i < n && good; i++)
        good = (id[i] >= '0' && id[i] <= '9') || (id[i] >= 'a' && id[i] <= 'z') || (id[i] >= 'A' && id[i] <= 'Z') ||
               id[i] == '-' || id[i] == '_';
    if (!good) return error_set(err, STATUS_INVALID, "'%.80s' is not a job id; `selvedge list` shows them", id);
    snprintf(path, n_path, "/v1/jobs/%s%s", id, tail);
    return STATUS_OK;
}

void cli_name_escape(const char *name, char out[CLI_ESCAPED_BYTES])
{
    static const char plain[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789._-";
    size_t n = 0;
    for (; *name != '\0' && n + 4 <= CLI_ESCAPED_BYTES; name++)
        n += (size_t)snprintf(out + n, CLI_ESCAPED_BYTES - n, strchr(plain, *name) != NULL ? "%c" : "%%%02X",
                              (unsigned char)*name);
    out[n] = '\0';
}

static status job_call(struct cli *cli, const char *method, const char *tail, json_t **job, struct error *err)
{
    char path[256];
    status s = cli_job_path(cli->args->operand, tail, path, sizeof path, err);
    return s != STATUS_OK ? s : http_json(cli->http, method, path, NULL, NULL, job, err);
}

void cli_print_json(const json_t *value, FILE *out)
{
    /* for programs: the server's numbers to the last digit */
    json_dumpf(value, out, JSON_INDENT(2) | JSON_REAL_PRECISION(17));
    fputc('\n', out);
}

status cli_add_result(struct cli *cli, json_t *job, struct error *err)
{
    json_t *result = NULL;
    const char *url = json_string_value(json_object_get(job, "result_url"));
    status s = url == NULL || url[0] != '/' ? STATUS_OK : http_json(cli->http, "GET", url, NULL, NULL, &result, err);
    if (s != STATUS_OK) return error_prefix(err, s, "cannot read the result");
    json_t *parameters = json_object_get(result, "parameters");
    json_object_set_new(job, "parameters", parameters == NULL ? json_null() : json_incref(parameters));
    json_object_set_new(job, "result", result == NULL ? json_null() : result);
    return STATUS_OK;
}

CLI_COMMAND(STATUS, cli_status, .place = 50, .name = "status", .operand = "ID", .options = "json",
            .summary = "show one job", .text = "Exit status 0 whatever the job's state is.\n")

status cli_status(struct cli *cli, int *exit_code, struct error *err)
{
    (void)exit_code;
    json_t *job = NULL;
    status s = job_call(cli, "GET", "", &job, err);
    if (s == STATUS_OK) s = cli_add_result(cli, job, err);
    if (s == STATUS_OK && cli->args->json) cli_print_json(job, cli->out);
    if (s == STATUS_OK && !cli->args->json) report_job(job, cli->out);
    json_decref(job);
    return s;
}

/* Returns the effect of a cancel or retry on a job in the state before it; NULL: none. */
static const char *effect_of(bool cancel, const char *before)
{
    bool running = strcmp(before, "running") == 0;
    bool waits = strcmp(before, "queued") == 0 || strcmp(before, "paused") == 0;
    if (!cancel) return running || waits ? NULL : "continues from its last checkpoint";
    if (running) return "cancellation requested";
    return waits || strcmp(before, "draft") == 0 ? "cancelled" : NULL;
}

static status act(struct cli *cli, bool cancel, struct error *err)
{
    json_t *job = NULL, *was = NULL;
    status s = job_call(cli, "GET", "", &was, err);
    if (s == STATUS_OK) s = job_call(cli, "POST", cancel ? "/cancel" : "/retry", &job, err);
    if (s == STATUS_OK) {
        struct job_view before, now;
        report_view(was, &before);
        report_view(job, &now);
        const char *effect = effect_of(cancel, before.state);
        if (effect != NULL)
            fprintf(cli->out, "%s: %s (now %s)\n", cli->args->operand, effect, now.state);
        else
            fprintf(cli->out, "%s: nothing to do, it is already %s\n", cli->args->operand, now.state);
    }
    json_decref(job);
    json_decref(was);
    return s;
}

CLI_COMMAND(CANCEL, cli_cancel, .place = 80, .name = "cancel", .operand = "ID",
            .summary = "stop a job; its results so far are kept")

status cli_cancel(struct cli *cli, int *exit_code, struct error *err)
{
    (void)exit_code;
    return act(cli, true, err);
}

CLI_COMMAND(RETRY, cli_retry, .place = 90, .name = "retry", .operand = "ID",
            .summary = "start a failed or cancelled job again from its last checkpoint")

status cli_retry(struct cli *cli, int *exit_code, struct error *err)
{
    (void)exit_code;
    return act(cli, false, err);
}

CLI_COMMAND(DELETE, cli_delete, .place = 140, .name = "delete", .operand = "ID",
            .summary = "remove a job and its files", .text = "A running job is stopped first; its results are lost.\n")

status cli_delete(struct cli *cli, int *exit_code, struct error *err)
{
    (void)exit_code;
    status s = job_call(cli, "DELETE", "", NULL, err);
    if (s == STATUS_OK) fprintf(cli->out, "%s: deleted\n", cli->args->operand);
    return s;
}

/* Prints the log from *offset on and advances *offset; *n_new is the number of bytes printed. */
static status log_piece(struct cli *cli, int64_t *offset, size_t *n_new, struct error *err)
{
    char path[256], tail[96];
    struct http_reply reply;
    snprintf(tail, sizeof tail, "/log?offset=%lld&max_bytes=1048576", (long long)*offset);
    status s = cli_job_path(cli->args->operand, tail, path, sizeof path, err);
    if (s != STATUS_OK) return s;
    s = http_call(cli->http, "GET", path, NULL, NULL, 0, &reply, err);
    if (s == STATUS_OK && reply.code != 200 && reply.code != 204) s = http_problem(&reply, err);
    *n_new = 0;
    if (s == STATUS_OK && reply.n_body > 0) {
        for (size_t i = 0; i < reply.n_body; i++) { /* the log may quote file names: remove their terminal escapes */
            unsigned char c = (unsigned char)reply.body[i];
            fputc(c < 0x20 && c != '\n' && c != '\t' ? '?' : c, cli->out);
        }
        fflush(cli->out);
        *n_new = reply.n_body;
        *offset = reply.log_next >= 0 ? reply.log_next : *offset + (int64_t)reply.n_body;
    }
    http_reply_release(&reply);
    return s;
}

static status job_is_active(struct cli *cli, bool *active, struct error *err)
{
    json_t *job = NULL;
    struct job_view view;
    status s = job_call(cli, "GET", "", &job, err);
    report_view(job, &view);
    *active =
        strcmp(view.state, "running") == 0 || strcmp(view.state, "queued") == 0 || strcmp(view.state, "paused") == 0;
    json_decref(job);
    return s;
}

CLI_COMMAND(LOG, cli_log, .place = 120, .name = "log", .operand = "ID", .options = "follow",
            .summary = "print the job's log")

status cli_log(struct cli *cli, int *exit_code, struct error *err)
{
    (void)exit_code;
    int64_t offset = 0;
    status s = STATUS_OK;
    for (;;) {
        size_t n_new;
        bool active = false;
        if (cli->args->follow && (s = job_is_active(cli, &active, err)) != STATUS_OK)
            break; /* the state is read first, because the last lines of a job are in the log when it has ended */
        do {
            if ((s = log_piece(cli, &offset, &n_new, err)) != STATUS_OK) return s;
        } while (n_new > 0);
        if (!active || http_stopped(cli->http)) break;
        http_sleep(cli->http, 1.0);
    }
    return s;
}

static void print_point(const json_t *point, FILE *out)
{
    size_t i;
    const json_t *value;
    fprintf(
        out, "%lld\t%s\t%s\t%.2f\t%.0f\t%.8g\t%.4g\t%.6g",
        (long long)json_integer_value(json_object_get(point, "step")),
        json_string_value(json_object_get(point, "model")) == NULL ? "-"
                                                                   : json_string_value(json_object_get(point, "model")),
        json_string_value(json_object_get(point, "phase")) == NULL ? "-"
                                                                   : json_string_value(json_object_get(point, "phase")),
        json_number_value(json_object_get(point, "wall_s")), json_number_value(json_object_get(point, "n_path_total")),
        json_number_value(json_object_get(point, "objective")),
        json_number_value(json_object_get(point, "objective_se")),
        json_number_value(json_object_get(point, "rel_rms")));
    json_array_foreach(json_object_get(point, "parameter"), i, value) fprintf(out, "\t%.7g", json_number_value(value));
    fputc('\n', out);
}

CLI_COMMAND(SERIES, cli_series, .place = 130, .name = "series", .operand = "ID", .options = "json",
            .summary = "print the fit step by step: sum of squared errors, relative error, parameters (tab-separated)")

status cli_series(struct cli *cli, int *exit_code, struct error *err)
{
    (void)exit_code;
    long long after = -1;
    bool first = true;
    json_t *all = json_array();
    status s;
    for (;;) {
        char tail[96];
        json_t *page = NULL, *point;
        size_t i;
        snprintf(tail, sizeof tail, "/series?after_step=%lld&max_points=5000", after);
        if ((s = job_call(cli, "GET", tail, &page, err)) != STATUS_OK) break;
        const json_t *points = json_object_get(page, "points");
        json_array_foreach(points, i, point)
        {
            if (cli->args->json) json_array_append(all, point);
            if (!cli->args->json && first)
                fprintf(cli->out,
                        "step\tmodel\tphase\twall_s\tn_path_total\tobjective\tobjective_se\trel_rms\tparameters\n");
            if (!cli->args->json) print_point(point, cli->out);
            first = false;
        }
        long long next = json_integer_value(json_object_get(page, "next_after_step"));
        bool more = json_array_size(points) > 0 && next > after;
        after = next;
        json_decref(page);
        if (!more) break;
    }
    if (s == STATUS_OK && cli->args->json) cli_print_json(all, cli->out);
    if (s == STATUS_OK && !cli->args->json && first) fprintf(cli->note, "the fit has not started\n");
    json_decref(all);
    return s;
}
