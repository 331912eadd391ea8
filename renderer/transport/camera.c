#include "renderer/transport/camera.h"

#include <math.h>

void camera_init(struct camera *m, const struct configuration *c)
{
    double theta = c->camera_theta_rad, phi = c->camera_phi_rad - c->cloth_rotation_rad;
    double crop = 1e3 * c->crop_m, distance = 1e3 * c->camera_distance_m;
    double back[3] = {sin(theta) * cos(phi), sin(theta) * sin(phi), cos(theta)};
    double up[3] = {-cos(theta) * cos(phi), -cos(theta) * sin(phi), sin(theta)};
    double right[3] = {up[1] * back[2] - up[2] * back[1], up[2] * back[0] - up[0] * back[2],
                       up[0] * back[1] - up[1] * back[0]};
    for (int a = 0; a < 3; a++) {
        m->eye_mm[a] = distance * back[a];
        m->right_mm[a] = crop * right[a];
        m->up_mm[a] = crop * up[a];
    }
}

bool camera_ray(const struct camera *m, const struct scene *scene, double x, double y, struct scene_ray *ray)
{
    double d[3], length2 = 0;
    for (int a = 0; a < 3; a++) {
        d[a] = (x - 0.5) * m->right_mm[a] + (0.5 - y) * m->up_mm[a] - m->eye_mm[a];
        length2 += d[a] * d[a];
    }
    double inv = 1 / sqrt(length2);
    for (int a = 0; a < 3; a++) d[a] *= inv;
    return scene_ray_enter(scene, m->eye_mm, d, ray);
}
