/* Light that a flat, endless cloth has scattered more than n_traced times, as a mean over its tile: the radiance
 * towards wo, at each hit by rays from there of a fiber of one kind, under parallel light from wi with irradiance pi
 * on a surface that faces it, is |cos th_i| times the value, which is linear between the nodes of two grids.
 *
 * The kind of a fiber is its class, weft or warp, and its tilt there: the sine of the angle at which it rises along x
 * or along y. Where threads cross, fibers rise and fall, and send light elsewhere. The value is linear between
 * DEEP_LIGHT_N_TILT nodes from -DEEP_LIGHT_TILT to DEEP_LIGHT_TILT, and constant beyond.
 *
 * A grid has edge x edge nodes on each side of the cloth, evenly over the square around the unit disk to which a
 * hemisphere is mapped: a direction lies at (2 / pi) theta from the middle, at its azimuth, and the horizon is the rim.
 * Class, tilt, view (side, row, column), light likewise, channels last; side 0 is above. Lights and views are not
 * exchangeable: a cloth of packed fibers is not reciprocal.
 *
 * Deep light enters the cloth beside the hit, so that on a bent cloth it meets another normal there. The mean of the
 * way from the hit to that place, in the plane of the cloth, is shift[view] + shift[n_node + light]; its deviations
 * along each axis have the standard deviation spread_mm. */
#ifndef SELVEDGE_RENDERER_DEEP_LIGHT_H
#define SELVEDGE_RENDERER_DEEP_LIGHT_H

#include <stddef.h>
#include <stdint.h>

enum { DEEP_LIGHT_MOST_EDGE = 24, DEEP_LIGHT_N_CLASS = 2, DEEP_LIGHT_N_TILT = 3 };
#define DEEP_LIGHT_TILT 0.45f

struct deep_light {
    uint32_t n_traced; /* 0: there is no table */
    uint32_t edge;     /* nodes along an edge of each grid */
    uint32_t n_side;   /* 1: views and lights are above only, because a black sheet lies below */
    float error;       /* relative standard error, root mean square, of light around the nodes: noise of the paths */
    float spread_mm;
    float back[3], through[3]; /* shares of diffuse light on its upper side that the cloth sends back, lets through */
    float *value;              /* DEEP_LIGHT_N_CLASS x DEEP_LIGHT_N_TILT x n_node x n_node x 3 */
    float (*shift)[2];         /* mm: n_node of views, then n_node of lights */
};

static inline size_t deep_light_n_node(const struct deep_light *d) { return (size_t)d->n_side * d->edge * d->edge; }
/* Numbers in value. */
static inline size_t deep_light_n_value(const struct deep_light *d)
{
    const size_t n_kind = (size_t)DEEP_LIGHT_N_CLASS * DEEP_LIGHT_N_TILT, n = deep_light_n_node(d);
    return d->n_traced > 0 ? 3 * n_kind * n * n : 0;
}
static inline size_t deep_light_n_shift(const struct deep_light *d)
{
    return d->n_traced > 0 ? 2 * deep_light_n_node(d) : 0;
}
/* The four nodes around a direction and their weights, which sum to 1. */
void deep_light_nodes(const struct deep_light *d, const double direction[3], size_t node[4], double weight[4]);
/* Class of a fiber by its tangent in the flat cloth: 1 when it lies along x, the weft, rather than along y. */
size_t deep_light_class(const float tangent[3]);
/* The two kinds around the kind of a fiber, class * DEEP_LIGHT_N_TILT + node of tilt, and their weights, which sum to
 * 1. A tangent and its opposite are the same. */
void deep_light_kinds(const float tangent[3], size_t kind[2], double weight[2]);
/* The share of diffuse light that a pile of such cloths without end sends back, as the end of a roll is one (Kubelka
 * and Munk: layers that send back R and let T through). */
float deep_light_pile(const struct deep_light *d, size_t channel);
/* Adds the radiance times scale. wo, wi: unit vectors; tangent: of the fiber in the flat cloth. A view from below where
 * there is a black sheet counts as one along the cloth; light from there as none. */
void deep_light_add(const struct deep_light *d, const float tangent[3], const float wo[3], const float wi[3],
                    const float scale[3], float rgb[3]);
/* Mean way from a hit to where light from wi that is seen from wo enters the cloth; as in deep_light_add. */
void deep_light_shift(const struct deep_light *d, const float wo[3], const float wi[3], float shift_mm[2]);

#endif
