/* A scan of several tiles of a periodic phantom, for tests of alignment and tiling. */
#ifndef SELVEDGE_TESTS_REPEATED_CLOTH_H
#define SELVEDGE_TESTS_REPEATED_CLOTH_H

#include "geometry/phantom/phantom.h"

/* v becomes the densities of n_repeat[0] x n_repeat[1] tiles, which need not be whole numbers: about 0 for void and 1
 * for fiber, plus noise with a standard deviation of 0.2. f becomes the fibers of one tile. The caller releases both.
 * Aborts the test when something fails. */
void repeated_cloth(enum phantom_weave weave, double diameter_voxel, const double n_repeat[2], struct fiber_set *f,
                    struct volume *v, size_t n_tile[3]);

#endif
