/* selvedged --doctor (`selvedge doctor`): whether this machine can run the service with these settings, and whether the
 * folder of a job is whole. It changes nothing; a daemon and workers may run meanwhile. */
#ifndef SELVEDGE_SERVER_DOCTOR_H
#define SELVEDGE_SERVER_DOCTOR_H

#include "server/settings/settings.h"

#include <stdio.h>

/* Examines the machine and the data folder, or with job (not NULL) that job only: the id of a job in the data folder,
 * or the path of a folder, also one that no daemon made. worker: path of the worker program. Prints a line for each
 * finding and a last one with their numbers. STATUS_INVALID: there were faults. STATUS_NOT_FOUND: there is no such
 * job. */
status doctor_run(const struct settings *settings, const char *worker, const char *job, FILE *out, struct error *err);

#endif
