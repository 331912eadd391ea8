/* The files of a job's scan, and the checkpoint of its densities. */
#ifndef SELVEDGE_OPTIMIZER_PIPELINE_VOLUME_H
#define SELVEDGE_OPTIMIZER_PIPELINE_VOLUME_H

#include "optimizer/worker/pipeline_context.h"

/* Fills in the options of the document that the reconstruction of a scan has, and defaults for the others. */
void pipeline_volume_options(const struct job_document *doc, struct reconstruct_option *o);
/* The paths of the scan's files. One allocation holds the list and the paths; the caller frees it. NULL: out of
 * memory. */
const char **pipeline_scan_paths(const struct pipeline_context *c);
/* Reads the checkpoint of the stage "volume" into c->volume, with what that stage has chosen and measured. Errors as of
 * work_file_read. */
status pipeline_load_volume(struct pipeline_context *c, struct reconstruct_option *option,
                            struct reconstruct_report *report, struct error *err);

#endif
