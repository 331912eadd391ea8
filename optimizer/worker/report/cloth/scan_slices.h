/* results/scan/: the slices of the scan across each axis, and how clearly the scan shows every point of the fibers. The
 * viewer of the dashboard reads them (docs/file-formats.md). */
#ifndef SELVEDGE_OPTIMIZER_SCAN_SLICES_H
#define SELVEDGE_OPTIMIZER_SCAN_SLICES_H

#include "optimizer/worker/pipeline_context.h"

/* Files that are there already stay as they are. c: volume, directions and fibers of a scan are loaded. STATUS_IO,
 * STATUS_DISK_FULL, STATUS_NO_MEMORY, STATUS_CANCELLED. */
status scan_slices_write(struct pipeline_context *c, struct error *err);

#endif
