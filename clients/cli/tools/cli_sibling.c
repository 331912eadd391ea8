#include "clients/cli/tools/cli_sibling.h"

#include <stdio.h>
#include <string.h>
#include <unistd.h>

void cli_sibling(const char *name, char path[CLI_SIBLING_BYTES])
{
    char own[CLI_SIBLING_BYTES - 256];
    ssize_t n = readlink("/proc/self/exe", own, sizeof own - 1);
    own[n > 0 ? n : 0] = '\0';
    char *slash = strrchr(own, '/');
    if (slash != NULL) {
        slash[1] = '\0';
        snprintf(path, CLI_SIBLING_BYTES, "%s%.200s", own, name);
        if (access(path, X_OK) == 0) return;
    }
    snprintf(path, CLI_SIBLING_BYTES, "%s", name);
}
