/* Light that is scattered in the medulla of a fiber, the core of hairs and wool, from tables (Yan, Jensen and
 * Ramamoorthi 2017, "An Efficient and Practical Near and Far Field Fur Reflectance Model", section 4).
 *
 *     around   density of the azimuth psi at which light leaves. psi = 0 points back along the ray in the medulla.
 *              Depends on the optical radius of the medulla, the anisotropy g, and asin h', where h' is the offset of
 *              the ray in radii of the medulla; a ray with h' > 0 passes the axis on the side of psi < 0. The integral
 *              over a turn is 1.
 *     along    M of the light that leaves on the side of entry ("back"), and M of the light that goes through. Depends
 *              on the optical radius, g, and both longitudinal angles. Symmetric. A symmetric scale makes the integral
 *              of M cos^2 th_o dth_o exactly 1 in spite of the compression.
 *
 * The tables are sums of MEDULLA_*_RANK products of functions of one variable, made by medulla-tables, a program of the
 * tree that traces random walks (medulla_walk.h, medulla_fit.h): 34 kB, checked in as C source because making them
 * takes a minute on two cores (`make medulla-tables`). Functions go through their nodes as cubics with continuous
 * slopes (Catmull and Rom), so derivatives are exact for the tabulated function. */
#ifndef SELVEDGE_RENDERER_MEDULLA_H
#define SELVEDGE_RENDERER_MEDULLA_H

#include "base/status.h"
#include "base/thread_pool.h"
#include "renderer/scattering/models/fur/medulla_grid.h"

extern const float medulla_round_depth[MEDULLA_N_DEPTH][MEDULLA_ROUND_RANK];
extern const float medulla_round_g[MEDULLA_N_G][MEDULLA_ROUND_RANK];
extern const float medulla_round_offset[MEDULLA_N_OFFSET][MEDULLA_ROUND_RANK];
extern const float medulla_round_turn[MEDULLA_N_TURN][MEDULLA_ROUND_RANK];
extern const float medulla_back_depth[MEDULLA_N_DEPTH][MEDULLA_SLAB_RANK];
extern const float medulla_back_g[MEDULLA_N_G][MEDULLA_SLAB_RANK];
extern const float medulla_back_sum[MEDULLA_N_SUM][MEDULLA_SLAB_RANK];
extern const float medulla_back_difference[MEDULLA_N_DIFFERENCE][MEDULLA_SLAB_RANK];
extern const float medulla_through_depth[MEDULLA_N_DEPTH][MEDULLA_SLAB_RANK];
extern const float medulla_through_g[MEDULLA_N_G][MEDULLA_SLAB_RANK];
extern const float medulla_through_sum[MEDULLA_N_SUM][MEDULLA_SLAB_RANK];
extern const float medulla_through_difference[MEDULLA_N_DIFFERENCE][MEDULLA_SLAB_RANK];

enum medulla_by { MEDULLA_BY_DEPTH, MEDULLA_BY_G, MEDULLA_N_BY };

/* ---- around the fiber ---- */

/* The factors of one anisotropy, and their derivatives by it. */
struct medulla_around {
    float g[MEDULLA_ROUND_RANK], d_g[MEDULLA_ROUND_RANK];
};

/* Weights of the functions of psi for one optical radius and offset, of sum 1, and their derivatives. */
enum medulla_ray_by { MEDULLA_RAY_BY_DEPTH, MEDULLA_RAY_BY_G, MEDULLA_RAY_BY_OFFSET, MEDULLA_RAY_N_BY };
struct medulla_ray {
    float weight[MEDULLA_ROUND_RANK], d[MEDULLA_RAY_N_BY][MEDULLA_ROUND_RANK];
};

void medulla_around_init(struct medulla_around *m, double g);
/* depth in [0, MEDULLA_MOST_DEPTH], a larger depth counts as the limit; offset = asin |h'| in [0, pi/2]. */
void medulla_ray_init(const struct medulla_around *m, double depth, double offset, struct medulla_ray *ray);
/* The density at psi for h' >= 0 (for h' < 0: the density at -psi), in [0, pi) or any other turn. When d is not NULL,
 * its derivatives as of medulla_ray_by, and the derivative by psi as the last. */
double medulla_ray_density(const struct medulla_ray *ray, double psi, double *d);
/* Writes the integrals of cos(k psi) and sin(k psi) times each function of psi, k = 0 .. n_wave - 1. */
void medulla_waves(int n_wave, float (*cosine)[MEDULLA_ROUND_RANK], float (*sine)[MEDULLA_ROUND_RANK]);
/* Adds the n waves of a ray; of[r * n + k]: wave k of function r of psi. */
static inline void medulla_add_waves(const float weight[MEDULLA_ROUND_RANK], const float *of, int n,
                                     float *restrict sum)
{
    for (int r = 0; r < MEDULLA_ROUND_RANK; r++)
        for (int k = 0; k < n; k++) sum[k] += weight[r] * of[r * n + k];
}

/* ---- along the fiber ---- */

enum { MEDULLA_FINE_SUM = 181, MEDULLA_FINE_DIFFERENCE = 91 }; /* nodes over [0, pi], read by straight lines */

struct medulla_along {
    float m[MEDULLA_FINE_SUM][MEDULLA_FINE_DIFFERENCE][MEDULLA_N_HALF];
    float d[MEDULLA_N_BY][MEDULLA_FINE_SUM][MEDULLA_FINE_DIFFERENCE][MEDULLA_N_HALF];
};

/* The pool may be NULL. STATUS_NO_MEMORY. */
status medulla_along_init(struct medulla_along *m, double depth, double g, struct thread_pool *pool, struct error *err);
/* M of both halves for th_i + th_o and th_i - th_o, and its derivatives when d is not NULL. */
void medulla_along_at(const struct medulla_along *m, float sum, float difference, float value[MEDULLA_N_HALF],
                      float (*d)[MEDULLA_N_HALF]);

#endif
