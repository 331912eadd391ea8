#include "renderer/transport/camera.h"

#include <math.h>

void camera_init(struct camera *m, const struct configuration *c)
{
    double theta = c->camera_theta_rad, phi = c->camera_phi_rad - c->cloth_rotation_rad;
    double crop = 1e3 * c->crop_m, aspect = c->crop_aspect > 0 ? c->crop_aspect : 1;
    m->blur[0] = c->blur_m / c->crop_m;
    m->blur[1] = m->blur[0] * aspect;
    m->far_field = c->camera == CAMERA_FAR_FIELD;
    m->lens_mm = m->far_field ? 0.0 : 500.0 * c->aperture_m;
    const double out_of_focus = c->focus_m > 0.0 ? 1.0 - c->camera_distance_m / c->focus_m : 0.0;
    m->lens_move[0] = m->lens_mm * out_of_focus / crop;
    m->lens_move[1] = m->lens_move[0] * aspect;
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

void camera_at_lens(const struct camera *m, const double at[2], struct camera *pinhole, double xy[2])
{
    const double *edge[2] = {m->right_mm, m->up_mm};
    *pinhole = *m;
    for (int k = 0; k < 2; k++) {
        double length2 = 0.0;
        for (int a = 0; a < 3; a++) length2 += edge[k][a] * edge[k][a];
        for (int a = 0; a < 3; a++) pinhole->eye_mm[a] += at[k] * m->lens_mm * edge[k][a] / sqrt(length2);
    }
    xy[0] += at[0] * m->lens_move[0];
    xy[1] -= at[1] * m->lens_move[1];
}

const struct camera *camera_through_lens(const struct camera *m, struct rng *rng, struct camera *pinhole, double xy[2])
{
    if (!(m->lens_mm > 0.0)) return m;
    const double radius = sqrt(rng_double(rng)), angle = 2.0 * M_PI * rng_double(rng);
    camera_at_lens(m, (const double[2]){radius * cos(angle), radius * sin(angle)}, pinhole, xy);
    return pinhole;
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
