/* A periodic phantom's scan, repeated, for tests of alignment and tiling. */
#ifndef SELVEDGE_TESTS_REPEATED_CLOTH_H
#define SELVEDGE_TESTS_REPEATED_CLOTH_H

#include "geometry/phantom/phantom.h"

/* v (volume_release it) has the densities of the tile, about 0 void and 1 fiber, plus noise of 0.2, continued over n_repeat[0] x n_repeat[1]
 * tiles (need not be whole); f gets the fibers of one tile. Diameter of fibers in voxels. Aborts the test when something fails. */
void repeated_cloth(enum phantom_weave weave, double diameter_voxel, const double n_repeat[2], struct fiber_set *f,
                    struct volume *v, size_t n_tile[3]);

#endif
