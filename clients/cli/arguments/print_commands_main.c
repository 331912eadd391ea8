/* Prints the commands and options of `selvedge` as JSON, of which config/generate_manual.py makes the manual page and
 * the completion of shells: {"commands": [{"name", "operand", "summary", "text", "options"}], "tools": [...],
 * "options": [{"name", "letter", "value", "help", "everywhere"}]}. */
#include "clients/cli/arguments/cli_option_table.h"
#include "clients/cli/arguments/cli_tool.h"

#include <jansson.h>
#include <string.h>

static json_t *text_or_null(const char *text) { return text == NULL ? json_null() : json_string(text); }

static json_t *options_of(const struct cli_command *command)
{
    json_t *list = json_array();
    for (size_t i = 0; i < CLI_N_OPTION; i++)
        if (cli_takes_option(command, &cli_option_table[i]))
            json_array_append_new(list, json_string(cli_option_table[i].name));
    return list;
}

static json_t *commands(void)
{
    json_t *list = json_array();
    for (size_t i = 0; i < CLI_N_COMMAND; i++) {
        const struct cli_command *c = &cli_command_table[i];
        char text[2048];
        cli_command_text(c, text, sizeof text);
        json_array_append_new(list,
                              json_pack("{s:s,s:o,s:s,s:s,s:o}", "name", c->name, "operand", text_or_null(c->operand),
                                        "summary", c->summary, "text", text, "options", options_of(c)));
    }
    return list;
}

static json_t *tools(void)
{
    json_t *list = json_array();
    for (size_t i = 0; i < CLI_N_TOOL; i++) {
        const struct cli_tool *t = &cli_tool_table[i];
        json_array_append_new(list, json_pack("{s:s,s:o,s:s}", "name", t->name, "operand", text_or_null(t->operand),
                                              "summary", t->summary));
    }
    return list;
}

static json_t *options(void)
{
    json_t *list = json_array();
    for (size_t i = 0; i < CLI_N_OPTION; i++) {
        const struct cli_option *o = &cli_option_table[i];
        const char letter[2] = {o->letter, '\0'};
        const bool everywhere = o->group != NULL && strcmp(o->group, CLI_EVERYWHERE) == 0;
        json_array_append_new(list, json_pack("{s:s,s:s,s:o,s:s,s:b}", "name", o->name, "letter", letter, "value",
                                              text_or_null(o->value), "help", o->help, "everywhere", everywhere));
    }
    return list;
}

int main(void)
{
    json_t *all = json_pack("{s:o,s:o,s:o}", "commands", commands(), "tools", tools(), "options", options());
    const int failed = all == NULL || json_dumpf(all, stdout, JSON_INDENT(1)) != 0;
    json_decref(all);
    return failed;
}
