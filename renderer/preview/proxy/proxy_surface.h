/* The smooth surface of a bent cloth as a camera and a lamp see it, for the files of this folder. Millimetres; the
 * orbit center is the origin. */
#ifndef SELVEDGE_RENDERER_PROXY_SURFACE_H
#define SELVEDGE_RENDERER_PROXY_SURFACE_H

#include "base/rng.h"
#include "renderer/preview/proxy/proxy_request.h"
#include "renderer/scene/scene_proxy.h"
#include "renderer/transport/camera.h"
#include "renderer/transport/lights.h"

struct proxy_surface {
    const struct proxy_request *q;
    struct camera camera;
    struct lights lights;
    double clear_mm;     /* rays leave the surface this far above it and meet nothing within it */
    double thickness_mm; /* of the cloth */
    double pixel_mm;     /* width of a pixel at the orbit center */
    double albedo[2][3]; /* share of the light on the upper and lower side that this side sends back */
    double through[3];   /* share of the light that a layer of the cloth lets through */
};

/* A place that a ray of the camera has met. */
struct proxy_place {
    struct scene_proxy_hit hit;
    double view[3];   /* unit, towards the camera */
    double facing[3]; /* unit normal on the side of the camera */
};

/* STATUS_INVALID: a scene that is flat, a request without pixels or rays, what configuration_check refuses. */
status proxy_surface_init(struct proxy_surface *s, const struct proxy_request *q, struct error *err);
/* Where the ray of a camera through a point of the picture meets the surface. */
bool proxy_surface_see(const struct proxy_surface *s, const struct camera *camera, const double xy[2],
                       struct proxy_place *p);
/* Radiance towards the camera under the whole lamp, without shadows. */
void proxy_surface_direct(const struct proxy_surface *s, const struct proxy_place *p, double rgb[3]);
/* Start of a ray from a place towards a direction: through the cloth where the direction lies behind it. */
void proxy_surface_start(const struct proxy_surface *s, const struct scene_proxy_hit *hit, const double direction[3],
                         double start[3]);
/* Direction from a place to y of the lamp: along its edges in mm, or for a lamp at infinity as tangents. Returns the
 * distance to it along the lamp's normal; INFINITY at infinity; 0: behind the lamp. */
double proxy_surface_to_lamp(const struct proxy_surface *s, const double p_mm[3], const double y[2],
                             double direction[3]);
/* Irradiance of the whole lamp on a side of the surface with the given normal, without shadows, over pi. */
double proxy_surface_light(const struct proxy_surface *s, const double p_mm[3], const double normal[3]);
/* The pixel of a pinhole picture, in pixels; false: behind the camera. */
bool proxy_surface_pixel(const struct proxy_surface *s, const double p_mm[3], double pixel[2]);
/* Share of the light that comes through the layers of the cloth on a ray of unit direction from `start` on. Returns
 * whether there are any; *first: the nearest face. */
bool proxy_surface_layers(const struct proxy_surface *s, const double start[3], const double direction[3],
                          struct scene_proxy_hit *first, double share[3]);
/* Random numbers of a pixel for a purpose below 8. */
void proxy_surface_random(const struct proxy_surface *s, size_t i_pixel, unsigned purpose, struct rng *rng);

#endif
