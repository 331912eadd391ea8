/* The folds of cross-validation: which rows are left out together (Stone 1974, Cross-validatory choice and assessment
 * of statistical predictions).
 *
 * Rows with the same directions of light and camera, whatever the cloth's rotation, stay together as a group. Groups
 * are dealt to at most FOLDS_MAX folds in the order of the rows; up to that number of groups each is a fold of its own
 * (leave one out). Every model of the same rows, the plain BRDF too, is judged by the same folds.
 */
#ifndef SELVEDGE_OPTIMIZER_FOLDS_H
#define SELVEDGE_OPTIMIZER_FOLDS_H

#include "optimizer/photographs/rows/observation.h"

enum { FOLDS_MAX = 16, FOLDS_LEAST = 4 };

/* Writes the fold of each of the o->n observations and returns the number of folds. Expected rows are in none of them
 * (FOLDS_MAX) and come last. */
size_t folds_deal(const struct observation_set *o, size_t *fold);

#endif
