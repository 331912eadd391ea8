/* The quarantine: folders that a start found in jobs/ although the database has no such job. It moves them to
 * DATA/quarantine, where their names are the id of the job and the time. */
#ifndef SELVEDGE_SERVER_QUARANTINE_H
#define SELVEDGE_SERVER_QUARANTINE_H

#include "server/settings/settings.h"

#include <stdio.h>

/* Prints a line for each folder: its name, and the job by its journal. STATUS_IO. */
status quarantine_list(const struct settings *settings, FILE *report, struct error *err);
/* Moves a folder, named by its whole name or by the id of its job, back to jobs/ and adds its job to the database.
 * After an error the folder is in quarantine. The caller holds the lock of the data folder. STATUS_NOT_FOUND,
 * STATUS_CONFLICT (two folders have the id, or a job exists with it), and the errors of rebuild_one. */
status quarantine_restore(const struct settings *settings, const char *name, FILE *report, struct error *err);

#endif
