/* Pictures of the fitted cloth laid on surfaces: pictures/on-<number>.exr and .png of the results, numbers from 1. */
#ifndef SELVEDGE_OPTIMIZER_SURFACE_PICTURES_H
#define SELVEDGE_OPTIMIZER_SURFACE_PICTURES_H

#include "optimizer/report/findings/report.h"

/* Samples of all pictures together, with their tables: in paths of a path-traced picture that take as long. */
double surface_pictures_paths(const struct job_results *results);

/* Renders the pictures that the job document asks for, and fills report->surface_pictures, the entries of result.json.
 * A picture that an earlier attempt has finished is not rendered again. from, to: shares of the stage before and after.
 * Errors of surface_cloth_new and of render_run. */
status surface_pictures_write(struct report *report, double from, double to, struct error *err);

#endif
