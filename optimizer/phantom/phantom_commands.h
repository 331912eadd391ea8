/* The commands of selvedge-phantom. argv[0] is the command's name; they speak to stdout and stderr and return an exit code
 * (0 done, 1 failed, 2 wrong use). Part of that program, not of the service. */
#ifndef SELVEDGE_OPTIMIZER_PHANTOM_COMMANDS_H
#define SELVEDGE_OPTIMIZER_PHANTOM_COMMANDS_H

#include "base/status.h"

#include <stdbool.h>
#include <stdint.h>

int phantom_command_cloth(int argc, char **argv);
int phantom_command_photograph(int argc, char **argv);
int phantom_command_compare(int argc, char **argv);

/* --name VALUE pairs, one table a command. */
enum option_kind {
    OPTION_TEXT,
    OPTION_NUMBER,
    OPTION_NUMBER_LIST,
    OPTION_COUNT,
    OPTION_U64,
    OPTION_FLAG,
    OPTION_FALSE,
    OPTION_CALL
};

struct command_option {
    const char *name;
    enum option_kind kind;
    void *
        to; /* const char **, double *, double [n] (fewer values repeat the last), size_t * or [n], uint64_t *, bool * */
    size_t n;                                                       /* of a list; 0 and 1 mean one value */
    status (*call)(void *to, const char *value, struct error *err); /* OPTION_CALL */
};

/* Fill in what argv says. STATUS_INVALID with a text for the user. */
status command_options_parse(int argc, char **argv, const struct command_option *option, size_t n_option,
                             struct error *err);

#endif
