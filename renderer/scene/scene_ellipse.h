/* The part of struct scene for fibers with elliptical sections, which are primitives of our own in Embree.
 *
 * Each segment is a straight cylinder with the elliptical section of its middle: the mean of radius, ratio of axes and
 * long axis at both ends. It ends at the plane that halves the angle to its neighbour, or at a plane across a free end.
 * Exact for straight fibers; where a section turns or a fiber bends, neighbours meet in planes that both ellipses fill
 * up to the step between them. The planes are faces of the segment, so that it is closed. A fiber that ends where
 * another one begins, in this tile or in the next, has it as its neighbour. */
#ifndef SELVEDGE_RENDERER_SCENE_ELLIPSE_H
#define SELVEDGE_RENDERER_SCENE_ELLIPSE_H

#include "renderer/scene/scene_data.h"

/* Lengths in millimetres; positions from p, the first end of the axis. */
struct scene_ellipse {
    float p[3], u[3], length;
    float v[3], w[3]; /* short and long axis over the semi-axes: x is on the surface where (v x)^2 + (w x)^2 = 1 */
    float begin[3], end[3]; /* unit normals of the planes at the ends, along u */
    float reach[3];         /* half of the box around the section */
    float beyond[2];        /* how far the surface goes on beyond either end of the axis, along u */
    float sharpest_mm;      /* least radius of curvature of the section */
    bool joined[2];         /* the fiber goes on beyond either end */
};

/* The part of a line that lies in a segment, with the outward normals (of any length) where it begins and ends. */
struct scene_ellipse_span {
    float begin, end, normal_begin[3], normal_end[3];
    bool joint_begin, joint_end; /* by a plane between it and another segment of its fiber */
};

/* The line through o in direction d, of any length. False: it misses the segment. */
bool scene_ellipse_span(const struct scene_ellipse *e, const float o[3], const float d[3],
                        struct scene_ellipse_span *span);

/* Fills in scene.ellipse from vertices, ratios and long axes, for a scene that has ratios. STATUS_NO_MEMORY. */
status scene_ellipse_fill(struct scene *s, struct error *err);
/* Makes the geometry of all segments, which the caller releases. */
RTCGeometry scene_ellipse_geometry(struct scene *s);

#endif
