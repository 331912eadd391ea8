/* Binary pictures over the sphere: FAST_N_PICTURE rows in theta from +z, as many columns in phi. */
#ifndef SELVEDGE_RENDERER_SPHERE_DISTANCE_H
#define SELVEDGE_RENDERER_SPHERE_DISTANCE_H

#include "renderer/fast/fast_tables.h"

enum { SPHERE_PIXEL = FAST_N_PICTURE * FAST_N_PICTURE, SPHERE_GRID = FAST_N_GRID * FAST_N_GRID };

struct sphere_directions {
    float direction[SPHERE_PIXEL][3];  /* of the pixels' centres */
    float solid_angle[FAST_N_PICTURE]; /* of a pixel of each row, in sr */
};

void sphere_directions_init(struct sphere_directions *s);
/* The signed distance (radians) to the nearest pixel of the other kind, positive where the picture is not 0, at the
 * points of a grid of FAST_N_GRID x FAST_N_GRID, each a mean over the pixels around it. pi or -pi where all pixels are
 * of one kind. Distances run from pixel to pixel along neighbours (Danielsson 1980, "Euclidean distance mapping"), so
 * that a few are too long by a share of a pixel. */
void sphere_distance(const struct sphere_directions *s, const uint8_t picture[SPHERE_PIXEL],
                     float distance_rad[SPHERE_GRID]);

#endif
