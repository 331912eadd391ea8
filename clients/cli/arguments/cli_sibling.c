#include "clients/cli/arguments/cli_sibling.h"
#include "base/program_folder.h"

#include <stdio.h>
#include <unistd.h>

void cli_sibling(const char *name, char path[CLI_SIBLING_BYTES])
{
    char own[CLI_SIBLING_BYTES - 256];
    if (program_folder(own, sizeof own)) {
        snprintf(path, CLI_SIBLING_BYTES, "%s/%.200s", own, name);
        if (access(path, X_OK) == 0) return;
    }
    snprintf(path, CLI_SIBLING_BYTES, "%s", name);
}
