#include "renderer/transport/lamp.h"

#include <math.h>

#define DIRECTIONAL_PER_SR 0x1p60f

static float dot(const float a[3], const float b[3]) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

void lamp_init(struct lamp *l, const struct configuration *c)
{
    double theta = c->light_theta_rad,
           phi = c->light_phi_rad - c->cloth_rotation_rad; /* turn lamp and camera, not the cloth */
    double d[3] = {sin(theta) * cos(phi), sin(theta) * sin(phi), cos(theta)};
    double horizontal[3] = {-sin(phi), cos(phi), 0};
    double other[3] = {d[1] * horizontal[2] - d[2] * horizontal[1], d[2] * horizontal[0] - d[0] * horizontal[2],
                       d[0] * horizontal[1] - d[1] * horizontal[0]};
    for (int a = 0; a < 3; a++) {
        l->centre_mm[a] = (float)(1e3 * c->light_distance_m * d[a]);
        l->normal[a] = (float)-d[a];
        l->edge[0][a] = (float)horizontal[a];
        l->edge[1][a] = (float)other[a];
    }
    l->directional = c->light == LIGHT_DIRECTIONAL;
    l->distant = l->directional || c->light == LIGHT_GAUSSIAN;
    l->sharpness = c->light == LIGHT_GAUSSIAN ? (float)c->light_sharpness : 0;
    l->half_side_mm = 0;
    if (l->directional) {
        l->radiance = (float)M_PI * DIRECTIONAL_PER_SR;
        return;
    }
    if (c->light == LIGHT_GAUSSIAN) { /* pi over the irradiance of exp(k (cos - 1)) on a surface that faces it */
        double k = c->light_sharpness;
        l->radiance = (float)(M_PI / (2 * M_PI * (1 / k + expm1(-k) / (k * k))));
        return;
    }
    l->half_side_mm = (float)(500 * c->lamp_side_m);
    /* irradiance at the orbit centre per radiance, in closed form: a square seen from its axis */
    double x = 0.5 * c->lamp_side_m / c->light_distance_m, y = x / sqrt(1 + x * x);
    l->radiance = (float)(M_PI / (4 * y * atan(y)));
}

float lamp_gaussian_light(const struct lamp *l)
{
    return l->radiance * (float)(-2 * M_PI * expm1(-2.0 * (double)l->sharpness)) / l->sharpness;
}

/* von Mises-Fisher. */
static void sample_gaussian(const struct lamp *l, const float u[2], float direction[3])
{
    float off = -log1pf(u[0] * expm1f(-2 * l->sharpness)) / l->sharpness; /* 1 - cos */
    off = fminf(fmaxf(off, 0), 2);
    float sine = sqrtf(off * (2 - off)), x = sine * cosf((float)(2 * M_PI) * u[1]),
          y = sine * sinf((float)(2 * M_PI) * u[1]);
    for (int a = 0; a < 3; a++) direction[a] = (off - 1) * l->normal[a] + x * l->edge[0][a] + y * l->edge[1][a];
    float inv = 1 / sqrtf(dot(direction, direction));
    for (int a = 0; a < 3; a++) direction[a] *= inv;
}

bool lamp_sample(const struct lamp *l, const float position_mm[3], const float u[2], float direction[3],
                 float *pdf_per_sr)
{
    if (l->directional) {
        for (int a = 0; a < 3; a++) direction[a] = -l->normal[a];
        *pdf_per_sr = DIRECTIONAL_PER_SR;
        return true;
    }
    if (l->sharpness > 0) {
        sample_gaussian(l, u, direction);
        *pdf_per_sr = lamp_pdf(l, position_mm, direction);
        return *pdf_per_sr > 0;
    }
    float x = (2 * u[0] - 1) * l->half_side_mm, y = (2 * u[1] - 1) * l->half_side_mm, to[3];
    for (int a = 0; a < 3; a++) to[a] = l->centre_mm[a] + x * l->edge[0][a] + y * l->edge[1][a] - position_mm[a];
    float r2 = dot(to, to), r = sqrtf(r2), cos_r = -dot(to, l->normal);
    if (!(cos_r > 0)) return false;
    for (int a = 0; a < 3; a++) direction[a] = to[a] / r;
    *pdf_per_sr = r2 * r / (cos_r * 4 * l->half_side_mm * l->half_side_mm);
    return true;
}

float lamp_pdf(const struct lamp *l, const float position_mm[3], const float direction[3])
{
    float to[3], cos_l = -dot(direction, l->normal);
    if (l->sharpness > 0) return lamp_radiance(l, direction) / lamp_gaussian_light(l);
    if (!(cos_l > 0) || l->directional) return 0;
    for (int a = 0; a < 3; a++) to[a] = l->centre_mm[a] - position_mm[a];
    float t = -dot(to, l->normal) / cos_l;
    if (!(t > 0)) return 0;
    for (int a = 0; a < 3; a++) to[a] -= t * direction[a];
    if (fabsf(dot(to, l->edge[0])) > l->half_side_mm || fabsf(dot(to, l->edge[1])) > l->half_side_mm) return 0;
    return t * t / (cos_l * 4 * l->half_side_mm * l->half_side_mm);
}
