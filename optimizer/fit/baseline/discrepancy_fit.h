/* Finds the discrepancy of a cloth (renderer/transport/discrepancy.h) from the rows of a fit: the part of the measured
 * radiances that the fibers at the result do not explain and that is smooth over the directions.
 *
 * ln(measured / rendered) of a row and channel is a Gaussian field plus a part of its own for each row, whose standard
 * deviation is DISCREPANCY_ROUGH of the field's (more in a channel that is darker than the row, in proportion). The
 * expected field between the rows is taken times `share` in [0, 1]. Scales and DISCREPANCY_ROUGH were chosen by
 * cross-validation over measured tables, all alike (NOTES.md of optimizer/fit); the share belongs to one fit, by the
 * cross-validation inside its rows (cross_validation.h). A share of 0 is the fit without discrepancy.
 *
 * Source: Kennedy and O'Hagan 2001, "Bayesian calibration of computer models", section 4; the share as in Breiman 1996,
 * "Stacked regressions". Differs: the field is fitted to the residuals of a finished fit instead of together with
 * it. */
#ifndef SELVEDGE_OPTIMIZER_DISCREPANCY_FIT_H
#define SELVEDGE_OPTIMIZER_DISCREPANCY_FIT_H

#include "optimizer/photographs/rows/observation.h"
#include "renderer/transport/discrepancy.h"

#define DISCREPANCY_ROUGH (1.0 / 6.0)

struct discrepancy_row {
    double place[DISCREPANCY_COORDINATES];
    double log_ratio[3]; /* ln(measured / rendered) */
    double rough_var[3]; /* of its own part, in units of the field's variance */
};

/* Whether a row tells of the discrepancy: a mean radiance that was measured, under a lamp in front alone. */
bool discrepancy_applies(const struct observation *o);
/* The row of an observation that is rendered as rendered_rgb. */
void discrepancy_row_of(const struct observation *o, const double rendered_rgb[3], struct discrepancy_row *row);
/* Uses at most DISCREPANCY_MAX_PLACE rows, evenly spaced among the n rows. n = 0 or share 0: no discrepancy.
 * STATUS_NO_MEMORY. */
status discrepancy_fit(const struct discrepancy_row *row, size_t n, double share, struct discrepancy *d,
                       struct error *err);
/* ln of the factor at a place, without its bound. */
void discrepancy_log_factor(const struct discrepancy *d, const double place[DISCREPANCY_COORDINATES],
                            double log_rgb[3]);

#endif
