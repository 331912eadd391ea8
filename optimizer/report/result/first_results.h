/* Files under results/ that a job can show before its stage "report": its photographs, slices of the scan, and the
 * fibers as soon as they are traced. The report writes the same files; those that cannot change any more are kept. */
#ifndef SELVEDGE_OPTIMIZER_FIRST_RESULTS_H
#define SELVEDGE_OPTIMIZER_FIRST_RESULTS_H

#include "optimizer/report/findings/report.h"

/* photographs/<name>.png and .exr. `photographs`: rows of the document, read already. */
status first_photographs_write(const struct cloth_job *job, const struct job_rows *photographs, struct error *err);
/* Writes the files that a job with a scan can show after a stage: after "volume" and "fibers"
 * pictures/slice-{x,y,z}.png, the middle slices with the fibers that are traced so far; after "scene" the fibers of the
 * cloth and the files of the viewer of slices, unless an earlier attempt has written them. After other stages nothing.
 */
status first_results_write(const struct cloth_job *job, const char *stage, const struct volume_output *volume,
                           const struct fiber_set *traced, struct made_cloth *made, struct error *err);

#endif
