/* Visibility of a square lamp from a grid of receivers, as rays have sampled it: what sheared filtering starts from
 * (sheared_filter.h).
 *
 * x is the place of a receiver as the lamp's centre sees it: along one of the lamp's edges, over the distance from the
 * lamp's plane. y is a place on the lamp along the same edge, in millimetres. What lies at a distance q from the
 * lamp's plane hides the lamp for a receiver at a distance D where x + s y has one value, with the slope
 * s = 1 / q - 1 / D.
 */
#ifndef SELVEDGE_RENDERER_LIGHT_FIELD_H
#define SELVEDGE_RENDERER_LIGHT_FIELD_H

#include "base/status.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum { LIGHT_FIELD_MAX_SIDE = 8 };

struct light_field {
    size_t width, height; /* receivers along the first and the second edge of the lamp */
    size_t n_side;        /* samples of each receiver along an edge of the lamp */
    double cell[2];       /* distance of neighbouring receivers in x */
    double half_side_mm;  /* of the lamp */
    uint8_t *lit;         /* [height][width][n_side, second edge][n_side, first edge]: 1 where the lamp is seen */
    float (*jitter)[2];   /* [height][width]: the same place in [0, 1) within all strata of a receiver */
    float (*slope)[2];    /* [height][width]: least and greatest, per mm; [0] 0: no ray has met anything */
};

/* All lit, and nothing met. STATUS_INVALID for no receivers or more than LIGHT_FIELD_MAX_SIDE samples along an edge;
 * STATUS_NO_MEMORY. Release in any case. */
status light_field_init(struct light_field *f, size_t width, size_t height, size_t n_side, struct error *err);
void light_field_release(struct light_field *f);
/* Place on the lamp of sample i along edge a of a receiver. */
double light_field_place_mm(const struct light_field *f, size_t i_receiver, int a, size_t i);
/* Counts an occluder of a slope. */
void light_field_meet(struct light_field *f, size_t i_receiver, double slope);
/* Replaces slopes by their means over the 5 x 5 receivers around, of those that have met anything: receivers near a
 * shadow get the slopes of what casts it. STATUS_NO_MEMORY. */
status light_field_smooth_slopes(struct light_field *f, struct error *err);

#endif
