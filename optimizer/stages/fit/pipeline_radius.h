/* The fiber radius by an outer search: the cloth is made anew at several radii (all fibers grow or shrink alike; their
 * axes stay), the first surface model of the job is fitted to each, and the minimum of the objective over the radius is
 * found with the noise taken into account (noisy_minimum.h). Derivatives by the radius are not needed.
 *
 * Standard error of ln radius: the Monte-Carlo error of the minimum, and an error by the residuals: a change of the
 * objective by s2 = f / (rows - free parameters - 1) is one standard error (s2 is at least the value that the
 * photographs' stated errors give), so var = 2 s2 / curvature, as for any least squares. A radius that the photographs
 * do not determine is left as it was; one at the edge of its range is taken there. Each fit has a journal of its own,
 * so the search resumes bit by bit. */
#ifndef SELVEDGE_OPTIMIZER_PIPELINE_RADIUS_H
#define SELVEDGE_OPTIMIZER_PIPELINE_RADIUS_H

#include "optimizer/stages/fit_stages.h"
#include "optimizer/stages/run/worker_series.h"

/* Share of the search in the progress of the stage. */
#define PIPELINE_RADIUS_SHARE 0.4

/* Fills in radius, sets the fibers' radii and makes the scene anew. Steps go to the series. */
status pipeline_radius_search(const struct fit_input *in, struct worker_series *series, struct fitted_radius *radius,
                              struct error *err);
/* Applies the radius that an earlier attempt found. */
status pipeline_radius_apply(const struct fit_input *in, const struct fitted_radius *radius, struct error *err);
/* Returns whether the fitted radius is used; false when the cloth's own is kept. */
bool pipeline_radius_used(const struct fitted_radius *r);

#endif
