/* Which faces of fibers count for rays that start inside of fibers. Inside of struct scene.
 *
 * A scattering event stands for the whole way through a fiber: a ray that goes on through the fiber skips the inside of
 * its surface (fabric thesis, section 2.4.2). A fiber is one closed tube, over its joints and over the faces of the
 * tile (scene_ends.h): the union of its segments. A round segment is the convex hull of the balls around its two ends
 * (Embree's round linear curve), an elliptical one the cylinder between its two planes (scene_ellipse.h). Fibers
 * overlap a little where they touch. So a ray meets the next front face of a tube, wherever that lies, and a tube that
 * it starts in only after it has come out. Faces of segments inside of their own tube are none: rays from outside never
 * reach them, and for other rays Embree's filter refuses them and all back faces.
 */
#ifndef SELVEDGE_RENDERER_SCENE_FACES_H
#define SELVEDGE_RENDERER_SCENE_FACES_H

#include <embree3/rtcore.h>
#include <stdbool.h>
#include <stdint.h>

struct scene;
struct scene_ray;

enum { SCENE_MAX_BACK = 8 };

/* What Embree's filter is told and tells. */
struct scene_faces {
    struct RTCIntersectContext embree;
    const struct scene *flat;
    uint32_t i_from; /* the segment that the ray leaves, whose tube it does not meet before near_t */
    float near_t;
    uint32_t n_back; /* back faces that were refused */
    struct {
        float t;
        uint32_t i_segment, i_copy;
    } back[SCENE_MAX_BACK];
};

/* ray NULL: one that starts anywhere and meets all front faces. */
void scene_faces_init(struct scene_faces *f, const struct scene *flat, const struct scene_ray *ray);
/* Embree's filter, whose context begins with a scene_faces. */
void scene_faces_filter(const struct RTCFilterFunctionNArguments *a);
/* How many of the n_inside fibers that a ray started in it has left before a distance. */
uint32_t scene_faces_left(const struct scene_faces *f, float t, uint32_t n_inside);

#endif
