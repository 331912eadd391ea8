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

/* With a shared database: checks the folder, and that it is the one of this database, as the file store.id says; a
 * folder without jobs becomes so. With an embedded database: that the folder is not of a shared one. STATUS_CONFLICT.
 * */
status shared_folder_admit(struct job_service *v, struct error *err);

#endif
