/* Traces nodes of the tables of the medulla (medulla_grid.h). */
#ifndef SELVEDGE_RENDERER_MEDULLA_TRACE_H
#define SELVEDGE_RENDERER_MEDULLA_TRACE_H

#include "base/status.h"
#include "renderer/scattering/models/fur/medulla_grid.h"
#include "renderer/scattering/models/fur/medulla_walk.h"

/* Density of the azimuth of exit at each node, integral 1 over a turn. */
void medulla_trace_round(const struct medulla_medium *m, double offset, int n_walk, uint64_t seed,
                         float turn[MEDULLA_N_TURN]);

/* Both halves of the longitudinal function at each node: symmetric, and the integral of M cos^2 th_o dth_o is 1 for
 * every th_i. Walks are reciprocal (the light that leaves over cos th_o and the light that comes, over cos th_i, may be
 * exchanged), which both directions of a pair contribute to; a symmetric scale gives the integral (Sinkhorn 1964, "A
 * Relationship Between Arbitrary Positive Matrices and Doubly Stochastic Matrices"). Nodes beyond th = pi/2 repeat the
 * last ones; all are multiplied by medulla_slab_weight. n_walk: for each of 45 angles of incidence. STATUS_NO_MEMORY.
 * */
status medulla_trace_slab(const struct medulla_medium *m, int n_walk, uint64_t seed,
                          float (*half)[MEDULLA_N_SUM][MEDULLA_N_DIFFERENCE], struct error *err);

#endif
