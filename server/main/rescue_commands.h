/* The commands of an operator on a data folder: back up, rebuild, quarantine, doctor. */
#ifndef SELVEDGE_SERVER_RESCUE_COMMANDS_H
#define SELVEDGE_SERVER_RESCUE_COMMANDS_H

#include "server/settings/settings.h"

#include <stdbool.h>
#include <stdio.h>

enum rescue_command { RESCUE_NONE, RESCUE_BACKUP, RESCUE_REBUILD, RESCUE_QUARANTINE, RESCUE_DOCTOR };

struct rescue_request {
    enum rescue_command command;
    const char *word;    /* value of the option: a file, or "list" or "restore" */
    const char *operand; /* NULL: none */
    const char *worker;  /* path of the worker program, for the doctor */
    bool resume;
};

/* Checks that the parts of a request fit together. STATUS_INVALID. */
status rescue_check(const struct rescue_request *request, struct error *err);
/* Whether no daemon must be using the data folder. */
bool rescue_needs_lock(const struct rescue_request *request);
/* Runs the command and prints its report to `out`. */
status rescue_run(const struct settings *settings, const struct rescue_request *request, FILE *out, struct error *err);

#endif
