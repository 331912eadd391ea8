#include "renderer/preview/ground_plane.h"
#include "renderer/scene/scene_place.h"
#include "renderer/scene/scene_ray.h"

#include <math.h>

enum { ITERATION_OF_PIXELS = 65533, ITERATION_OF_GRID = 65532, REPLICA = 15 };

double ground_below(const struct scene *bent, double gap_mm) { return scene_lowest_mm(bent) - gap_mm; }

status ground_plane_init(struct ground_plane *g, const struct ground_request *q, struct error *err)
{
    *g = (struct ground_plane){.q = q};
    if (!scene_is_bent(q->scene) || q->n_sample < 2 || q->width == 0 || q->height == 0 || q->width > 65536 ||
        q->height > 65536)
        return error_set(err, STATUS_INVALID, "cannot render the ground under a cloth in %zu x %zu pixels of %zu rays",
                         q->width, q->height, q->n_sample);
    status s = configuration_check(q->configuration, 1, err);
    if (s != STATUS_OK) return s;
    camera_init(&g->camera, q->configuration);
    lamp_init(&g->lamp, q->configuration);
    if (q->configuration->light == LIGHT_NO_LAMP || !(g->lamp.normal[2] < 0) ||
        (!g->lamp.distant && !((double)g->lamp.centre_mm[2] > q->z_mm)) || !(g->camera.eye_mm[2] > q->z_mm))
        return error_set(err, STATUS_INVALID, "the ground under a cloth wants a lamp and a camera above it");
    return STATUS_OK;
}

bool ground_plane_meet(const struct ground_plane *g, const double xy[2], double p_mm[3])
{
    double d[3], o[3];
    camera_direction(&g->camera, xy, d);
    camera_origin(&g->camera, xy, o);
    double t = (g->q->z_mm - o[2]) / d[2];
    if (!(t > 0.0) || !isfinite(t)) return false;
    for (int a = 0; a < 3; a++) p_mm[a] = o[a] + t * d[a];
    return p_mm[0] * p_mm[0] + p_mm[1] * p_mm[1] < g->q->radius_mm * g->q->radius_mm;
}

bool ground_plane_seen(const struct ground_plane *g, const double xy[2], double p_mm[3])
{
    struct scene_ray ray;
    return ground_plane_meet(g, xy, p_mm) &&
           !(camera_ray(&g->camera, g->q->scene, xy, &ray) && scene_occluded(g->q->scene, &ray));
}

float ground_plane_lit(const struct ground_plane *g, const double p_mm[3], const float u[2], float direction[3])
{
    const float position[3] = {(float)p_mm[0], (float)p_mm[1], (float)p_mm[2]}, pi = 3.14159265f;
    float pdf;
    if (!lamp_sample(&g->lamp, position, u, direction, &pdf) || !(direction[2] > 0)) return 0;
    return lamp_radiance(&g->lamp, direction) * (float)g->q->albedo / pi * direction[2] / pdf;
}

void ground_plane_random(const struct ground_plane *g, size_t i_pixel, bool of_grid, struct rng *rng)
{
    const struct rng_key key = {g->q->seed, of_grid ? ITERATION_OF_GRID : ITERATION_OF_PIXELS, REPLICA, g->q->stream};
    rng_start(rng, &key, (uint32_t)i_pixel, 0);
}
