/* Principal components of signed distances, and singular vectors of a matrix, by subspace iteration (Halko,
 * Martinsson and Tropp 2011, "Finding structure with randomness", algorithm 4.4). Plain loops in a fixed order: the
 * same bits on every machine of one kind.
 */
#ifndef SELVEDGE_RENDERER_DISTANCE_COMPONENTS_H
#define SELVEDGE_RENDERER_DISTANCE_COMPONENTS_H

#include "base/thread_pool.h"

/* x: n x n_number, from which the mean is subtracted here. mean: n_number; NULL: x stays as it is. component:
 * n_component x n_number, unit and orthogonal, the strongest first; those beyond the rank of x are 0. n_component is at
 * most 48. STATUS_NO_MEMORY, STATUS_CANCELLED. */
status distance_components(float *x, size_t n, size_t n_number, size_t n_component, struct thread_pool *pool,
                           float *mean, float *component, struct error *err);

#endif
