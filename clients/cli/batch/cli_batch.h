/* Helpers of the commands of batches. */
#ifndef SELVEDGE_CLIENTS_CLI_BATCH_H
#define SELVEDGE_CLIENTS_CLI_BATCH_H

#include "clients/cli/commands/cli.h"

/* Writes "/v1/batches/ID" and `tail` to path, for the batch with this name, id or beginning of an id. STATUS_NOT_FOUND,
 * STATUS_INVALID when there are several. */
status cli_batch_path(struct cli *cli, const char *batch, const char *tail, char *path, size_t n_path,
                      struct error *err);
/* selvedge batch submit TEMPLATE.json TABLE.csv|FOLDER */
status cli_batch_submit(struct cli *cli, struct error *err);
/* Prints name, numbers by state, progress and failures of a batch as the server gives it. */
void cli_batch_print(const struct cli *cli, const json_t *batch);
/* Writes "3 succeeded, 1 failed" of the members above 0. */
void cli_batch_numbers(const json_t *object, char *out, size_t n_out);

#endif
