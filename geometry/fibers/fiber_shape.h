/* The section of a fiber at one of its vertices, where it was measured: radius along the fiber, flatness, and how the
 * flat section is turned. A set of fibers or lines has one for each vertex, or none at all (discs of one radius a
 * fiber). Lengths are metres in a fiber_set and voxels in a polyline_set. */
#ifndef SELVEDGE_GEOMETRY_FIBER_SHAPE_H
#define SELVEDGE_GEOMETRY_FIBER_SHAPE_H

#include <stdbool.h>

struct fiber_shape {
    float radius, radius_se; /* of the disc of equal area, and its standard error; 0: not known, as the other errors */
    float ratio, ratio_se;   /* long over short axis of the section, at least 1 */
    float long_axis[3];      /* unit vector across the fiber; zero where the section was not measured */
    float angle_se_rad;      /* of the turn of the long axis about the fiber */
    float lumen, lumen_se;   /* width of the lumen over the outline's; with an error of 0: not measured */
};

/* Largest ratio of axes that files may state, for films. The fit goes up to 4. */
#define FIBER_RATIO_MOST 200.0f
/* Mean ratio of axes of a cloth from which on its fibers are flat. Round ones come out as up to some 1.1. */
#define FIBER_RATIO_FLAT 1.15

/* A disc. */
static inline struct fiber_shape fiber_shape_disc(float radius)
{
    return (struct fiber_shape){.radius = radius, .ratio = 1.0f};
}
/* Numbers of a section in files, beside the radius: radius_se in millimetres, ratio, ratio_se, angle_se_rad, long_axis,
 * and where lumens were measured, lumen and lumen_se. */
enum { FIBER_SHAPE_NUMBERS = 7, FIBER_SHAPE_WITH_LUMEN = 9 };
/* Widest lumen that files may state; the fit goes up to 0.9. */
#define FIBER_LUMEN_MOST 0.99f
void fiber_shape_numbers(const struct fiber_shape *s, float value[FIBER_SHAPE_WITH_LUMEN]);
/* Sets everything but the radius from n of these numbers. long_axis is made a unit vector. Returns false for numbers
 * that no section has. */
bool fiber_shape_set(struct fiber_shape *s, const float *value, int n);
/* Whether the section was measured. */
static inline bool fiber_shape_has_section(const struct fiber_shape *s)
{
    return s->long_axis[0] != 0.0f || s->long_axis[1] != 0.0f || s->long_axis[2] != 0.0f;
}

#endif
