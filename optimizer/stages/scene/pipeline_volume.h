/* The files of a job's scan, and the checkpoint of its densities. */
#ifndef SELVEDGE_OPTIMIZER_PIPELINE_VOLUME_H
#define SELVEDGE_OPTIMIZER_PIPELINE_VOLUME_H

#include "optimizer/stages/geometry_stages.h"

#include <jansson.h>

/* Fills in the options of the document that the reconstruction of a scan has, and defaults for the others. */
void volume_options(const struct job_scan *scan, struct reconstruct_option *o);
/* Paths of the scan's files. One allocation holds the list and the paths; the caller frees it. NULL: out of memory. */
const char **scan_paths(const struct worker_folder *folder, const struct job_scan *scan);
/* Voxels of the job's scan as its files state them; none of them is read. Errors as of volume_source_open_declared. */
status scan_size(const struct worker_folder *folder, const struct job_scan *scan, size_t n[3], struct error *err);
/* Examines the job's scan (reconstruct_examine), and appends its statements to files (base/files/file_ledger_json.h),
 * also those that were found before an error. */
status scan_examine(const struct worker_folder *folder, const struct job_scan *scan, json_t *files, struct error *err);
/* Reads the checkpoint of the stage "volume" into out, and releases the volume that was there. Errors as of
 * work_file_read. */
status volume_checkpoint_read(const struct stage_tools *tools, struct volume_output *out, struct error *err);

#endif
