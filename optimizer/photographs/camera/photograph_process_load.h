/* The job's knowledge of its camera, read from the files that the document names: rig, markers, record of the noise,
 * dark frames, color chart or white reference; and the photographs as the rest of the job takes them. */
#ifndef SELVEDGE_OPTIMIZER_PHOTOGRAPH_PROCESS_LOAD_H
#define SELVEDGE_OPTIMIZER_PHOTOGRAPH_PROCESS_LOAD_H

#include "optimizer/photographs/camera/photograph_process.h"

/* Reads the files of camera and rig that the document names; they are in `folder`. Gives photographs the angles of the
 * views that they name (rig.h), and crops and cameras by markers (marker_views.h), and replaces photographs of
 * cylinders by their columns (cylinder_columns.h). Errors have the option in err->field. */
status photograph_process_load(struct photograph_process *k, struct job_setup *setup, struct job_rows *rows,
                               const char *folder, struct error *err);

#endif
