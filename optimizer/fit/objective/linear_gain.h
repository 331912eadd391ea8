/* One gain for each configuration, marginalised: see linear_model_pool. */
#ifndef SELVEDGE_OPTIMIZER_LINEAR_GAIN_H
#define SELVEDGE_OPTIMIZER_LINEAR_GAIN_H

#include "optimizer/fit/objective/linear_model.h"

/* Takes gains of standard deviation m->gain_sd out of residuals, derivatives and their variances; once for each pooling.
 * photograph_var stays as it is. */
void linear_gain_absorb(struct linear_model *m, const struct observation_set *o);

#endif
