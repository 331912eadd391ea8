#include "renderer/fast/gaussian_light.h"
#include "renderer/scene/fiber_frame.h"

#include <math.h>
#include <string.h>

#define SOFT_BELOW 100.0f  /* sums of Gaussians alone */
#define SHARP_ABOVE 200.0f /* signed distances alone */
#define LEAST_LIGHT 1e-6f  /* of a Gaussian of the sum beside its largest possible value */

/* A sum over the Gaussians of the segment's visibility, times the lamp. */
static void add_soft(const struct fast_tables *t, const struct gaussian_fiber *f, const struct fiber_frame *frame,
                     const float axis[3], float sharpness, float rgb[3])
{
    const float own = FAST_GAUSSIAN_SHARPNESS, mass = (float)(2 * M_PI) / own; /* of one Gaussian; its tail is 0 */
    const float part = (float)(2 * M_PI) / FAST_N_GAUSSIAN;                    /* of the sphere, of one axis */
    const uint8_t *open = t->gaussian + (size_t)t->segment_row[f->i_segment] * 2 * FAST_N_GAUSSIAN;
    float wo[3];
    fiber_frame_to_local(frame, f->wo, wo);
    for (size_t q = 0; q < 2 * FAST_N_GAUSSIAN; q++) {
        float point[3], both[3], local[3], scattered[3];
        if (open[q] == 0) continue;
        fast_tables_axis(f->i_segment, q, point);
        for (int a = 0; a < 3; a++) both[a] = own * point[a] + sharpness * axis[a];
        float length = sqrtf(fiber_frame_dot(both, both)), weight = expf(length - own - sharpness);
        if (weight < LEAST_LIGHT) continue;
        for (int a = 0; a < 3; a++) both[a] /= length;
        fiber_frame_to_local(frame, both, local);
        f->model->gaussian(f->state, local, length, wo, scattered);
        weight *= (float)open[q] / 255 * part / mass;
        for (int c = 0; c < 3; c++) rgb[c] += weight * scattered[c];
    }
}

/* Visibility softened by the width of the lamp, times its light without obstacles. */
static void add_sharp(const struct fast_tables *t, const struct gaussian_fiber *f, const struct fiber_frame *frame,
                      const float axis[3], float sharpness, float rgb[3])
{
    float local[3], wo[3], scattered[3];
    float distance = fast_tables_distance(t, t->segment_row[f->i_segment], axis);
    float open = 0.5f * (1 + erff(sqrtf(0.5f * sharpness) * distance));
    fiber_frame_to_local(frame, axis, local);
    fiber_frame_to_local(frame, f->wo, wo);
    f->model->gaussian(f->state, local, sharpness, wo, scattered);
    for (int c = 0; c < 3; c++) rgb[c] += open * scattered[c];
}

void gaussian_light_scatter(const struct fast_tables *t, const struct gaussian_fiber *f, const float axis[3],
                            float sharpness, float rgb[3])
{
    struct fiber_frame frame;
    float soft[3] = {0, 0, 0}, sharp[3] = {0, 0, 0};
    float share = fminf(fmaxf((sharpness - SOFT_BELOW) / (SHARP_ABOVE - SOFT_BELOW), 0), 1);
    memset(rgb, 0, 3 * sizeof *rgb);
    if (t->segment_row[f->i_segment] == FAST_NO_ROW) return;
    fiber_frame_from(&frame, f->tangent);
    if (share < 1) add_soft(t, f, &frame, axis, sharpness, soft);
    if (share > 0) add_sharp(t, f, &frame, axis, sharpness, sharp);
    for (int c = 0; c < 3; c++) rgb[c] = (1 - share) * soft[c] + share * sharp[c];
}
