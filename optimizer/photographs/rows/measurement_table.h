/* A table of measured mean radiances (CSV).
 *
 * Cells stand between commas, semicolons or tabs, numbers have a decimal point or comma (table_text.h). Lines that
 * start with '#' are comments. The first other line names the columns, in any order:
 *   set (fit | held-out), light_theta_deg, light_phi_deg, camera_theta_deg, camera_phi_deg, r, g, b           required
 *   index, name, cloth_rotation_deg (0), r_se, g_se, b_se (0), weight (1)                                     optional
 * cloth_rotation_deg "all": the row is a mean over all rotations of the cloth, and is compared with renderings of the
 * same mean (configuration.h, n_rotation), as it must be for data measured as isotropic. Rows may repeat. A name that
 * is no file name (job_document.h) gets '_' for every byte that is not allowed; a row without one is "fit-03". Errors
 * are STATUS_FORMAT or STATUS_INVALID with err->field OPTION_MEASUREMENT_FILE and a text that names file, line and
 * column: a missing or unknown column, a wrong number of cells, a cell that is no number, NaN or negative radiance, an
 * angle of 90 degrees or more from the normal (lamp behind the cloth: only without a black sheet), no row of the set
 * "fit". STATUS_TOO_LARGE: more renderings than CONFIGURATION_MAX_COUNT, where a mean over rotations takes one a
 * rotation. */
#ifndef SELVEDGE_OPTIMIZER_MEASUREMENT_TABLE_H
#define SELVEDGE_OPTIMIZER_MEASUREMENT_TABLE_H

#include "optimizer/photographs/rows/observation.h"

/* text: the file's content (NUL-terminated, n_bytes without the NUL); name: the file's name in errors. */
status measurement_table_parse(const char *text, size_t n_bytes, const char *name, const struct job_setup *setup,
                               struct observation_set *o, struct error *err);

#endif
