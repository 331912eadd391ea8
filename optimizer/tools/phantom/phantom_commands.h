/* The commands of the program selvedge-phantom, which is not part of the service. argv[0] is the command's name. A
 * command writes to stdout and stderr and returns the exit code: 0 done, 1 failed, 2 wrong arguments. */
#ifndef SELVEDGE_OPTIMIZER_PHANTOM_COMMANDS_H
#define SELVEDGE_OPTIMIZER_PHANTOM_COMMANDS_H

#include "base/status.h"

#include <stdbool.h>
#include <stdint.h>

int phantom_command_cloth(int argc, char **argv);
int phantom_command_photograph(int argc, char **argv);
int phantom_command_camera(int argc, char **argv);
int phantom_command_compare(int argc, char **argv);
int phantom_command_detect(int argc, char **argv);
int phantom_command_look(int argc, char **argv);
int phantom_command_mesh(int argc, char **argv);

/* The values of the option --NAME. Each command has one table of its options. */
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
    /* Target: const char **, double *, double [n], size_t * or [n], uint64_t * or bool *. When a list has fewer than n
     * values, the last one fills the rest. */
    void *to;
    size_t n;                                                       /* length of a list; 0 and 1 mean one value */
    status (*call)(void *to, const char *value, struct error *err); /* for OPTION_CALL */
};

/* Stores the values that argv gives. Returns STATUS_INVALID with a text for the user. */
status command_options_parse(int argc, char **argv, const struct command_option *option, size_t n_option,
                             struct error *err);

#endif
