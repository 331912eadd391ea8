/* A direction in the fiber frame, taken apart: longitudinal angle and azimuth as a unit vector. */
#ifndef SELVEDGE_RENDERER_FIBER_DIRECTION_H
#define SELVEDGE_RENDERER_FIBER_DIRECTION_H

#include <math.h>

#define FIBER_COS_MIN 1e-6f /* densities divide by cos th; below this they stop growing */

struct fiber_direction {
    float theta_rad, cos_theta;
    float azimuth[2]; /* (cos ph, sin ph); (1, 0) along the fiber */
};

static inline struct fiber_direction fiber_direction_of(const float w[3])
{
    struct fiber_direction d;
    d.cos_theta = sqrtf(w[1] * w[1] + w[2] * w[2]);
    d.theta_rad = atan2f(w[0], d.cos_theta);
    if (d.cos_theta > 1e-12f) {
        float inv = 1 / d.cos_theta;
        d.azimuth[0] = w[1] * inv;
        d.azimuth[1] = w[2] * inv;
    } else {
        d.azimuth[0] = 1;
        d.azimuth[1] = 0;
    }
    return d;
}

/* 1 - cos(ph_a - ph_b - pi), without cancellation where the two are opposite. */
static inline float fiber_one_minus_cos_opposite(const struct fiber_direction *a, const struct fiber_direction *b)
{
    float x = a->azimuth[0] + b->azimuth[0], y = a->azimuth[1] + b->azimuth[1];
    return 0.5f * (x * x + y * y);
}

#endif
