/* Reads the measurements that a job document names: its table, or its photographs. */
#ifndef SELVEDGE_OPTIMIZER_OBSERVATION_LOAD_H
#define SELVEDGE_OPTIMIZER_OBSERVATION_LOAD_H

#include "base/warning.h"
#include "optimizer/photographs/camera/photograph_develop.h"
#include "optimizer/photographs/rows/observation.h"

struct job_fit;
struct job_rows;
struct job_setup;

/* Appends the observations of the table or of all photographs to o; their files are in `folder`. Photographs that are
 * not uniform (photograph.h), or too dark for the texture that the document asks for, give warnings; warn may be NULL.
 * process: noise, colors and lens of the camera; NULL: none is known. Errors: from file_read_all, measurement_table.h,
 * photograph.h and photograph_contrast.h, with the option in err->field. */
status observation_set_load(const struct job_setup *setup, const struct job_rows *rows, const struct job_fit *fit,
                            const char *folder, const struct photograph_process *process,
                            const struct warning_sink *warn, struct observation_set *o, struct error *err);

#endif
