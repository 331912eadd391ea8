/* The lamps of a table of measurements, and the planes through the normal that its cameras lie in: rows with the same
 * lamp have one sphere, and rows with the same lamp, plane and cloth have one lobe. */
#ifndef SELVEDGE_OPTIMIZER_TABLE_LAMPS_H
#define SELVEDGE_OPTIMIZER_TABLE_LAMPS_H

#include "optimizer/photographs/rows/observation.h"

/* Returns the first row that has the lamp of row i. */
size_t table_lamp_row(const struct observation_set *o, size_t i);
size_t table_lamp_count(const struct observation_set *o);

/* The camera of a row as an angle from the normal within the plane through its lamp's azimuth plus plane_rad, which is
 * in [0, pi). The angle is positive on the side away from the lamp, so that the mirror direction has a positive one. */
struct table_camera {
    double plane_rad, theta_rad;
};
struct table_camera table_camera_of(const struct configuration *c);
/* Returns whether rows i and j belong to one lobe: the same lamp, plane and rotation of the cloth. A camera on the
 * normal lies in every plane. */
bool table_same_lobe(const struct observation_set *o, size_t i, size_t j);
/* Returns the first row of the lobe of row i. */
size_t table_lobe_row(const struct observation_set *o, size_t i);
size_t table_lobe_count(const struct observation_set *o);

#endif
