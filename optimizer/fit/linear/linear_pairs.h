/* Inside linear/: rows that share their camera paths. */
#ifndef SELVEDGE_OPTIMIZER_LINEAR_PAIRS_H
#define SELVEDGE_OPTIMIZER_LINEAR_PAIRS_H

#include "optimizer/fit/linear/linear_model.h"

/* Fills in m->pair: correlations as means over all estimates, weighted by their paths. */
void linear_pairs_pool(struct linear_model *m, const struct linear_history *h);

#endif
