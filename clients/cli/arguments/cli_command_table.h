/* The commands of the command line: a row CLI_COMMAND(ID, function, members of struct cli_command) each, which stands
 * beside its function in a file of clients/cli. The Makefile gathers the rows. The parser, the help, the manual page,
 * the completion of shells and the call of the command come from them. */
#ifndef SELVEDGE_CLIENTS_CLI_COMMAND_TABLE_H
#define SELVEDGE_CLIENTS_CLI_COMMAND_TABLE_H

#include <stdbool.h>
#include <stddef.h>

enum cli_command_id {
#define CLI_COMMAND(id, run, ...) CLI_##id,
#include "generated/cli_commands.def"
#undef CLI_COMMAND
    CLI_N_COMMAND
};

/* Stands in the text of a command for the list of formats of scans (base/catalogue/volume_format.h). */
#define CLI_SCAN_FORMATS "{scan formats}"

struct cli_command {
    int place; /* in lists of commands, which rise in it; 0: at the end */
    const char *name;
    const char *operand; /* name of the operand in the help; NULL: none */
    const char *needs;   /* describes the operand in the message when it is missing; NULL: it is a job id */
    const char *second;  /* a second operand that may follow; NULL: none */
    const char *third;   /* a third one */
    const char
        *options; /* names of options and of groups of options (cli_option_table.h), between blanks; may be NULL */
    const char *summary; /* a line of the program's help */
    const char *text;    /* further lines of the command's help; may be NULL */
};
extern const struct cli_command cli_command_table[CLI_N_COMMAND];

/* All commands in the order of lists. */
void cli_command_order(enum cli_command_id order[CLI_N_COMMAND]);

/* Writes the text of the command's help, at most n_bytes; "" when it has none. */
void cli_command_text(const struct cli_command *command, char *out, size_t n_bytes);
/* Whether the operand of the command is the id of a job. */
bool cli_operand_is_id(enum cli_command_id id);

#endif
