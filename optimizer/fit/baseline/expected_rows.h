/* Radiances that are expected between the measured ones. A fiber model with the numbers of its cloth has more freedom
 * than a dozen rows take away: many values fit these rows, and differ where nothing was measured. A plain BRDF
 * (plain_brdf.h) is a poorer description with less freedom. Its radiances are added to a fit as rows of small weight,
 * which say which of the good fits to take.
 *
 * Row i, of EXPECTED_ROWS at directions spread evenly over those that were measured, has the extra weight
 *
 *   weight_i = min(1, strength 0.2^2 / (EXPECTED_ROWS v_i)),   v_i = misfit^2 + jackknife_i,
 *
 * misfit^2: mean square of the BRDF's relative error over the fitted rows per degree of freedom; jackknife_i: variance
 * of its radiance there when the folds of the rows are left out in turn (Tukey 1958), relative to its brightness. Where
 * the BRDF fails or extrapolates, its rows count little, and none counts more than a measured one. A strength of 1 was
 * chosen by cross-validation over measured tables (NOTES.md of optimizer/fit).
 *
 * Source of the idea: a prior on a model's predictions instead of on its parameters, as power priors are (Ibrahim and
 * Chen 2000, "Power prior distributions for regression models"). Differs: the expected data come from a simpler model
 * of the same rows, so each fold of a cross-validation has its own (left_out_rgb), made without that fold. */
#ifndef SELVEDGE_OPTIMIZER_EXPECTED_ROWS_H
#define SELVEDGE_OPTIMIZER_EXPECTED_ROWS_H

#include "optimizer/fit/objective/folds.h"
#include "optimizer/photographs/rows/observation.h"

enum { EXPECTED_ROWS = 24 };

struct expected_rows {
    size_t n;     /* rows that were appended: EXPECTED_ROWS, or 0 */
    double count; /* number of measured rows that weigh as much as all expected rows together */
    double left_out_rgb[EXPECTED_ROWS][3 * FOLDS_MAX];
};

/* Appends the expected rows to `to`. fitted: measured rows with weights whose mean is 1. Nothing is appended where
 * these have fewer than FOLDS_LEAST folds, none of them is lit from the front, or an environment lights one. The rows
 * point into e, which must outlive them. STATUS_NO_MEMORY. */
status expected_rows_append(const struct observation_set *fitted, double strength, struct expected_rows *e,
                            struct observation_set *to, struct error *err);

#endif
