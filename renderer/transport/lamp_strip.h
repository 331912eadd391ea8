/* Points of a square lamp near the strip of it that a narrow lobe of a fiber reflects to the viewer.
 *
 * A fiber scatters light of th_i about th_i = -th_o. Seen from the fiber, directions of one th_i cross the lamp along
 * nearly straight lines, so that a lobe that is narrower than the lamp takes light from a strip of it alone, which
 * random points of the lamp mostly miss; and scattering samples, which lie all around the fiber, mostly miss the lamp.
 * A point of the strip is drawn by its distance s along the lamp's plane, across those lines, with a normal density cut
 * to the lamp, and evenly along the line. The lines are taken as those at the lamp's centre: the density is exact for
 * the points drawn, and where the lines bend it only fits the lobe less well.
 */
#ifndef SELVEDGE_RENDERER_LAMP_STRIP_H
#define SELVEDGE_RENDERER_LAMP_STRIP_H

#include "renderer/transport/lamp.h"

/* Lengths in half sides of the lamp. */
struct lamp_strip {
    bool used;        /* false: no lobe is narrow and meets the lamp. Nothing else is set then */
    float across[2];  /* unit, in the lamp's plane: along which th_i changes; both components >= 0 (see mirror) */
    float mirror[2];  /* 1 or -1: signs of the lamp's edges with which they are */
    float reach;      /* s of the lamp's points lies in [-reach, reach] */
    float middle, sd; /* of the normal density of s */
    float low, all;   /* its error functions: at -reach, and at reach less that */
};

/* tangent: unit, of the fiber at position_mm (unwrapped); sin_o: sine of th_o, from the normal plane towards the
 * tangent; lobe_rad: standard deviation of the lobe in th_i, 0: there is none. */
void lamp_strip_init(struct lamp_strip *strip, const struct lamp *lamp, const float position_mm[3],
                     const float tangent[3], float sin_o, float lobe_rad);
/* Numbers in [0, 1)^2 by which lamp_sample draws a point of the strip. */
void lamp_strip_sample(const struct lamp_strip *strip, const float u[2], float lamp_u[2]);
/* Density of the strip's points over the density of all points of the lamp, at the point that lamp_sample draws by
 * lamp_u. */
float lamp_strip_ratio(const struct lamp_strip *strip, const float lamp_u[2]);
/* The same at the point that a direction meets, which must be one of the lamp's. */
float lamp_strip_ratio_towards(const struct lamp_strip *strip, const struct lamp *lamp, const float position_mm[3],
                               const float direction[3]);

#endif
