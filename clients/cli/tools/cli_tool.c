#include "clients/cli/tools/cli_tool.h"

#include "clients/cli/tools/cli_sibling.h"

#include <string.h>
#include <unistd.h>

static const char program[] = "selvedge-camera";
static const char *const command[] = {"photo", "calibrate-camera"};

bool cli_tool_knows(const char *word)
{
    for (size_t i = 0; i < sizeof command / sizeof *command; i++)
        if (strcmp(command[i], word) == 0) return true;
    return false;
}

const char *cli_tool_help(void)
{
    return "  photo FILE...      show what becomes of a photograph (needs no daemon)\n"
           "  calibrate-camera   make the record of a camera's noise from dark and flat frames (needs no daemon)\n";
}

status cli_tool_run(char **argv, struct error *err)
{
    char path[CLI_SIBLING_BYTES];
    cli_sibling(program, path);
    execvp(path, argv);
    return error_set(err, STATUS_NOT_FOUND,
                     "cannot run `selvedge %s`: the program '%s' is neither beside this one nor in PATH", argv[1],
                     program);
}
