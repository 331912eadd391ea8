/* The input files of a batch. */
#ifndef SELVEDGE_SERVER_BATCH_INPUTS_H
#define SELVEDGE_SERVER_BATCH_INPUTS_H

#include "server/batches/batch_service.h"

/* Declares the files of all samples of a batch that was submitted. What was declared before stays as it is. Files that
 * the server knows are linked and written in slices, between which other requests are served, with one sync for all;
 * the rest as job_declare_files does. May be repeated after an error. */
status batch_declare_files(struct job_service *v, const struct access_grant *grant, const struct batch_table *table,
                           const struct batch_outcome *outcome, struct job_refusal *refusal, struct error *err);

#endif
