/* Density from which the directions of guided shadow paths are drawn, around the direction to a lamp. Fibers that lie
 * there send most of the lamp's light on to the point, because fibers scatter mainly forward.
 *
 *     p(w) = kappa / (2 pi) exp(kappa (w . d - 1)),   d towards the lamp's centre
 *
 * (von Mises-Fisher; 1 - exp(-2 kappa) is taken as 1). kappa = 20 is a width of 13 degrees, like usual TT lobes. kappa
 * = 10 or 40 takes up to 10 % more time to the same error. */
#ifndef SELVEDGE_RENDERER_LIGHT_GUIDE_H
#define SELVEDGE_RENDERER_LIGHT_GUIDE_H

#include "renderer/scattering/scattering.h"
#include "renderer/scene/fiber_frame.h"
#include "renderer/transport/lamp.h"

#define LIGHT_GUIDE_KAPPA 20.0f

/* Share of the light that a fiber scatters, per channel, when light arrives at right angles to it: `forward`, within 35
 * degrees of the direction of the light; `all`, in all directions. Their ratio sets how often guided paths are traced.
 */
struct light_guide_energy {
    float forward[3], all[3];
};

void light_guide_energy_of(const struct scattering_model *m, const struct scattering_state *s,
                           struct light_guide_energy *e);

/* Unit direction from position_mm (unwrapped) to the lamp's centre. */
static inline void light_guide_towards(const struct lamp *lamp, const float position_mm[3], float towards[3])
{
    if (lamp->distant) {
        for (int a = 0; a < 3; a++) towards[a] = -lamp->normal[a];
        return;
    }
    for (int a = 0; a < 3; a++) towards[a] = lamp->centre_mm[a] - position_mm[a];
    float inv = 1 / sqrtf(fiber_frame_dot(towards, towards));
    for (int a = 0; a < 3; a++) towards[a] *= inv;
}

/* Density per steradian of a unit direction. */
static inline float light_guide_pdf(const float towards[3], const float direction[3])
{
    return LIGHT_GUIDE_KAPPA * (float)(0.5 / M_PI) *
           expf(LIGHT_GUIDE_KAPPA * (fiber_frame_dot(towards, direction) - 1));
}

/* u in [0, 1). */
static inline void light_guide_sample(const float towards[3], const float u[2], float direction[3])
{
    struct fiber_frame f;
    fiber_frame_from(&f, towards);
    float c = 1 + logf(1 - u[0]) / LIGHT_GUIDE_KAPPA, local[3];
    c = c > -1 ? c : -1; /* happens once in exp(2 kappa) samples */
    float s = sqrtf(1 - c * c), angle = (float)(2 * M_PI) * u[1];
    local[0] = c;
    local[1] = s * cosf(angle);
    local[2] = s * sinf(angle);
    fiber_frame_to_world(&f, local, direction);
}

#endif
