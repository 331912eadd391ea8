/* A direction in the fiber frame, taken apart: longitudinal angle and azimuth as a unit vector. */
#ifndef SELVEDGE_RENDERER_FIBER_DIRECTION_H
#define SELVEDGE_RENDERER_FIBER_DIRECTION_H

#include <math.h>

#define FIBER_COS_MIN 1e-6f /* densities divide by cos th; below this they stop growing */

struct fiber_direction {
    float theta_rad, cos_theta;
    float azimuth[2]; /* (cos ph, sin ph); (1, 0) along the fiber */
};

/* Angle of (cos >= 0, sin), a unit vector: 2 atan(sin / (1 + cos)), whose argument stays within [-1, 1] where a
 * polynomial in its square (Chebyshev fit of atan(x) / x) is exact to 2e-8. A quarter of the time of atan2f, and no
 * branches. */
static inline float fiber_angle(float sin_theta, float cos_theta)
{
    float x = sin_theta / (1 + cos_theta), u = x * x;
    float p = 0.002834064292f;
    p = -0.01600503048f + p * u;
    p = 0.04258760742f + p * u;
    p = -0.0749544544f + p * u;
    p = 0.106367541f + p * u;
    p = -0.1420257051f + p * u;
    p = 0.1999248358f + p * u;
    p = -0.3333306678f + p * u;
    p = 0.9999999842f + p * u;
    return 2 * x * p;
}

static inline struct fiber_direction fiber_direction_of(const float w[3])
{
    struct fiber_direction d;
    d.cos_theta = sqrtf(w[1] * w[1] + w[2] * w[2]);
    d.theta_rad = fiber_angle(w[0], d.cos_theta);
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

/* A direction from its longitudinal angle and the cosine and sine of its azimuth less the azimuth of w. */
static inline void fiber_direction_beyond(const struct fiber_direction *w, float sin_theta, float cos_theta, float c,
                                          float d, float beyond[3])
{
    beyond[0] = sin_theta;
    beyond[1] = cos_theta * (c * w->azimuth[0] - d * w->azimuth[1]);
    beyond[2] = cos_theta * (d * w->azimuth[0] + c * w->azimuth[1]);
}

/* 1 - cos(ph_a - ph_b - pi), without cancellation where the two are opposite. */
static inline float fiber_one_minus_cos_opposite(const struct fiber_direction *a, const struct fiber_direction *b)
{
    float x = a->azimuth[0] + b->azimuth[0], y = a->azimuth[1] + b->azimuth[1];
    return 0.5f * (x * x + y * y);
}

#endif
