/* Rays of the pixels of a picture over a lamp, a lens or the directions above a surface, from which ray_filter.h
 * estimates the mean of every pixel (Yan, "Physically-based modeling and rendering of complex visual appearance", 2018,
 * sections 2.6 and 5.4 to 5.5).
 *
 * A pixel has one receiver. x is its place along two axes, y the place that a ray goes to along the same axes, between
 * -half and half. The light f(x, y) along a ray does not change where x + s y stays the same, with the slope s:
 *
 *   soft shadow   x: the place as the lamp's centre sees it, along one of the lamp's edges, over the distance from the
 *                 lamp's plane; y: on the lamp, in mm; s = 1 / q - 1 / D of an occluder at a distance q from the lamp's
 *                 plane for a receiver at D. Of a lamp at infinity x is the place across its direction in mm, y the
 *                 tangent of the angle to it, and s the distance of the occluder.
 *   lens          x: the pixel; y: on the lens, in mm; s: pixels by which the point that a ray meets moves, per mm.
 *   indirect      x: the place on the surface in mm, by `axis`; y: the slope v of the direction, v = tan theta (cos,
 *                 sin); s: the distance of the reflector above the surface in mm.
 */
#ifndef SELVEDGE_RENDERER_RAY_FIELD_H
#define SELVEDGE_RENDERER_RAY_FIELD_H

#include "base/status.h"

#include <stdbool.h>
#include <stddef.h>

enum ray_window {
    RAY_SQUARE,   /* all y count alike, and the filter makes up for places near the edge (ray_kernel.h) */
    RAY_GAUSSIAN, /* the weight falls with a standard deviation of half / 2, as published */
    RAY_ABOVE     /* directions above a matte surface: y = v in [-5, 5]^2, weight 1 / (1 + v^2)^2 */
};

enum { RAY_MAX_SIDE = 8, RAY_MAX_CHANNEL = 3, RAY_MAX_EDGE = 4096 };

/* Pixels to each side along the way of an axis that a filter reaches. */
enum { RAY_REACH = 16 };

struct ray_pixel {
    float x[2];       /* not of RAY_ABOVE */
    float axis[2][3]; /* of RAY_ABOVE: unit vectors in the surface, by which places of neighbours are told */
    float step[2][2]; /* [axis]: the way on the screen in pixels along which x of this axis alone changes; its longer
                         part is 1 */
    float cell[2];    /* change of x over that way, not 0 */
    float jitter[2];  /* the same place in [0, 1) within all strata */
    float slope[2];   /* least and greatest; both 0: no ray has met anything, or all lie in one plane in focus */
    float place_mm[3];
    float normal[3]; /* unit; 0: the receiver takes any neighbour */
    float depth_mm;  /* neighbours lie at most so far from the plane through place_mm */
    bool used;       /* false: there is no receiver */
};

struct ray_field {
    size_t width, height;
    size_t n_side;    /* rays along an axis */
    size_t n_channel; /* 1 or 3 */
    enum ray_window window;
    float half;
    struct ray_pixel *pixel; /* [height][width] */
    float *value;            /* [height][width][n_side, second axis][n_side, first axis][n_channel]; 0 at first */
};

/* No receivers. STATUS_INVALID: no pixels, an edge above RAY_MAX_EDGE, rays or channels out of range; STATUS_NO_MEMORY.
 * Release in any case. */
status ray_field_init(struct ray_field *f, size_t width, size_t height, size_t n_side, size_t n_channel,
                      struct error *err);
void ray_field_release(struct ray_field *f);

/* y of ray i along an axis of a pixel. */
float ray_field_y(const struct ray_field *f, const struct ray_pixel *p, int axis, size_t i);
/* Weight of a ray besides the window, 1 but for RAY_ABOVE: the share of its directions in the light of a matte surface,
 * with the density of ray_field_y taken out. */
float ray_field_weight(const struct ray_field *f, const struct ray_pixel *p, size_t i_first, size_t i_second);
/* Values of ray (i_first, i_second) of a pixel. */
float *ray_field_value(const struct ray_field *f, size_t i_pixel, size_t i_first, size_t i_second);
/* x of a pixel q over x of p along an axis. */
static inline float ray_field_offset(const struct ray_field *f, const struct ray_pixel *p, const struct ray_pixel *q,
                                     int axis)
{
    if (f->window != RAY_ABOVE) return q->x[axis] - p->x[axis];
    float sum = 0;
    for (int a = 0; a < 3; a++) sum += p->axis[axis][a] * (q->place_mm[a] - p->place_mm[a]);
    return sum;
}
/* Counts a slope, which is not 0. */
void ray_pixel_meet(struct ray_pixel *p, float slope);
/* Replaces slopes by their means over the 5 x 5 pixels around that have met anything, but not of receivers that
 * ray_pixel_near refuses: pixels near a shadow get the slopes of the occluder that casts it. Of RAY_ABOVE they go on to
 * pixels that have met nothing, as far as a filter reaches. STATUS_NO_MEMORY. */
status ray_field_smooth_slopes(struct ray_field *f, struct error *err);
/* Whether q is a neighbour of p on the same smooth surface: near its plane, and at most 20 degrees from its normal
 * (section 5.5). */
bool ray_pixel_near(const struct ray_pixel *p, const struct ray_pixel *q);

#endif
