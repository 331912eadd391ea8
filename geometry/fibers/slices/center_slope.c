#include "geometry/fibers/slices/center_slope.h"

/* Finds the voxel that holds point x. Returns false, with the nearest voxel, if x lies outside of the volume. */
static bool voxel_at(const size_t n[3], const float x[3], size_t at[3])
{
    bool inside = true;
    for (int a = 0; a < 3; a++) {
        inside = inside && x[a] >= 0.0f && x[a] < (float)n[a];
        at[a] = x[a] <= 0.0f ? 0 : x[a] >= (float)n[a] - 1.0f ? n[a] - 1 : (size_t)x[a];
    }
    return inside;
}

/* Finds the voxel at a point of the slice. Returns false if it is outside of the volume, or not a kept one of the
 * class. */
static bool class_voxel(const struct center_search *s, size_t i_slice, float u, float v, size_t *voxel)
{
    float x[3];
    size_t at[3];
    slice_frame_point(s->frame, u, v, (float)i_slice + 0.5f, x);
    if (!voxel_at(s->v->n, x, at)) return false;
    *voxel = volume_index(s->v->n, at[0], at[1], at[2]);
    return (s->sub->mask[*voxel] >> s->frame->index & 1) != 0 && s->sub->mask[*voxel] >= CLASS_KEPT;
}

bool center_has_voxel(const struct center_search *s, size_t i_slice, const struct center *c)
{
    float x[3];
    size_t at[3], voxel;
    slice_frame_point(s->frame, c->u, c->v, (float)i_slice + 0.5f, x);
    if (!voxel_at(s->v->n, x, at)) return false;
    if (class_voxel(s, i_slice, c->u, c->v, &voxel)) return true;
    for (int v = -1; v <= 1; v++)
        for (int u = -1; u <= 1; u++)
            if (class_voxel(s, i_slice, c->u + (float)u, c->v + (float)v, &voxel)) return true;
    return false;
}

bool center_find_slope(const struct center_search *s, size_t i_slice, struct center *c)
{
    const struct slice_frame *f = s->frame;
    float sum[3] = {0.0f, 0.0f, 0.0f}; /* along u, v, w */
    size_t voxel;
    for (int v = -1; v <= 1; v++)
        for (int u = -1; u <= 1; u++) {
            if (!class_voxel(s, i_slice, c->u + (float)u, c->v + (float)v, &voxel)) continue;
            float d[3], local[3] = {0.0f, 0.0f, 0.0f};
            direction_volume_get(s->d, voxel, d);
            for (int a = 0; a < 3; a++) {
                local[0] += d[a] * f->u[a];
                local[1] += d[a] * f->v[a];
                local[2] += d[a] * f->w[a];
            }
            float sign = local[2] < 0.0f ? -1.0f : 1.0f;
            for (int a = 0; a < 3; a++) sum[a] += sign * local[a];
        }
    if (!(sum[2] > 0.0f)) return false;
    c->slope_u = sum[0] / sum[2];
    c->slope_v = sum[1] / sum[2];
    return true;
}
