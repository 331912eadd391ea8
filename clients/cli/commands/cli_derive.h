/* Jobs that show the result of a finished job without a new fit (POST /v1/jobs/{id}/derive). */
#ifndef SELVEDGE_CLIENTS_CLI_DERIVE_H
#define SELVEDGE_CLIENTS_CLI_DERIVE_H

#include "clients/cli/commands/cli.h"

/* Has the server make and start a job that shows job `id`, and follows it until it ends. wanted: the body of the
 * request. mesh: path of a mesh that its picture names, or NULL. made: receives the id of the new job. */
status cli_derive(struct cli *cli, const char *id, const json_t *wanted, const char *mesh, char made[CLI_ID_BYTES],
                  int *exit_code, struct error *err);
/* Downloads those results of job `id` whose paths begin with `prefix` to --out, or to selvedge-ID, and prints the
 * folder. STATUS_NOT_FOUND: there are none. */
status cli_fetch_results(struct cli *cli, const char *id, const char *prefix, struct error *err);
/* Exports the cloth of a folder of downloaded results by `selvedge-worker`, without a server, to the folder `to`, and
 * prints the new folders. wanted: {"export": {...}}. */
status cli_export_folder(struct cli *cli, const char *folder, const json_t *wanted, const char *to, struct error *err);

#endif
