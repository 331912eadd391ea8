/* The smooth surface of a bent cloth without its fibers, for previews (renderer/preview/proxy): the outer faces of its
 * shell, which lie on both sides of the cloth and at its cut edges. Its normals belong to the mesh, and go smoothly
 * over its triangles. Millimetres; the orbit center is the origin. Threads: any number on one scene.
 */
#ifndef SELVEDGE_RENDERER_SCENE_PROXY_H
#define SELVEDGE_RENDERER_SCENE_PROXY_H

#include <stdbool.h>

struct scene;

struct scene_proxy_hit {
    double distance_mm;
    double position_mm[3]; /* on a cut edge: on the upper side there, so that rays that go on leave the cloth */
    double normal[3];      /* unit, from the lower to the upper side of the cloth */
    double weft[3];        /* unit, at a right angle with the normal: the x axis of the flat cloth */
    bool lower;            /* the lower side was hit */
};

/* The first face along a ray of unit direction from `from_mm` on. False: there is none. scene: bent. */
bool scene_proxy_trace(const struct scene *scene, const double origin_mm[3], const double direction[3], double from_mm,
                       struct scene_proxy_hit *hit);
/* The mean shortest edge of the triangles: how finely the surface follows a bend. */
double scene_proxy_edge_mm(const struct scene *scene);

#endif
