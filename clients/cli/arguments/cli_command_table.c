#include "clients/cli/arguments/cli_command_table.h"

#include "base/catalogue/volume_format.h"

#include <limits.h>
#include <stdio.h>
#include <string.h>

const struct cli_command cli_command_table[CLI_N_COMMAND] = {
#define CLI_COMMAND(id, run, ...) [CLI_##id] = {__VA_ARGS__},
#include "generated/cli_commands.def"
#undef CLI_COMMAND
};

static int list_place(enum cli_command_id id)
{
    const int place = cli_command_table[id].place;
    return place != 0 ? place : INT_MAX;
}

void cli_command_order(enum cli_command_id order[CLI_N_COMMAND])
{
    for (int i = 0; i < CLI_N_COMMAND; i++) {
        int k = i;
        for (; k > 0 && list_place(order[k - 1]) > list_place((enum cli_command_id)i); k--) order[k] = order[k - 1];
        order[k] = (enum cli_command_id)i;
    }
}

void cli_command_text(const struct cli_command *command, char *out, size_t n_bytes)
{
    const char *text = command->text == NULL ? "" : command->text, *at = strstr(text, CLI_SCAN_FORMATS);
    const int before = at == NULL ? (int)strlen(text) : (int)(at - text);
    snprintf(out, n_bytes, "%.*s%s%s", before, text, at == NULL ? "" : volume_format_list,
             at == NULL ? "" : at + strlen(CLI_SCAN_FORMATS));
}

bool cli_operand_is_id(enum cli_command_id id)
{
    return cli_command_table[id].operand != NULL && cli_command_table[id].needs == NULL;
}
