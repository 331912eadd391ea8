#include "renderer/transport/camera.h"

#include <math.h>

void camera_init(struct camera *m, const struct configuration *c)
{
    double theta = c->camera_theta_rad, phi = c->camera_phi_rad - c->cloth_rotation_rad;
    double crop = 1e3 * c->crop_m, aspect = c->crop_aspect > 0 ? c->crop_aspect : 1;
    m->blur[0] = c->blur_m / c->crop_m;
    m->blur[1] = m->blur[0] * aspect;
    m->far_field = c->camera == CAMERA_FAR_FIELD;
    /* far-field: any, as long as all of the crop's rays start above the cloth */
    double distance = m->far_field ? 1e3 + 0.5 * crop / aspect * tan(theta) : 1e3 * c->camera_distance_m;
    double back[3] = {sin(theta) * cos(phi), sin(theta) * sin(phi), cos(theta)};
    double up[3] = {-cos(theta) * cos(phi), -cos(theta) * sin(phi), sin(theta)};
    double right[3] = {up[1] * back[2] - up[2] * back[1], up[2] * back[0] - up[0] * back[2],
                       up[0] * back[1] - up[1] * back[0]};
    for (int a = 0; a < 3; a++) {
        m->eye_mm[a] = distance * back[a];
        m->right_mm[a] = crop * right[a];
        m->up_mm[a] = crop / aspect * up[a];
    }
}

void camera_blur(const struct camera *m, const double xy[2], struct rng *rng, double blurred[2])
{
    double normal[2] = {0.0, 0.0};
    if (m->blur[0] > 0.0) rng_normal_pair(rng, normal);
    for (int a = 0; a < 2; a++) blurred[a] = xy[a] + m->blur[a] * normal[a];
}

void camera_direction(const struct camera *m, const double xy[2], double d[3])
{
    double length2 = 0, x = m->far_field ? 0.5 : xy[0], y = m->far_field ? 0.5 : xy[1];
    for (int a = 0; a < 3; a++) {
        d[a] = (x - 0.5) * m->right_mm[a] + (0.5 - y) * m->up_mm[a] - m->eye_mm[a];
        length2 += d[a] * d[a];
    }
    double inv = 1 / sqrt(length2);
    for (int a = 0; a < 3; a++) d[a] *= inv;
}

void camera_origin(const struct camera *m, const double xy[2], double origin_mm[3])
{
    for (int a = 0; a < 3; a++)
        origin_mm[a] = m->eye_mm[a] + (m->far_field ? (xy[0] - 0.5) * m->right_mm[a] + (0.5 - xy[1]) * m->up_mm[a] : 0);
}

bool camera_ray(const struct camera *m, const struct scene *scene, const double xy[2], struct scene_ray *ray)
{
    double d[3], origin[3];
    camera_direction(m, xy, d);
    camera_origin(m, xy, origin);
    return scene_ray_enter(scene, origin, d, ray);
}
