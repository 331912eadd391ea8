/* The faces of fibers that count for rays which start inside of fibers. Only the files of this folder include this
 * header.
 *
 * A scattering event stands for the whole way through a fiber: a ray that goes on through the fiber skips the inside of
 * its surface (fabric thesis, section 2.4.2). A fiber is one closed tube, over its joints and over the faces of the
 * tile (scene_ends.h): the union of its segments. A round segment is the convex hull of the balls around its two ends
 * (scene_segment.h), an elliptical one the cylinder between its two planes (scene_ellipse.h). Fibers overlap a little
 * where they touch. So a ray meets the next front face of any tube, but the tube in which it starts only after it has
 * left it. A face of a segment that lies inside of its own tube does not count; rays that start outside never reach it.
 *
 * So a straight line meets each tube once, however tubes overlap: tubes that are pressed into each other scatter as
 * often as tubes that touch. */
#ifndef SELVEDGE_RENDERER_SCENE_FACES_H
#define SELVEDGE_RENDERER_SCENE_FACES_H

#include <stdbool.h>
#include <stdint.h>

struct scene;

/* How far a ray that leaves a round segment inwards does not meet its tube. SCENE_NO_SEGMENT: 0. */
float scene_faces_near(const struct scene *s, uint32_t i_from);
/* Whether a point of a round segment's surface lies inside of the tube that the segment is a part of, or the segment is
 * on the same piece of the tube as i_from. The point is seen from the copy of the tile that the segment is in. */
bool scene_faces_inside(const struct scene *s, uint32_t i_segment, uint32_t i_from, const float at[3]);

#endif
