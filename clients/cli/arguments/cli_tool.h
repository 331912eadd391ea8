/* Commands of `selvedge` that need no daemon: another program of the product runs them, because the
 * client itself knows HTTP only. */
#ifndef SELVEDGE_CLIENTS_CLI_TOOL_H
#define SELVEDGE_CLIENTS_CLI_TOOL_H

#include "base/status.h"

#include <stdbool.h>
#include <stddef.h>

struct cli_tool {
    const char *name, *operand, *summary; /* operand: NULL: none */
    const char *program;
    const char *option; /* the option of the program that stands for the command; NULL: the command's name itself */
    const char *text;   /* help beside the summary; NULL: the program prints it */
};
enum { CLI_N_TOOL = 4 };
extern const struct cli_tool cli_tool_table[CLI_N_TOOL];

/* Whether word is such a command ("photo"). */
bool cli_tool_knows(const char *word);
/* Writes the help of a command that has a text; false: its program prints it. */
bool cli_tool_help(const char *word, char *text, size_t n_bytes);
/* Replaces this process by the program that runs the command argv[1]: the one beside this program, or else in PATH.
 * Returns only on failure: STATUS_NOT_FOUND. */
status cli_tool_run(char **argv, struct error *err);

enum { CLI_SIBLING_BYTES = 4096 };

/* Writes the file that execvp should run for the program `name`: the file beside this program, or `name` alone, which
 * execvp then looks for in PATH. */
void cli_sibling(const char *name, char path[CLI_SIBLING_BYTES]);

#endif
