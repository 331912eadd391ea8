/* results/scan/: the slices of the scan across each axis, the fibers as they were traced in it, before the seams of the
 * tile were closed, and how clearly the scan shows every point of them. The viewer of the dashboard reads these files
 * (docs/file-formats.md). */
#ifndef SELVEDGE_OPTIMIZER_SCAN_SLICES_H
#define SELVEDGE_OPTIMIZER_SCAN_SLICES_H

#include "optimizer/report/findings/report.h"

/* Slices that are there already stay as they are. c: volume, directions and traced fibers of a scan are loaded.
 * STATUS_IO, STATUS_DISK_FULL, STATUS_NO_MEMORY, STATUS_CANCELLED. */
status scan_slices_write(struct report *report, struct error *err);

#endif
