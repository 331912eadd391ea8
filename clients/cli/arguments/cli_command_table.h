/* The commands of the command line, a row each. */
#ifndef SELVEDGE_CLIENTS_CLI_COMMAND_TABLE_H
#define SELVEDGE_CLIENTS_CLI_COMMAND_TABLE_H

#include "clients/cli/arguments/cli_args.h"

struct cli_command {
    const char *name, *operand, *what, *more;
    int option;
    const char *needs;  /* what the operand is, for the message when it is missing; NULL: a job id */
    const char *second; /* a second operand that may follow; NULL: none */
    const char *third;  /* the same after the second one */
};
extern const struct cli_command cli_command_table[CLI_N_COMMAND];

#endif
