/* The places at which light that is scattered in the medulla of a fiber is tabulated: coordinates of the nodes and the
 * shape of the compressed tables (medulla.h states their meaning).
 *
 *     round   density of the azimuth of exit, by optical radius, anisotropy, offset of entry and azimuth
 *     slab    longitudinal function of either half, by optical radius, anisotropy, |th_i + th_o| and |th_i - th_o|
 */
#ifndef SELVEDGE_RENDERER_MEDULLA_GRID_H
#define SELVEDGE_RENDERER_MEDULLA_GRID_H

#include <math.h>

enum {
    MEDULLA_N_DEPTH = 16,      /* optical radius, equidistant in its ln(1 + depth) */
    MEDULLA_N_G = 14,          /* anisotropy */
    MEDULLA_N_OFFSET = 12,     /* asin h' over [0, pi/2] */
    MEDULLA_N_TURN = 180,      /* azimuth over a turn, periodic; node 0 is back to where the light comes from */
    MEDULLA_N_SUM = 46,        /* |th_i + th_o| over [0, pi] */
    MEDULLA_N_DIFFERENCE = 24, /* |th_i - th_o| over [0, pi] */
    MEDULLA_N_HALF = 2,        /* back to the side of entry, and through to the other side */
    MEDULLA_N_AXIS = 4,
    MEDULLA_ROUND_RANK = 24,
    MEDULLA_SLAB_RANK = 16
};
#define MEDULLA_MOST_DEPTH 8.0
#define MEDULLA_MOST_G 0.8
#define MEDULLA_LEAST_DEPTH 1e-4 /* value of the first node: light is scattered once */
#define MEDULLA_MOST_OFFSET 0.9998

static inline double medulla_depth_of_node(int i)
{
    double depth = expm1(log1p(MEDULLA_MOST_DEPTH) * i / (MEDULLA_N_DEPTH - 1));
    return fmax(depth, MEDULLA_LEAST_DEPTH);
}

static inline double medulla_g_of_node(int i) { return MEDULLA_MOST_G * i / (MEDULLA_N_G - 1); }

static inline double medulla_offset_of_node(int i)
{
    return fmin(sin(M_PI_2 * i / (MEDULLA_N_OFFSET - 1)), MEDULLA_MOST_OFFSET);
}

/* Returns the factor of the longitudinal function before it is compressed. It is small for grazing light, which the
 * walks estimate poorly and which carries little energy, cos th_i cos th_o = (cos sum + cos difference) / 2. */
static inline double medulla_slab_weight(double sum, double difference)
{
    return sqrt(fmax(0.5 * (cos(sum) + cos(difference)), 0) + 0.05);
}

#endif
