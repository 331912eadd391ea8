/* The commands of the command line client, and the arguments of each. A command prints results to `out` and progress to
 * `note`, and returns errors to main. *exit_code is 0 at the start; a command that follows a job sets it by the outcome
 * of the job. */
#ifndef SELVEDGE_CLIENTS_CLI_H
#define SELVEDGE_CLIENTS_CLI_H

#include "clients/cli/arguments/cli_args.h"
#include "clients/cli/commands/cli_http.h"

#include <jansson.h>
#include <stdio.h>

enum cli_exit {
    CLI_EXIT_OK = 0,
    CLI_EXIT_ERROR = 1,
    CLI_EXIT_USAGE = 2,
    CLI_EXIT_CANCELLED = 3,
    CLI_EXIT_VERDICT = 4, /* the result is worse than --require */
    CLI_EXIT_INTERRUPTED = 130
};

struct cli {
    const struct cli_args *args;
    struct http *http;
    FILE *out, *note;
    bool note_is_terminal;
};

/* The functions of the commands. */
#define CLI_COMMAND(id, run, ...) status run(struct cli *cli, int *exit_code, struct error *err);
#include "generated/cli_commands.def"
#undef CLI_COMMAND
/* The row of a command, beside its function; the Makefile gathers all rows. It stands for nothing there. */
#define CLI_COMMAND(id, run, ...)

/* Reads the first line of a file that other users cannot read: *token, which the caller frees. STATUS_INVALID,
 * STATUS_NOT_FOUND, STATUS_IO. */
status cli_token_read(const char *path, char **token, struct error *err);

/* Creates a job of a document, uploads its files from `folder` and starts it. id receives the job's id. */
enum { CLI_ID_BYTES = 80 };
status cli_submit_document(struct cli *cli, const json_t *document, const char *folder, char id[CLI_ID_BYTES],
                           struct error *err);
/* The same, but a sample that was sent before gives the job that it gave then, by a key of the document and the content
 * of its files. Only a draft is uploaded and started, and it is started only if unchanged(context) returns true after
 * the upload; otherwise the draft is deleted and STATUS_STALE returned. Links are not followed, neither `folder` nor
 * files in it. */
status cli_submit_once(struct cli *cli, const json_t *document, const char *folder, bool (*unchanged)(void *context),
                       void *context, char id[CLI_ID_BYTES], struct error *err);
/* Downloads files to a folder: the member "files" of a list of results. */
status cli_files_fetch(struct cli *cli, const json_t *files, const char *folder, struct error *err);
/* Downloads the results of job `id` to a folder. */
status cli_results_of(struct cli *cli, const char *id, const char *folder, struct error *err);
/* The same to --out, or to selvedge-ID, and prints the folder. */
status cli_results_to_out(struct cli *cli, const char *id, struct error *err);
/* Follows job `id` until it ends, and prints the fitted parameters. */
/* Adds the names of the files of a scan (one, a header and its data, or a folder of slices) to a list, and writes the
 * folder that they lie in. STATUS_NOT_FOUND, STATUS_IO, STATUS_FORMAT, STATUS_INVALID. */
status cli_scan_files(const char *scan, json_t *files, char *folder, size_t n_bytes, struct error *err);
/* The edges of a voxel in micrometres from "2" or "2,2,3". STATUS_INVALID. */
status cli_scan_voxel(const char *text, json_t **voxel, struct error *err);
/* Prints the faults, warnings and statements of a document's files, as `selvedge check` does. */
status cli_check_document(const char *document, const char *folder, FILE *out, size_t *n_fault, struct error *err);

status cli_watch_job(struct cli *cli, const char *id, int *exit_code, struct error *err);
/* Writes the id of the one job whose id begins with text, which has four characters or more; a text that cannot be the
 * beginning of an id is copied. STATUS_NOT_FOUND, STATUS_INVALID (several jobs). */
status cli_whole_id(struct cli *cli, const char *text, char id[CLI_ID_BYTES], struct error *err);
/* Prints for programs: the server's numbers to the last digit. */
void cli_print_json(const json_t *value, FILE *out);
/* Writes "/v1/jobs/ID" + tail to path. STATUS_INVALID when the id has characters that no id has. */
/* Adds members "result" and "parameters" to a job as the server gives it: its result by "result_url", or null. */
status cli_add_result(struct cli *cli, json_t *job, struct error *err);
/* Whether a path from the server, which becomes a file name here, is neither absolute nor has ".." or control
 * characters. */
bool cli_path_is_safe(const char *path);
status cli_job_path(const char *id, const char *tail, char *path, size_t n_path, struct error *err);
/* Writes the name of a file as a part of an address: %XX for bytes other than letters, digits and . _ - */
enum { CLI_ESCAPED_BYTES = 400 };
void cli_name_escape(const char *name, char out[CLI_ESCAPED_BYTES]);
/* The folder of a path: "." if it has none. */
void cli_folder_of(const char *path, char *folder, size_t n_bytes);
/* Width of the terminal behind `note`; 80 if it is unknown. */
size_t cli_columns(const struct cli *cli);

/* Sends file->path to upload_url by tus, from the server's present offset on, in pieces of piece_bytes; retries
 * after a broken connection. `changed` is called with each offset that is reached. */
struct cli_file;
status cli_upload_file(struct cli *cli, const struct cli_file *file, const char *upload_url, uint64_t piece_bytes,
                       void (*changed)(void *context, uint64_t offset), void *context, struct error *err);
/* Size of one piece: our default, or the server's limit if that is smaller. */
uint64_t cli_piece_bytes(struct cli *cli);

#endif
