/* The data folder of daemons that share a database: whether its file system is fit for several machines, and whether
 * folder and database belong together. */
#ifndef SELVEDGE_SERVER_SHARED_FOLDER_H
#define SELVEDGE_SERVER_SHARED_FOLDER_H

#include "server/jobs/job_service.h"

/* Tries the operations on which the service relies, in files that it removes again: locks that exclude other
 * descriptors (flock), creation of a name by one only (O_EXCL), a rename that replaces, and syncs of files and folders.
 * clock_lag_s (may be NULL): seconds by which the clock of the file system is behind the clock of this machine.
 * STATUS_UNSUPPORTED names the operation that does not work. */
status shared_folder_check(const char *folder, double *clock_lag_s, struct error *err);

/* With a shared database: checks the folder, and that its file store.id names this database; a folder without jobs gets
 * this file. With an embedded database: checks that the folder belongs to no shared one. STATUS_CONFLICT. */
status shared_folder_admit(struct job_service *v, struct error *err);

#endif
