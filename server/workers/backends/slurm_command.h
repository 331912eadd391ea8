/* Runs a command of Slurm and collects its output. The command gets a few variables of the environment
 * (jobs.pass_environment, SLURM_CONF) and no descriptor of the daemon's. */
#ifndef SELVEDGE_SERVER_SLURM_COMMAND_H
#define SELVEDGE_SERVER_SLURM_COMMAND_H

#include "base/status.h"
#include "server/settings/settings.h"

#include <stdatomic.h>
#include <stddef.h>

enum { SLURM_ERROR_BYTES = 600 };

struct slurm_output {
    char *text;                    /* its standard output, owned by the caller; never NULL after STATUS_OK */
    int code;                      /* exit code; -1: it was ended, because it took too long, or by a signal */
    char error[SLURM_ERROR_BYTES]; /* its standard error, on one line */
};

/* Writes the path of a command: below slurm.commands, or found in PATH. STATUS_NOT_FOUND. */
status slurm_command_find(const struct settings *settings, const char *name, char *path, size_t n_path,
                          struct error *err);
/* argument: NULL after the last; argument[0] is the path of the command. input: its standard input; NULL: none. Waits
 * for its end, or ends it after a minute, or a few seconds after *stop (which may be NULL) has become true. STATUS_IO,
 * STATUS_NO_MEMORY. */
status slurm_command_run(const struct settings *settings, const char *const *argument, const char *input,
                         const atomic_bool *stop, struct slurm_output *out, struct error *err);

#endif
