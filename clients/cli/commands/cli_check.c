/* selvedge check JOB.json: all faults of a job document and of its files before anything is uploaded. The check itself
 * is a mode of `selvedge-worker`, which reads every file format; the client runs it and prints its report. */
#include "clients/cli/arguments/cli_tool.h"
#include "clients/cli/commands/cli.h"
#include "clients/cli/commands/cli_document.h"
#include "clients/cli/text/cli_report.h"
#include "clients/cli/text/cli_text.h"

#include <errno.h>
#include <jansson.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

enum { PATH_ROOM = 4096, EXIT_NO_PROGRAM = 127 };

/* Runs the worker's check and reads its report. */
static status run_worker(const char *document, const char *folder, json_t **report, struct error *err)
{
    char worker[CLI_SIBLING_BYTES];
    int end[2], how = 0;
    cli_sibling("selvedge-worker", worker);
    if (pipe(end) != 0) return error_set_errno(err, "cannot start '%s'", worker);
    pid_t pid = fork();
    if (pid == 0) {
        dup2(end[1], STDOUT_FILENO);
        close(end[0]);
        close(end[1]);
        execlp(worker, worker, "--check", document, folder, (char *)NULL);
        _exit(EXIT_NO_PROGRAM);
    }
    close(end[1]);
    FILE *from = pid > 0 ? fdopen(end[0], "r") : NULL;
    *report = from != NULL ? json_loadf(from, 0, NULL) : NULL;
    if (from != NULL)
        fclose(from);
    else
        close(end[0]);
    if (pid < 0) return error_set_errno(err, "cannot start '%s'", worker);
    while (waitpid(pid, &how, 0) < 0 && errno == EINTR) continue;
    if (WIFEXITED(how) && WEXITSTATUS(how) == EXIT_NO_PROGRAM)
        return error_set(err, STATUS_NOT_FOUND, "cannot run '%s', which checks the files: install it beside selvedge",
                         worker);
    if (!json_is_object(*report)) return error_set(err, STATUS_INTERNAL, "'%s' could not check '%s'", worker, document);
    return STATUS_OK;
}

status cli_check_document(const char *document, const char *folder, FILE *out, size_t *n_fault, struct error *err)
{
    json_t *report = NULL;
    status s = run_worker(document, folder, &report, err);
    *n_fault = json_array_size(json_object_get(report, "faults"));
    if (s == STATUS_OK) {
        cli_print_faults(json_object_get(report, "faults"), "fault", out);
        size_t n_warning = cli_print_faults(json_object_get(report, "warnings"), "warning", out);
        const long long n_file = json_integer_value(json_object_get(report, "n_file"));
        cli_print_statements(json_object_get(report, "files"), out);
        fprintf(out, "%lld file%s, %zu fault%s, %zu warning%s%s\n", n_file, n_file == 1 ? "" : "s", *n_fault,
                *n_fault == 1 ? "" : "s", n_warning, n_warning == 1 ? "" : "s",
                *n_fault == 0 ? ": the job can be submitted" : "");
    }
    json_decref(report);
    return s;
}

static status print_json(const char *document, const char *folder, FILE *out, size_t *n_fault, struct error *err)
{
    json_t *report = NULL;
    status s = run_worker(document, folder, &report, err);
    *n_fault = json_array_size(json_object_get(report, "faults"));
    if (s == STATUS_OK) {
        json_dumpf(report, out, JSON_INDENT(1));
        fputc('\n', out);
    }
    json_decref(report);
    return s;
}

CLI_COMMAND(
    CHECK, cli_check, .place = 20, .name = "check", .operand = "JOB.json", .needs = "a job document",
    .options = "input-dir json", .summary = "check a job document and its files, without a server",
    .text =
        "Every file is opened and judged, and all faults are printed at once; nothing is uploaded. Files are taken\n"
        "from the document's folder (or --input-dir). Exit status 1 when there are faults.\n")

status cli_check(struct cli *cli, int *exit_code, struct error *err)
{
    char folder[PATH_ROOM];
    size_t n_fault = 0;
    const struct cli_args *a = cli->args;
    if (a->input_dir != NULL)
        snprintf(folder, sizeof folder, "%s", a->input_dir);
    else
        cli_folder_of(a->operand, folder, sizeof folder);
    status s = cli_document_check(a->operand, err);
    if (s == STATUS_OK && a->json)
        s = print_json(a->operand, folder, cli->out, &n_fault, err);
    else if (s == STATUS_OK)
        s = cli_check_document(a->operand, folder, cli->out, &n_fault, err);
    if (n_fault > 0) *exit_code = CLI_EXIT_ERROR;
    return s;
}
