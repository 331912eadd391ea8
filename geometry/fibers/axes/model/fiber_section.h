/* Sections of two axes: the flatness of a fiber, and how its section is turned, at every vertex of a line.
 *
 * The section of a fiber of radius r (of the disc of equal area) is the ellipse o^T exp(-2 L) o = r^2, where o is the
 * offset from the axis and L = [c s; s -c] in the frame (u, t x u), t the fiber's direction. Its half axes are r exp(f)
 * and r exp(-f), f = |(c, s)|; a disc has c = s = 0. The frames of neighbouring vertices differ by the bend of the line
 * only, so c and s change as the section turns about its axis. */
#ifndef SELVEDGE_GEOMETRY_FIBER_SECTION_H
#define SELVEDGE_GEOMETRY_FIBER_SECTION_H

#include "base/thread_pool.h"
#include "geometry/fibers/polyline.h"

struct fiber_section {
    float u[3]; /* unit vector perpendicular to the fiber */
    float c, s;
};

/* The section of a segment, prepared for many points. Without sections all points are compared with a disc. */
struct section_view {
    float u[3], v[3];
    float uu, uv, vv; /* exp(-2 L) */
    float stretch;    /* long half axis over radius */
};

/* A point seen from the section it is near to. Derivatives are taken of depth_voxel. */
struct section_place {
    float depth;     /* distance beyond the outline, voxels; of the first order in it */
    float share;     /* distance from the axis over the outline's distance on the same ray */
    float normal[3]; /* of the outline */
    float along;     /* place of the foot on the segment, 0 .. 1; set by the caller */
    float by_radius, by_c, by_s;
};

/* Makes discs with frames that follow each line without twist. section: one for each vertex. */
void fiber_sections_start(const struct polyline_set *lines, struct fiber_section *section);
/* Makes the frames perpendicular to lines that have moved. */
void fiber_sections_turn(const struct polyline_set *lines, struct fiber_section *section);
/* The mean of the sections at the ends of the segment from a to b. */
struct section_view fiber_section_view(const struct fiber_section *first, const struct fiber_section *second,
                                       const float a[3], const float b[3]);
/* offset: of a point from the axis, not zero. */
struct section_place fiber_section_place(const struct section_view *w, float radius, const float offset[3]);
/* Writes the ratio of axes and the long axis of a section of a fiber along the unit vector t, without errors. */
void fiber_section_to_shape(const struct fiber_section *section, const float t[3], struct fiber_shape *shape);
/* The inverse: sets c and s in the frame of the section, which is made perpendicular to t. */
void fiber_section_take_shape(const struct fiber_shape *shape, const float t[3], struct fiber_section *section);
/* Ratio of the axes. */
float fiber_section_ratio(const struct fiber_section *section);

/* Normal equation of (c, s) at one vertex. */
struct section_equation {
    float normal[3], gradient[2]; /* cc, cs, ss */
};

/* Steps the sections to the minimum of their data terms, a penalty on their second differences along the line, which
 * smooths them over `length` vertices, and one on their size of weight `hold`. Bounded. STATUS_NO_MEMORY. */
status fiber_sections_solve(const struct polyline_set *lines, const struct section_equation *equation, double length,
                            double hold, struct fiber_section *section, struct thread_pool *pool, struct error *err);

/* Elements of the banded matrix for each component of a section. */
enum { SECTION_BAND = 5 };
/* Weight of the penalty on second differences that smooths over `length` vertices. */
double fiber_sections_stiffness(const struct section_equation *equation, size_t n_vertex, double length);
/* The inverse of the matrix of the normal equations of one line of n vertices: its elements cc, cs and ss at each
 * vertex, which are the variances of c and s for a noise of 1 where the penalties describe the fiber. m: room for
 * 2 SECTION_BAND n numbers. Returns false where the matrix is not positive definite. */
bool fiber_section_variance(const struct section_equation *equation, size_t n, double stiffness, double hold, double *m,
                            double (*variance)[3]);

#endif
