/* Commands about batches: many samples with one template. */
#include "clients/cli/batch/cli_batch.h"
#include "clients/cli/text/cli_text.h"
#include "clients/cli/text/text_table.h"

#include <stdlib.h>
#include <string.h>

static const char *text_of(const json_t *object, const char *key)
{
    const char *text = json_string_value(json_object_get(object, key));
    return text == NULL ? "" : text;
}

/* Visits the batches of the server, newest first, until visit returns false. */
static status visit_batches(struct cli *cli, bool (*visit)(void *context, const json_t *batch), void *context,
                            struct error *err)
{
    char path[120] = "/v1/batches?limit=500";
    for (bool more = true; more;) {
        json_t *page = NULL, *one;
        size_t i;
        status s = http_json(cli->http, "GET", path, NULL, NULL, &page, err);
        if (s != STATUS_OK) return s;
        const char *cursor = json_string_value(json_object_get(page, "next_cursor"));
        more = cursor != NULL;
        if (more) snprintf(path, sizeof path, "/v1/batches?limit=500&cursor=%.40s", cursor);
        json_array_foreach(json_object_get(page, "batches"), i, one) if (!visit(context, one)) more = false;
        json_decref(page);
    }
    return STATUS_OK;
}

struct search {
    const char *text;
    char id[CLI_ID_BYTES];
    bool exact;
    size_t n;
};

static bool match(void *context, const json_t *batch)
{
    struct search *f = context;
    const char *id = text_of(batch, "id"), *name = text_of(batch, "name");
    bool exact = strcmp(name, f->text) == 0 || strcmp(id, f->text) == 0;
    if (!exact && (strlen(f->text) < 4 || strncmp(id, f->text, strlen(f->text)) != 0)) return true;
    if (exact && !f->exact) f->n = 0; /* a name goes before the beginning of an id */
    if (f->exact && !exact) return true;
    f->exact = exact;
    f->n++;
    snprintf(f->id, sizeof f->id, "%s", id);
    return true;
}

status cli_batch_path(struct cli *cli, const char *batch, const char *tail, char *path, size_t n_path,
                      struct error *err)
{
    struct search f = {.text = batch};
    status s = visit_batches(cli, match, &f, err);
    if (s != STATUS_OK) return s;
    if (f.n == 0) return error_set(err, STATUS_NOT_FOUND, "there is no batch '%s'", f.text);
    if (f.n > 1) return error_set(err, STATUS_INVALID, "there are several batches '%s'; give the id", f.text);
    snprintf(path, n_path, "/v1/batches/%.80s%s", f.id, tail);
    return STATUS_OK;
}

/* The path of the batch that follows the action. */
static status batch_path(struct cli *cli, const char *tail, char *path, size_t n_path, struct error *err)
{
    if (cli->args->second == NULL)
        return error_set(err, STATUS_INVALID, "'selvedge batch %s' needs the name or the id of a batch",
                         cli->args->operand);
    return cli_batch_path(cli, cli->args->second, tail, path, n_path, err);
}

/* One request about a batch, whose answer is printed. */
static status ask(struct cli *cli, const char *method, const char *tail, int *exit_code, struct error *err)
{
    char path[200];
    json_t *batch = NULL;
    status s = batch_path(cli, tail, path, sizeof path, err);
    if (s == STATUS_OK) s = http_json(cli->http, method, path, NULL, NULL, &batch, err);
    if (s == STATUS_OK && cli->args->json)
        cli_print_json(batch, cli->out);
    else if (s == STATUS_OK)
        cli_batch_print(cli, batch);
    if (json_array_size(json_object_get(batch, "refused")) > 0) *exit_code = CLI_EXIT_ERROR;
    json_decref(batch);
    return s;
}

static status show(struct cli *cli, int *exit_code, struct error *err) { return ask(cli, "GET", "", exit_code, err); }
static status start(struct cli *cli, int *exit_code, struct error *err)
{
    return ask(cli, "POST", "/start", exit_code, err);
}
static status retry(struct cli *cli, int *exit_code, struct error *err)
{
    return ask(cli, "POST", "/retry", exit_code, err);
}
static status cancel(struct cli *cli, int *exit_code, struct error *err)
{
    return ask(cli, "POST", "/cancel", exit_code, err);
}

static status submit(struct cli *cli, int *exit_code, struct error *err)
{
    (void)exit_code;
    return cli_batch_submit(cli, err);
}

struct listing {
    const struct cli *cli;
    json_t *all;
    size_t n;
    struct text_table table;
};

static bool list_one(void *context, const json_t *batch)
{
    struct listing *l = context;
    char n_sample[24], numbers[300];
    l->n++;
    if (l->cli->args->json) {
        json_array_append(l->all, (json_t *)(uintptr_t)batch);
        return true;
    }
    cli_batch_numbers(json_object_get(batch, "states"), numbers, sizeof numbers);
    snprintf(n_sample, sizeof n_sample, "%lld", (long long)json_integer_value(json_object_get(batch, "n_sample")));
    text_table_add(&l->table, (const char *const[]){text_of(batch, "id"), n_sample, text_of(batch, "name"), numbers});
    return true;
}

static status list(struct cli *cli, int *exit_code, struct error *err)
{
    static const char *const head[] = {"id", ">samples", "name", "jobs", NULL};
    (void)exit_code;
    struct listing l = {.cli = cli, .all = json_array(), .table = {.head = head, .colored = text_colored(cli->out)}};
    status s = visit_batches(cli, list_one, &l, err);
    text_table_print(&l.table, cli->out);
    if (s == STATUS_OK && cli->args->json) cli_print_json(l.all, cli->out);
    if (s == STATUS_OK && l.n == 0 && !cli->args->json)
        fprintf(cli->note, "no batches; `selvedge batch submit TEMPLATE.json TABLE.csv` makes one\n");
    json_decref(l.all);
    return s;
}

static status results_path(struct cli *cli, char *path, size_t n_path, struct error *err)
{
    const char *verdict = cli->args->verdict;
    char tail[300];
    if (verdict != NULL && verdict[strspn(verdict, "abcdefghijklmnopqrstuvwxyz_,")] != '\0')
        return error_set(err, STATUS_INVALID, "--verdict is '%.40s': it must be codes between commas", verdict);
    snprintf(tail, sizeof tail, "%s%s%.240s", cli->args->json ? "/results.json" : "/results.csv",
             verdict != NULL ? "?verdict=" : "", verdict != NULL ? verdict : "");
    return batch_path(cli, tail, path, n_path, err);
}

static status results(struct cli *cli, int *exit_code, struct error *err)
{
    (void)exit_code;
    char path[500];
    json_t *table = NULL;
    status s = results_path(cli, path, sizeof path, err);
    if (s == STATUS_OK && cli->args->out_dir != NULL) /* a file here */
        s = http_download(cli->http, path, cli->args->out_dir, NULL, NULL, err);
    else if (s == STATUS_OK && cli->args->json) {
        s = http_json(cli->http, "GET", path, NULL, NULL, &table, err);
        if (s == STATUS_OK) cli_print_json(table, cli->out);
    } else if (s == STATUS_OK) {
        struct http_reply reply = {0};
        s = http_call(cli->http, "GET", path, NULL, NULL, 0, &reply, err);
        if (s == STATUS_OK && reply.code != 200) s = http_problem(&reply, err);
        if (s == STATUS_OK) fwrite(reply.body, 1, reply.n_body, cli->out);
        http_reply_release(&reply);
    }
    json_decref(table);
    return s;
}

static status delete_batch(struct cli *cli, int *exit_code, struct error *err)
{
    (void)exit_code;
    char path[200];
    if (cli->args->keep_jobs == cli->args->delete_jobs)
        return error_set(err, STATUS_INVALID, "say what becomes of the jobs: --keep-jobs or --delete-jobs");
    status s = batch_path(cli, cli->args->keep_jobs ? "?jobs=keep" : "?jobs=delete", path, sizeof path, err);
    return s == STATUS_OK ? http_json(cli->http, "DELETE", path, NULL, NULL, NULL, err) : s;
}

CLI_COMMAND(
    BATCH, cli_batch, .place = 200, .name = "batch", .operand = "ACTION",
    .needs = "an action: submit, list, show, start, retry, cancel, results or delete", .second = "NAME",
    .third = "TABLE", .options = "batch draft json out verdict",
    .summary = "run many samples with one template, or say how they are",
    .text =
        "selvedge batch submit TEMPLATE.json TABLE.csv    a job of each row; or a folder with a folder of each sample\n"
        "selvedge batch list\n"
        "selvedge batch show|start|retry|cancel NAME      or its id; retry queues all that have failed\n"
        "selvedge batch results NAME                      table of results as CSV (--json; --out FILE; --verdict "
        "CODES)\n"
        "selvedge batch delete NAME --keep-jobs|--delete-jobs\n"
        "docs/automation.md describes the table. Submitting a changed table with --update runs only what differs.\n")

status cli_batch(struct cli *cli, int *exit_code, struct error *err)
{
    static const struct {
        const char *name;
        status (*run)(struct cli *, int *, struct error *);
    } action[] = {{"submit", submit}, {"list", list},     {"show", show},       {"start", start},
                  {"retry", retry},   {"cancel", cancel}, {"results", results}, {"delete", delete_batch}};
    for (size_t i = 0; i < sizeof action / sizeof action[0]; i++)
        if (strcmp(cli->args->operand, action[i].name) == 0) {
            if (cli->args->third != NULL && i > 0)
                return error_set(err, STATUS_INVALID, "'selvedge batch %s' takes no '%s'", action[i].name,
                                 cli->args->third);
            return action[i].run(cli, exit_code, err);
        }
    return error_set(err, STATUS_INVALID,
                     "unknown action '%s': submit, list, show, start, retry, cancel, results or delete",
                     cli->args->operand);
}
