/* Sixteen configurations like those of the fabric thesis, figure 5.6: four pairs of elevations, in plane and out of
 * plane, two cloth rotations; lamp 10 cm at 61 cm, crop 1 cm.
 */
#ifndef SELVEDGE_TESTS_ORBIT_CONFIGURATIONS_H
#define SELVEDGE_TESTS_ORBIT_CONFIGURATIONS_H

#include "renderer/scene/configuration.h"

void orbit_configurations_16(struct configuration c[16]);

#endif
