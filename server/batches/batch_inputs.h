/* The input files of a batch. */
#ifndef SELVEDGE_SERVER_BATCH_INPUTS_H
#define SELVEDGE_SERVER_BATCH_INPUTS_H

#include "server/batches/batch_service.h"

/* Declares the files of all samples of a submitted batch. Earlier declarations stay as they are. Files that the server
 * knows are linked and written in slices with one sync for all; other requests are served between two slices. The
 * remaining files are declared as by job_declare_files. May be repeated after an error. */
status batch_declare_files(struct job_service *v, const struct access_grant *grant, const struct batch_table *table,
                           const struct batch_outcome *outcome, struct job_refusal *refusal, struct error *err);

#endif
