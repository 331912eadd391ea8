/* The data folder of daemons that share a database: whether its file system can do what several machines need, and
 * whether folder and database belong together. */
#ifndef SELVEDGE_SERVER_SHARED_FOLDER_H
#define SELVEDGE_SERVER_SHARED_FOLDER_H

#include "server/jobs/job_service.h"

/* Tries, in files that it removes again, what the service relies on: locks that exclude other descriptors (flock),
 * creation of a name by one only (O_EXCL), a rename that replaces, and syncs of files and folders. clock_lag_s (may
 * be NULL): how far the clock of the file system is behind that of this machine. STATUS_UNSUPPORTED names what does
 * not work. */
status shared_folder_check(const char *folder, double *clock_lag_s, struct error *err);

/* With a shared database: checks the folder, and that it is the one of this database, as the file store.id says; a
 * folder without jobs becomes so. With an embedded database: that the folder is not of a shared one. STATUS_CONFLICT.
 * */
status shared_folder_admit(struct job_service *v, struct error *err);

#endif
