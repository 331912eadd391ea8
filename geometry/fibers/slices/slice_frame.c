#include "geometry/fibers/slices/slice_frame.h"

#include <math.h>

/* Diagonals: axes p and q, w = (p + sign q) / sqrt 2. */
static const struct {
    int p, q;
    float sign;
} diagonal[6] = {{0, 2, 1.0f}, {0, 2, -1.0f}, {1, 2, 1.0f}, {1, 2, -1.0f}, {0, 1, 1.0f}, {0, 1, -1.0f}};

void slice_frame_normal(int index, float w[3])
{
    w[0] = w[1] = w[2] = 0.0f;
    if (index < 3) {
        w[index] = 1.0f;
        return;
    }
    w[diagonal[index - 3].p] = (float)M_SQRT1_2;
    w[diagonal[index - 3].q] = diagonal[index - 3].sign * (float)M_SQRT1_2;
}

void slice_frame_init(struct slice_frame *f, int index, const size_t n[3])
{
    *f = (struct slice_frame){.index = index};
    slice_frame_normal(index, f->w);
    if (index < 3) {
        f->u[slice_axis_u(index)] = f->v[slice_axis_v(index)] = 1.0f;
    } else { /* u in the plane of p and q, v the third axis */
        int p = diagonal[index - 3].p, q = diagonal[index - 3].q;
        f->u[p] = (float)M_SQRT1_2;
        f->u[q] = -diagonal[index - 3].sign * (float)M_SQRT1_2;
        f->v[3 - p - q] = 1.0f;
    }
    float extent[3] = {0.0f, 0.0f, 0.0f}; /* extent of the volume along u, v, w */
    for (int a = 0; a < 3; a++) {
        extent[0] += fabsf(f->u[a]) * (float)n[a];
        extent[1] += fabsf(f->v[a]) * (float)n[a];
        extent[2] += fabsf(f->w[a]) * (float)n[a];
    }
    f->width = (size_t)ceilf(extent[0] - 0.01f);
    f->height = (size_t)ceilf(extent[1] - 0.01f);
    f->n_slice = (size_t)ceilf(extent[2] - 0.01f);
    for (int a = 0; a < 3; a++)
        f->origin[a] =
            0.5f * ((float)n[a] - (float)f->width * f->u[a] - (float)f->height * f->v[a] - (float)f->n_slice * f->w[a]);
}
