/* Folders of the jobs that a batch is about to make. They are made aside, in new/<batch>/ of the data folder, while the
 * service goes on, and are moved to jobs/ when the rows of the jobs are written. */
#ifndef SELVEDGE_SERVER_BATCH_PLACES_H
#define SELVEDGE_SERVER_BATCH_PLACES_H

#include "server/jobs/job_service.h"

/* Makes the folders and syncs them, some at a time, so that no sync of another request waits for all of them. */
status batch_places_make(struct job_service *v, const char *batch, const struct job_row *row, size_t n,
                         struct error *err);
/* Moves them to jobs/, without syncs. Those that were not made, or cannot be moved, are missing there. */
void batch_places_move(struct job_service *v, const char *batch, const struct job_row *row, size_t n);
/* Removes those that were not moved. */
void batch_places_discard(struct job_service *v, const char *batch);
/* Removes those that a daemon which was killed has left. */
void batch_places_clear(struct job_service *v);

#endif
