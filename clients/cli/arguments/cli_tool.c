#include "clients/cli/arguments/cli_tool.h"

#include "base/process.h"

#include <stdint.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

const struct cli_tool cli_tool_table[CLI_N_TOOL] = {
    {"doctor", "[JOB]", "examine this machine and the service's data, or a job", "selvedged", "--doctor",
     "Looks at programs and libraries, limits, free space, the database and its folders, and says what is wrong and\n"
     "how to mend it. JOB: an id, or the folder of a job. Exit status 1 when there are\n"
     "faults.\n\noptions:\n"
     "      --config FILE   settings (default: those of the installed service)\n"
     "      --data DIR      folder of the database and of all jobs\n"},
    {"photo", "FILE...", "show what becomes of a photograph", "selvedge-camera", NULL, NULL},
    {"calibrate-camera", NULL, "make the record of a camera's noise from dark and flat frames", "selvedge-camera", NULL,
     NULL},
    {"bowl", "JOB.json", "make the profile of a fiber from photographs of a bowl", "selvedge-camera", NULL, NULL},
};
enum { MOST_ARGUMENTS = 60 };

/* Where an installed service has them (config/selvedge.service). */
static const char installed_settings[] = "/etc/selvedge/selvedge.conf", installed_data[] = "/var/lib/selvedge";

bool cli_tool_knows(const char *word)
{
    for (size_t i = 0; i < CLI_N_TOOL; i++)
        if (strcmp(cli_tool_table[i].name, word) == 0) return true;
    return false;
}

bool cli_tool_help(const char *word, char *text, size_t n_bytes)
{
    const struct cli_tool *t = cli_tool_table;
    while (strcmp(t->name, word) != 0) t++;
    if (t->text == NULL) return false;
    snprintf(text, n_bytes, "usage: selvedge %s %s [options]\n\n%s.\n\n%s", t->name, t->operand, t->summary, t->text);
    return true;
}

static bool names_a_service(char *const *argv)
{
    for (; *argv != NULL; argv++)
        if (strncmp(*argv, "--config", 8) == 0 || strncmp(*argv, "--data", 6) == 0) return true;
    return false;
}

void cli_sibling(const char *name, char path[CLI_SIBLING_BYTES])
{
    char own[CLI_SIBLING_BYTES - 256];
    if (program_folder(own, sizeof own)) {
        snprintf(path, CLI_SIBLING_BYTES, "%s/%.200s", own, name);
        if (access(path, X_OK) == 0) return;
    }
    snprintf(path, CLI_SIBLING_BYTES, "%s", name);
}

status cli_tool_run(char **argv, struct error *err)
{
    char path[CLI_SIBLING_BYTES];
    const char *run[MOST_ARGUMENTS + 6];
    size_t n = 0, i_tool = 0;
    while (strcmp(cli_tool_table[i_tool].name, argv[1]) != 0) i_tool++;
    const char *option = cli_tool_table[i_tool].option;
    cli_sibling(cli_tool_table[i_tool].program, path);
    run[n++] = option == NULL ? argv[0] : path;
    run[n++] = option == NULL ? argv[1] : option;
    if (option != NULL && !names_a_service(argv) && access(installed_settings, R_OK) == 0) {
        const char *const installed[] = {"--config", installed_settings, "--data", installed_data};
        for (size_t i = 0; i < sizeof installed / sizeof *installed; i++) run[n++] = installed[i];
    }
    for (size_t i = 2; argv[i] != NULL; i++) {
        if (n >= MOST_ARGUMENTS + 5) return error_set(err, STATUS_INVALID, "too many arguments");
        run[n++] = argv[i];
    }
    run[n] = NULL;
    execvp(path, (char *const *)(uintptr_t)run);
    return error_set(err, STATUS_NOT_FOUND,
                     "cannot run `selvedge %s`: the program '%s' is neither beside this one nor in PATH", argv[1],
                     cli_tool_table[i_tool].program);
}
