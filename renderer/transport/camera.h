/* The camera of a configuration, in the frame of the (turned) cloth: perspective or far-field (orthographic). Its crop
 * is crop_m wide and crop_m / crop_aspect high, at the orbit centre and perpendicular to the view. Up is the projection
 * of the cloth normal; for a view along the normal, up points away from phi.
 */
#ifndef SELVEDGE_RENDERER_CAMERA_H
#define SELVEDGE_RENDERER_CAMERA_H

#include "base/rng.h"
#include "renderer/scene/configuration.h"
#include "renderer/scene/scene_ray.h"

#include <stdbool.h>

struct camera {
    double eye_mm[3];             /* far-field: the middle of the plane that the rays start from */
    double right_mm[3], up_mm[3]; /* full edges of the crop */
    double blur[2];               /* standard deviation of the point that a ray starts from, in units of xy; 0: sharp */
    double lens_mm;               /* radius of a thin lens across the view; 0: a pinhole */
    double lens_move[2]; /* how far the point xy moves for a ray from the right and the upper edge of the lens */
    bool far_field;
};

void camera_init(struct camera *camera, const struct configuration *c);
/* Where a path through the point xy of the picture meets the crop: a blurred camera adds a normal deviate to it, a
 * sharp one takes no random number. */
void camera_blur(const struct camera *camera, const double xy[2], struct rng *rng, double blurred[2]);
/* The pinhole camera at the place `at` of the lens, in the unit disc, and the point xy that its ray through the crop
 * meets: all rays of one point meet where the plane in focus is. */
void camera_at_lens(const struct camera *camera, const double at[2], struct camera *pinhole, double xy[2]);
/* The same at a random place. Returns `camera`, without a random number, where there is no lens, else `pinhole`. */
const struct camera *camera_through_lens(const struct camera *camera, struct rng *rng, struct camera *pinhole,
                                         double xy[2]);
/* xy: a point of the crop, both in [0, 1], x to the right and y downwards. Unit direction of the ray through it. */
void camera_direction(const struct camera *camera, const double xy[2], double direction[3]);
/* Where that ray starts: the eye, or for the far-field camera a point beside it. */
void camera_origin(const struct camera *camera, const double xy[2], double origin_mm[3]);
/* That ray, brought to the cloth's top plane. False when it never meets the cloth. */
bool camera_ray(const struct camera *camera, const struct scene *scene, const double xy[2], struct scene_ray *ray);

#endif
