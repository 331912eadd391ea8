/* The camera of a configuration, in the frame of the (turned) cloth: perspective, crop of crop_m square at the orbit
 * centre perpendicular to the view. Up is the projection of the cloth normal, which for a view along the normal means:
 * away from phi.
 */
#ifndef SELVEDGE_RENDERER_CAMERA_H
#define SELVEDGE_RENDERER_CAMERA_H

#include "renderer/scene/configuration.h"
#include "renderer/scene/scene_ray.h"

struct camera {
    double eye_mm[3];
    double right_mm[3], up_mm[3]; /* full edges of the crop */
};

void camera_init(struct camera *camera, const struct configuration *c);
/* Ray through (x, y) of the crop, both in [0, 1], x to the right and y downwards, brought to the cloth's top plane.
 * False when it never meets the cloth. */
bool camera_ray(const struct camera *camera, const struct scene *scene, double x, double y, struct scene_ray *ray);

#endif
