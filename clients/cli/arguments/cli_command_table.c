#include "clients/cli/arguments/cli_command_table.h"

#include <stddef.h>

const struct cli_command cli_command_table[CLI_N_COMMAND] = {
#define CLI_COMMAND(id, run, ...) [CLI_##id] = {__VA_ARGS__},
#include "clients/cli/arguments/cli_commands.def"
#undef CLI_COMMAND
};

bool cli_operand_is_id(enum cli_command_id id)
{
    return cli_command_table[id].operand != NULL && cli_command_table[id].needs == NULL;
}
