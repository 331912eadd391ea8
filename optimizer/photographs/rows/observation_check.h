/* Warnings about measurements that are suspicious without being invalid, so that a user checks them before trusting
 * the fit. */
#ifndef SELVEDGE_OPTIMIZER_OBSERVATION_CHECK_H
#define SELVEDGE_OPTIMIZER_OBSERVATION_CHECK_H

#include "base/warning.h"
#include "optimizer/photographs/rows/observation.h"

/* Warns of rows that are zero in all channels (a lamp that was off, an empty line); rows far darker than others lit
 * from the same side (below 4 % of the radiance that their median predicts under the same lamp; from behind, 0.1 %);
 * rows brighter than any cloth (radiance above 20; from behind, above the lamp's); and rows of the same configuration,
 * however its angles are written, that contradict each other, because a channel differs by more than 5 % of the
 * brightness and by more than five standard errors. Rows of weight 0 are left out. The first three of each kind are
 * named, the rest are counted. warn may be NULL. */
void observation_set_check(const struct observation_set *o, const struct warning_sink *warn);

#endif
