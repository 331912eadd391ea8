/* An export of downloaded results without a server: a job folder of the results is made, run by `selvedge-worker`, and
 * the exported folders are moved out of it. */
#include "base/files/derived_document.h"
#include "base/files/durable.h"
#include "base/files/file_tree.h"
#include "clients/cli/arguments/cli_tool.h"
#include "clients/cli/commands/cli_derive.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

enum { PATH_ROOM = 4096, PIECE_BYTES = 1 << 16, EXIT_NO_PROGRAM = 127 };

/* Copies folder/name to job/input/as. */
static status copy_input(const char *folder, const char *name, const char *job, const char *as, struct error *err)
{
    char from[PATH_ROOM], to[PATH_ROOM], piece[PIECE_BYTES];
    snprintf(from, sizeof from, "%s/%s", folder, name);
    snprintf(to, sizeof to, "%s/input/%s", job, as);
    FILE *in = fopen(from, "rbe");
    if (in == NULL) return error_set_errno(err, "cannot read '%s', which the export needs", from);
    FILE *out = fopen(to, "wbe");
    size_t n = 0;
    bool ok = out != NULL;
    while (ok && (n = fread(piece, 1, sizeof piece, in)) > 0) ok = fwrite(piece, 1, n, out) == n;
    ok = ok && ferror(in) == 0;
    status s = ok ? STATUS_OK : error_set_errno(err, "cannot copy '%s'", from);
    fclose(in);
    if (out != NULL && fclose(out) != 0 && s == STATUS_OK) s = error_set_errno(err, "cannot write '%s'", to);
    return s;
}

static status fill_job(const char *folder, const json_t *wanted, const char *job, struct error *err)
{
    char path[PATH_ROOM];
    json_error_t where;
    struct derived_files files;
    json_t *made = NULL;
    snprintf(path, sizeof path, "%s/report.json", folder);
    json_t *report = json_load_file(path, 0, &where);
    if (report == NULL)
        return error_set(err, STATUS_NOT_FOUND, "'%s' is no folder of results: cannot read report.json (%s)", folder,
                         where.text);
    status s = derived_document_make(json_object_get(report, "document"), json_object_get(report, "result"), wanted,
                                     &made, &files, err);
    if (s == STATUS_OK && files.result != NULL)
        s = error_set(err, STATUS_INVALID,
                      "the results in '%s' show those of an earlier job and have no rows: export the earlier ones",
                      folder);
    snprintf(path, sizeof path, "%s/input", job);
    if (s == STATUS_OK && mkdir(path, 0700) != 0) s = error_set_errno(err, "cannot make the folder '%s'", path);
    snprintf(path, sizeof path, "%s/job.json", job);
    if (s == STATUS_OK && json_dump_file(made, path, JSON_INDENT(1) | JSON_REAL_PRECISION(17)) != 0)
        s = error_set(err, STATUS_IO, "cannot write '%s'", path);
    if (s == STATUS_OK) s = copy_input(folder, DERIVED_FIBERS, job, DERIVED_FIBERS, err);
    if (s == STATUS_OK) s = copy_input(folder, "result.json", job, DERIVED_RESULT, err);
    if (s == STATUS_OK && files.environment != NULL)
        s = copy_input(folder, files.environment, job, files.environment, err);
    if (s == STATUS_OK && files.report) s = copy_input(folder, DERIVED_REPORT, job, DERIVED_REPORT, err);
    json_decref(made);
    json_decref(report);
    return s;
}

/* Why the worker has failed, as it says itself. */
static status worker_failure(const char *job, struct error *err)
{
    char path[PATH_ROOM];
    snprintf(path, sizeof path, "%s/status.json", job);
    json_t *j = json_load_file(path, 0, NULL);
    const char *text = json_string_value(json_object_get(json_object_get(j, "error"), "text"));
    status s = error_set(err, STATUS_INVALID, "the export failed: %s", text != NULL ? text : "the worker says not why");
    json_decref(j);
    return s;
}

static status run_worker(const char *job, struct error *err)
{
    char worker[CLI_SIBLING_BYTES];
    int how = 0;
    cli_sibling("selvedge-worker", worker);
    const pid_t pid = fork();
    if (pid == 0) {
        execlp(worker, worker, job, (char *)NULL);
        _exit(EXIT_NO_PROGRAM);
    }
    if (pid < 0) return error_set_errno(err, "cannot start '%s'", worker);
    while (waitpid(pid, &how, 0) < 0 && errno == EINTR) continue;
    if (WIFEXITED(how) && WEXITSTATUS(how) == EXIT_NO_PROGRAM)
        return error_set(err, STATUS_NOT_FOUND, "cannot run '%s', which exports: install it beside selvedge", worker);
    return WIFEXITED(how) && WEXITSTATUS(how) == 0 ? STATUS_OK : worker_failure(job, err);
}

/* Moves job/results/export/<format> to to/export/<format>, in place of an earlier one. */
static status move_exports(struct cli *cli, const json_t *formats, const char *job, const char *to, struct error *err)
{
    char from[PATH_ROOM], target[PATH_ROOM], parent[PATH_ROOM];
    const char *format;
    json_t *value;
    snprintf(parent, sizeof parent, "%.4000s/export", to);
    status s = durable_make_folder(parent, err);
    json_object_foreach((json_t *)formats, format, value)
    {
        if (s != STATUS_OK) break;
        if (!json_is_true(value)) continue; /* a number of a format */
        const bool pdf = strcmp(format, "pdf") == 0;
        snprintf(from, sizeof from, "%.4000s/results/%s%.40s", job, pdf ? "report." : "export/", format);
        snprintf(target, sizeof target, "%.4000s/%s%.40s", pdf ? to : parent, pdf ? "report." : "", format);
        if (access(from, F_OK) != 0)
            return error_set(err, STATUS_UNSUPPORTED, "'%s' was not made: the log above says why", format);
        if (access(target, F_OK) == 0) file_tree_remove(target, NULL);
        if (rename(from, target) != 0)
            s = error_set_errno(err, "cannot move the export to '%s'", target);
        else
            fprintf(cli->out, "%s\n", target);
    }
    return s;
}

status cli_export_folder(struct cli *cli, const char *folder, const json_t *wanted, const char *to, struct error *err)
{
    char job[PATH_ROOM];
    status s = durable_make_folder(to, err);
    snprintf(job, sizeof job, "%.4000s/.selvedge-XXXXXX", to); /* beside its target, so that it can be moved there */
    if (s != STATUS_OK) return s;
    if (mkdtemp(job) == NULL) return error_set_errno(err, "cannot make a folder in '%s'", to);
    s = fill_job(folder, wanted, job, err);
    if (s == STATUS_OK) s = run_worker(job, err);
    if (s == STATUS_OK) s = move_exports(cli, json_object_get(wanted, "export"), job, to, err);
    file_tree_remove(job, NULL);
    return s;
}
