/* The camera of a configuration, in the frame of the (turned) cloth: perspective or far-field (orthographic), crop of
 * crop_m (by crop_m / crop_aspect) at the orbit centre perpendicular to the view. Up is the projection of the cloth normal, which for a view along the normal means:
 * away from phi.
 */
#ifndef SELVEDGE_RENDERER_CAMERA_H
#define SELVEDGE_RENDERER_CAMERA_H

#include "renderer/scene/configuration.h"
#include "renderer/scene/scene_ray.h"

#include <stdbool.h>

struct camera {
    double eye_mm[3];             /* far-field: the middle of the plane that the rays start from */
    double right_mm[3], up_mm[3]; /* full edges of the crop */
    bool far_field;
};

void camera_init(struct camera *camera, const struct configuration *c);
/* Unit direction from the eye through (x, y) of the crop, both in [0, 1], x to the right and y downwards. */
void camera_direction(const struct camera *camera, double x, double y, double direction[3]);
/* Where that ray starts: the eye, or for the far-field camera a point beside it. */
void camera_origin(const struct camera *camera, double x, double y, double origin_mm[3]);
/* Ray through (x, y) of the crop, both in [0, 1], x to the right and y downwards, brought to the cloth's top plane.
 * False when it never meets the cloth. */
bool camera_ray(const struct camera *camera, const struct scene *scene, double x, double y, struct scene_ray *ray);

#endif
