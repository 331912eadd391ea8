/* The plane of ground_shadow.h and its rays, for the files of this folder. */
#ifndef SELVEDGE_RENDERER_GROUND_PLANE_H
#define SELVEDGE_RENDERER_GROUND_PLANE_H

#include "base/rng.h"
#include "renderer/preview/ground_request.h"
#include "renderer/transport/camera.h"
#include "renderer/transport/lamp.h"

struct ground_plane {
    const struct ground_request *q;
    struct camera camera;
    struct lamp lamp;
};

/* STATUS_INVALID: a scene that is flat, no pixels or rays, a lamp or a camera below the plane. */
status ground_plane_init(struct ground_plane *g, const struct ground_request *q, struct error *err);
/* Where the ray through a point of the picture meets the plane. */
bool ground_plane_meet(const struct ground_plane *g, const double xy[2], double p_mm[3]);
/* The same, but false where the cloth hides it. */
bool ground_plane_seen(const struct ground_plane *g, const double xy[2], double p_mm[3]);
/* Radiance of a place that sees the point u of the lamp, over the density of lamp_sample, and the direction to it. 0:
 * behind the lamp. */
float ground_plane_lit(const struct ground_plane *g, const double p_mm[3], const float u[2], float direction[3]);
/* Random numbers of a pixel that nothing else uses. */
void ground_plane_random(const struct ground_plane *g, size_t i_pixel, bool of_grid, struct rng *rng);

#endif
