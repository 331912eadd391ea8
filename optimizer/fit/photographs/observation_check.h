/* What is suspicious about measurements without being wrong: said as warnings, so that a user looks before trusting the
 * fit. */
#ifndef SELVEDGE_OPTIMIZER_OBSERVATION_CHECK_H
#define SELVEDGE_OPTIMIZER_OBSERVATION_CHECK_H

#include "base/warning.h"
#include "optimizer/fit/photographs/observation.h"

/* Rows that are zero in all channels (a lamp that was off, an empty line); rows far darker than others lit from the
 * same side (below 4 % of what their median leads to expect under that lamp; from behind, 0.1 %); rows brighter than
 * any cloth (radiance above 20; from behind, above the lamp's); rows of the same configuration, however its angles are
 * written, that contradict each other: a channel differs by more than 5 % of the brightness and five standard errors.
 * Rows of weight 0 are left out. At most a few of each kind are named, the rest counted. */
void observation_set_check(const struct observation_set *o, const struct warning_sink *warn);

#endif
