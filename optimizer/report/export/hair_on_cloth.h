/* The hair mixtures of an export (hair_fit.h) fitted on the cloth itself, by hair_mixture.v1: the cloth with the
 * mixtures comes as near as it can to the radiances of the fitted cloth, over lamps and cameras of a whole hemisphere.
 * Light meets many fibers in a cloth, so the mixture that is nearest to a single fiber's scattering is not the one
 * whose cloth is nearest. The cloth with the mixtures has round fibers, as in the programs that read an export. */
#ifndef SELVEDGE_OPTIMIZER_HAIR_ON_CLOTH_H
#define SELVEDGE_OPTIMIZER_HAIR_ON_CLOTH_H

#include "optimizer/report/export/export_scene.h"

/* Replaces the mixtures of all groups of e, and fills e->hair_error. A cloth of more groups than the fit has room for
 * keeps the mixtures of its fibers, and no error is stated. from, to: shares of e->progress. STATUS_NO_MEMORY,
 * STATUS_CANCELLED, STATUS_NUMERIC as estimate_run. */
status hair_on_cloth_run(struct export_scene *e, double from, double to, struct error *err);
/* Paths of a photograph that take as long, after a fit of n_fit_path; 0: no fit was made, the result was given. */
double hair_on_cloth_paths(double n_fit_path);

#endif
