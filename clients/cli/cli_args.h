/* The command line of `selvedge`: one table of commands, one of options; parsing and help texts come from the tables.
 * Pure: prints nothing and reads only the environment that it is given. */
#ifndef SELVEDGE_CLIENTS_CLI_ARGS_H
#define SELVEDGE_CLIENTS_CLI_ARGS_H

#include "base/status.h"

#include <stdbool.h>
#include <stddef.h>

#define CLI_DEFAULT_SERVER "http://127.0.0.1:7878"

enum cli_command_id {
    CLI_SUBMIT,
    CLI_STATUS,
    CLI_WATCH,
    CLI_LIST,
    CLI_CANCEL,
    CLI_RETRY,
    CLI_RESULTS,
    CLI_LOG,
    CLI_SERIES,
    CLI_DELETE,
    CLI_N_COMMAND
};

/* Everything the command line says. Strings point into argv or the environment; NULL: not given. */
struct cli_args {
    enum cli_command_id command;
    const char *server, *token;
    const char *operand;   /* job document for submit, job id for the rest */
    const char *input_dir; /* --input-dir: where the files are that the document names */
    const char *out_dir;   /* --out */
    const char *resume_id; /* --resume */
    const char *id_file;   /* --id-file */
    bool watch, json, follow, draft;
    bool help; /* --help was given; has_command says whether for one command */
    bool version;
    bool has_command;
};

/* server_env and token_env: values of SELVEDGE_SERVER and SELVEDGE_TOKEN, NULL when unset; options win.
 * STATUS_INVALID: unknown command or option (with the nearest known one), missing or extra operand. */
status cli_args_parse(int argc, char *const *argv, const char *server_env, const char *token_env, struct cli_args *args,
                      struct error *err);

const char *cli_command_name(enum cli_command_id id);
/* Help text: of one command, or of the program when has_command is false. Writes at most n_bytes, NUL-terminated. */
void cli_help(const struct cli_args *args, char *text, size_t n_bytes);

#endif
