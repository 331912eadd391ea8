/* The fiber frame in the frame of the cloth, and the dot product that goes with it. */
#ifndef SELVEDGE_RENDERER_FIBER_FRAME_H
#define SELVEDGE_RENDERER_FIBER_FRAME_H

#include <math.h>
#include <string.h>

/* u along the fiber; v and w are any two directions perpendicular to it (Duff et al. 2017, "Building an orthonormal
 * basis, revisited"). */
struct fiber_frame {
    float u[3], v[3], w[3];
};

static inline void fiber_frame_from(struct fiber_frame *f, const float u[3])
{
    float sign = copysignf(1, u[2]), a = -1 / (sign + u[2]), b = u[0] * u[1] * a;
    memcpy(f->u, u, sizeof f->u);
    f->v[0] = 1 + sign * u[0] * u[0] * a;
    f->v[1] = sign * b;
    f->v[2] = -sign * u[0];
    f->w[0] = b;
    f->w[1] = sign + u[1] * u[1] * a;
    f->w[2] = -u[1];
}

/* u along the fiber, of either sign; v the direction across the fiber that is nearest to the cloth's normal: the normal
 * of a section that lies flat in the cloth. Of a fiber along that normal, v is along x. */
static inline void fiber_frame_flat(struct fiber_frame *f, const float u[3])
{
    float level = sqrtf(u[0] * u[0] + u[1] * u[1]), inv = level > 1e-6f ? 1 / level : 0;
    memcpy(f->u, u, sizeof f->u);
    f->v[0] = inv > 0 ? -u[2] * u[0] * inv : 1;
    f->v[1] = -u[2] * u[1] * inv;
    f->v[2] = level;
    f->w[0] = u[1] * f->v[2] - u[2] * f->v[1];
    f->w[1] = u[2] * f->v[0] - u[0] * f->v[2];
    f->w[2] = u[0] * f->v[1] - u[1] * f->v[0];
}

static inline float fiber_frame_dot(const float a[3], const float b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* The same in a bent cloth, whose unit normal is given. Of a fiber along it, v is any direction across the fiber. */
static inline void fiber_frame_flat_in(struct fiber_frame *f, const float u[3], const float normal[3])
{
    float along = fiber_frame_dot(u, normal), level2 = 0, v[3];
    for (int a = 0; a < 3; a++) {
        v[a] = normal[a] - along * u[a];
        level2 += v[a] * v[a];
    }
    if (!(level2 > 1e-8f)) {
        fiber_frame_from(f, u);
        return;
    }
    float inv = 1 / sqrtf(level2);
    memcpy(f->u, u, sizeof f->u);
    for (int a = 0; a < 3; a++) f->v[a] = inv * v[a];
    f->w[0] = u[1] * f->v[2] - u[2] * f->v[1];
    f->w[1] = u[2] * f->v[0] - u[0] * f->v[2];
    f->w[2] = u[0] * f->v[1] - u[1] * f->v[0];
}

static inline void fiber_frame_to_local(const struct fiber_frame *f, const float d[3], float out[3])
{
    out[0] = fiber_frame_dot(f->u, d);
    out[1] = fiber_frame_dot(f->v, d);
    out[2] = fiber_frame_dot(f->w, d);
}

static inline void fiber_frame_to_world(const struct fiber_frame *f, const float d[3], float out[3])
{
    for (int a = 0; a < 3; a++) out[a] = d[0] * f->u[a] + d[1] * f->v[a] + d[2] * f->w[a];
    float inv = 1 / sqrtf(fiber_frame_dot(out, out));
    for (int a = 0; a < 3; a++) out[a] *= inv;
}

static inline float fiber_frame_cos_theta(const float local[3])
{
    return sqrtf(local[1] * local[1] + local[2] * local[2]);
}

#endif
