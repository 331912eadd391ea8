/* Marginalises one gain for each configuration; linear_model_pool has the formulas. */
#ifndef SELVEDGE_OPTIMIZER_LINEAR_GAIN_H
#define SELVEDGE_OPTIMIZER_LINEAR_GAIN_H

#include "optimizer/fit/linear/linear_model.h"

/* Removes gains of standard deviation m->gain_sd from residuals, derivatives and their variances. To be called once for
 * each pooling. The errors that photographs state keep their variances; the errors of the color matrix lose the part
 * that a gain takes out. */
void linear_gain_absorb(struct linear_model *m, const struct observation_set *o);

#endif
