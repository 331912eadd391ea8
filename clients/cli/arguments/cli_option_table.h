/* The options of the command line, a row each. */
#ifndef SELVEDGE_CLIENTS_CLI_OPTION_TABLE_H
#define SELVEDGE_CLIENTS_CLI_OPTION_TABLE_H

#include "clients/cli/arguments/cli_args.h"

#include <stddef.h>

/* The group of the options that every command has. */
#define CLI_EVERYWHERE "everywhere"

struct cli_option {
    const char *group; /* a name by which a command takes all options of the group; NULL: none */
    char letter;       /* 0: none */
    const char *name;
    const char *value; /* name of the value in the help; NULL: the option takes none */
    const char *help;
    size_t at; /* the member of struct cli_args that it sets: a text if it has a value, else a bool */
};
enum {
    CLI_N_PICTURE_OPTION = 0
#define PICTURE_OPTION(...) +1
#include "clients/cli/arguments/picture_options.def"
#undef PICTURE_OPTION
    ,
    CLI_N_OPTION = 54 + CLI_N_PICTURE_OPTION
};
extern const struct cli_option cli_option_table[CLI_N_OPTION];

/* Whether the command takes the option. */
bool cli_takes_option(const struct cli_command *command, const struct cli_option *option);

#endif
