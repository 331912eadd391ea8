/* Helpers of the commands of batches. */
#ifndef SELVEDGE_CLIENTS_CLI_BATCH_H
#define SELVEDGE_CLIENTS_CLI_BATCH_H

#include "clients/cli/cli.h"

/* selvedge batch submit TEMPLATE.json TABLE.csv|FOLDER */
status cli_batch_submit(struct cli *cli, struct error *err);
/* Prints name, numbers by state, progress and failures of a batch as the server gives it. */
void cli_batch_print(const struct cli *cli, const json_t *batch);
/* Writes "3 succeeded, 1 failed" of the members above 0. */
void cli_batch_numbers(const json_t *object, char *out, size_t n_out);

#endif
