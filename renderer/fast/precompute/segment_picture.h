/* The directions in which a segment of the cloth sees the open (the segment visibility function of the fabric thesis,
 * section 6.4.1): rays from the middle of its axis, which its own surface does not stop. */
#ifndef SELVEDGE_RENDERER_SEGMENT_PICTURE_H
#define SELVEDGE_RENDERER_SEGMENT_PICTURE_H

#include "renderer/fast/precompute/sphere_distance.h"
#include "renderer/scene/scene_ray.h"

/* Whether any of 16 x 16 directions (only upward ones, with a black sheet) sees the open. */
bool segment_sees(const struct scene *flat, const struct sphere_directions *s, uint32_t i_segment);
/* The picture: 1 where the open is seen. Rays are traced for every 8th row and column, and between those that differ
 * twice as close, until all pixels are known: a hole of less than 8 pixels may be missed. */
void segment_picture(const struct scene *flat, const struct sphere_directions *s, uint32_t i_segment,
                     uint8_t picture[SPHERE_PIXEL]);

#endif
