/* Photographs of a cloth on a cylinder become photographs of its columns, each with its own angles, distances and part
 * of the picture (cylinder_view.h), so that the rest of a job treats them as photographs of flat cloth. The cloth is
 * taken as flat within a column; its light is that of an endless cloth, because no part of a cylinder shades another.
 *
 * The outline of the cylinder is given, or found in the picture (cylinder_edges.h), or follows from the rig's markers,
 * which lie in the plane of the highest line. */
#ifndef SELVEDGE_OPTIMIZER_CYLINDER_COLUMNS_H
#define SELVEDGE_OPTIMIZER_CYLINDER_COLUMNS_H

#include "optimizer/photographs/camera/photograph_process.h"

struct job_photograph;
struct job_rows;
struct job_setup;

/* Replaces each photograph of a cylinder by its columns of cylinder_step_deg, whose middles are whole multiples of the
 * step. Columns that the lamp or camera sees at more than cylinder_limit_deg, and those narrower than two pixels, are
 * left out with a warning. STATUS_INVALID, field an option id: no outline, or one whose side lies in shadow before a
 * dark background; a radius that contradicts the lens or the markers by more than 5 %; no column left; more rows than
 * JOB_MAX_PHOTOGRAPH. With markers an outline that is not found where they promise it, as of a radius that is stated
 * too small, gives a warning that asks for the radius, and the outline by the markers is taken. */
status cylinder_columns_make(const struct photograph_process *k, const struct job_setup *setup, struct job_rows *rows,
                             const char *folder, struct error *err);

#endif
