/* Parses the command line of `selvedge`, and writes its help, by the table of commands and the table of options. The
 * functions print nothing, and read only the environment that they are given. */
#ifndef SELVEDGE_CLIENTS_CLI_PARSE_H
#define SELVEDGE_CLIENTS_CLI_PARSE_H

#include "base/status.h"
#include "clients/cli/arguments/cli_args.h"

#include <stddef.h>

/* The values of SELVEDGE_SERVER, SELVEDGE_TOKEN and SELVEDGE_TOKEN_FILE, NULL if unset. */
struct cli_environment {
    const char *server, *token, *token_file;
};

/* Options override the environment. A token is never an option: other users see the list of processes. STATUS_INVALID
 * for an unknown command or option (the text names the nearest known one) and for a missing or extra operand. */
status cli_args_parse(int argc, char *const *argv, const struct cli_environment *env, struct cli_args *args,
                      struct error *err);

/* Writes the help text of one command, or of the program if has_command is false: at most n_bytes, NUL-terminated. */
void cli_help(const struct cli_args *args, char *text, size_t n_bytes);

#endif
