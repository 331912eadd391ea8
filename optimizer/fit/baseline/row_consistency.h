/* Consistency checks of measured radiances, for mistakes that no single row shows: another unit, another scale, angles
 * in radians, lamp and camera exchanged, means over all rotations given as one. The checks use bounds on the light that
 * a cloth can reflect under the stated lamps, and a plain BRDF (plain_brdf.h). They take milliseconds. */
#ifndef SELVEDGE_OPTIMIZER_ROW_CONSISTENCY_H
#define SELVEDGE_OPTIMIZER_ROW_CONSISTENCY_H

#include "base/warning.h"
#include "optimizer/photographs/rows/observation.h"

/* Median brightness per incident light of rows lit from the front, of a white diffuser 1, beyond which all rows are
 * dark or brighter than white: the darkest fabrics reflect 2 %, no fabric in the mean more than it receives. */
#define ROW_CONSISTENCY_DARK 0.003
#define ROW_CONSISTENCY_WHITE 1.25

/* STATUS_INVALID with the option `field` when the angles of the rows look like radians. */
status row_consistency_check_angles(const struct observation_set *o, const char *field, struct error *err);
/* Warns of the other mistakes. Rows under an environment, of weight 0 and contrasts are left out. STATUS_NO_MEMORY. */
status row_consistency_warn(const struct observation_set *o, const struct warning_sink *warn, struct error *err);

#endif
