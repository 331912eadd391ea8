/* selvedge plan BATCH: the resources that the samples of a batch will need, and the resources that ended samples have
 * used. */
#include "clients/cli/batch/cli_batch.h"
#include "clients/cli/text/cli_text.h"

#include <stdlib.h>
#include <string.h>

static const char *text_of(const json_t *object, const char *key)
{
    const char *text = json_string_value(json_object_get(object, key));
    return text == NULL ? "" : text;
}

static double number_of(const json_t *object, const char *key)
{
    return json_number_value(json_object_get(object, key));
}

/* A job that has not begun, or that will begin anew. */
static bool will_run(const json_t *sample)
{
    static const char *const state[] = {"draft", "queued", "failed", "cancelled", "paused"};
    for (size_t i = 0; i < sizeof state / sizeof *state; i++)
        if (strcmp(text_of(sample, "state"), state[i]) == 0) return true;
    return false;
}

/* Whether the server refused this request alone: it still tells of the job. */
static bool answers(struct cli *cli, const char *job)
{
    char path[200];
    struct error unused = {0};
    snprintf(path, sizeof path, "/v1/jobs/%.80s", job);
    return http_json(cli->http, "GET", path, NULL, NULL, NULL, &unused) == STATUS_OK;
}

static void say_unplanned(struct cli *cli, const char *name, const struct error *fault)
{
    char sample[300], field[200], why[700];
    text_clean(name, sample, sizeof sample);
    text_clean(fault->field, field, sizeof field);
    text_clean(fault->text, why, sizeof why);
    fprintf(cli->note, "%s%s: cannot be planned: %s%s%s\n", cli->note_is_terminal ? "\r" : "", sample, field,
            field[0] != '\0' ? ": " : "", why);
}

/* Has every sample planned that will run. Says on standard error which cannot be planned, and counts them. */
static status plan_samples(struct cli *cli, const json_t *samples, size_t *n_failed, struct error *err)
{
    const json_t *one;
    size_t i, n = json_array_size(samples), n_said = 0;
    status result = STATUS_OK;
    json_array_foreach((json_t *)(uintptr_t)samples, i, one)
    {
        char path[200];
        struct error fault = {0};
        if (!will_run(one)) continue;
        snprintf(path, sizeof path, "/v1/jobs/%.80s/plan", text_of(one, "job"));
        status s = http_json(cli->http, "POST", path, NULL, NULL, NULL, &fault);
        if (s == STATUS_CONFLICT) continue; /* it has begun meanwhile */
        if (s == STATUS_INVALID || s == STATUS_NOT_FOUND || (s == STATUS_IO && answers(cli, text_of(one, "job")))) {
            say_unplanned(cli, text_of(one, "sample"), &fault);
            (*n_failed)++;
        } else if (s != STATUS_OK) {
            *err = fault;
            result = s;
            break;
        }
        if (cli->note_is_terminal) n_said += fprintf(cli->note, "\rplanned %zu of %zu samples", i + 1, n) > 0;
    }
    if (n_said > 0) fprintf(cli->note, "\n");
    return result;
}

static void print_needs(FILE *out, const char *label, const json_t *need)
{
    char memory[CLI_SHORT_TEXT], disk[CLI_SHORT_TEXT];
    text_size(number_of(need, "memory_bytes"), memory);
    text_size(number_of(need, "disk_bytes"), disk);
    fprintf(out, "%-10s %.3g core hours, %s of memory, %s of disk\n", label, number_of(need, "cpu_s") / 3600.0, memory,
            disk);
}

static void print_time(FILE *out, const json_t *plan, const json_t *expected)
{
    char likely[CLI_SHORT_TEXT], low[CLI_SHORT_TEXT], high[CLI_SHORT_TEXT];
    const long long n_core = (long long)json_integer_value(json_object_get(plan, "n_core")),
                    n_at_once = (long long)json_integer_value(json_object_get(expected, "n_at_once"));
    text_duration(number_of(expected, "wall_s"), likely);
    text_duration(number_of(expected, "wall_low_s"), low);
    text_duration(number_of(expected, "wall_high_s"), high);
    fprintf(out, "%-10s %s (%s to %s) on %lld core%s, %lld at a time\n", "time", likely, low, high, n_core,
            n_core == 1 ? "" : "s", n_at_once);
}

static void print_ratio(FILE *out, const json_t *ratio)
{
    static const struct {
        const char *key, *name;
    } part[] = {{"cpu_s", "core hours"}, {"job_s", "time of jobs"}, {"memory_bytes", "memory"}, {"disk_bytes", "disk"}};
    fprintf(out, "%-10s", "took over");
    for (size_t i = 0; i < sizeof part / sizeof *part; i++)
        if (json_is_number(json_object_get(ratio, part[i].key)))
            fprintf(out, "%s %s %.2f", i == 0 ? "" : ",", part[i].name, number_of(ratio, part[i].key));
    fprintf(out, "\n");
}

static void print_plan(struct cli *cli, const json_t *plan)
{
    char name[300];
    FILE *out = cli->out;
    const json_t *expected = json_object_get(plan, "expected"), *took = json_object_get(plan, "took"),
                 *ratio = json_object_get(plan, "ratio");
    const long long n_sample = (long long)json_integer_value(json_object_get(plan, "n_sample")),
                    n_planned = (long long)json_integer_value(json_object_get(expected, "n")),
                    n_took = (long long)json_integer_value(json_object_get(took, "n"));
    text_clean(text_of(plan, "name"), name, sizeof name);
    fprintf(out, "%-10s %s\n%-10s %lld, of which %lld are planned\n", "batch", name, "samples", n_sample, n_planned);
    if (n_planned == 0) return;
    print_needs(out, "expected", expected);
    print_time(out, plan, expected);
    if (n_took == 0) return;
    fprintf(out, "%-10s %lld of these\n", "ended", n_took);
    print_needs(out, "expected", json_object_get(plan, "expected_of_ended"));
    print_needs(out, "took", took);
    print_ratio(out, ratio);
}

CLI_COMMAND(
    PLAN, cli_plan, .place = 210, .name = "plan", .operand = "BATCH", .needs = "the name or the id of a batch",
    .options = "cores json", .summary = "tell what a batch will take, before it runs, and how far off that was",
    .text =
        "Samples that have not run are planned anew: processor time, time on --cores cores, memory and disk. Of those\n"
        "that ran since they were planned, what they took stands beside it.\n")

status cli_plan(struct cli *cli, int *exit_code, struct error *err)
{
    char path[200], tail[60] = "/plan";
    json_t *plan = NULL, *before = NULL;
    size_t n_failed = 0;
    if (cli->args->cores != NULL) {
        char *end;
        const unsigned long n = strtoul(cli->args->cores, &end, 10);
        if (*end != '\0' || cli->args->cores[0] < '0' || cli->args->cores[0] > '9' || n == 0)
            return error_set(err, STATUS_INVALID, "--cores: '%s' is no number of cores", cli->args->cores);
        snprintf(tail, sizeof tail, "/plan?cores=%lu", n);
    }
    status s = cli_batch_path(cli, cli->args->operand, tail, path, sizeof path, err);
    if (s == STATUS_OK) s = http_json(cli->http, "GET", path, NULL, NULL, &before, err);
    if (s == STATUS_OK) s = plan_samples(cli, json_object_get(before, "samples"), &n_failed, err);
    if (s == STATUS_OK) s = http_json(cli->http, "GET", path, NULL, NULL, &plan, err);
    if (s == STATUS_OK && cli->args->json)
        cli_print_json(plan, cli->out);
    else if (s == STATUS_OK)
        print_plan(cli, plan);
    if (n_failed > 0) *exit_code = CLI_EXIT_ERROR;
    json_decref(plan);
    json_decref(before);
    return s;
}
