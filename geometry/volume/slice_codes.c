#include "geometry/volume/slice_codes.h"

#include <math.h>

uint8_t slice_direction_code(const float d[3])
{
    const float steps = (float)SLICE_DIRECTION_STEPS, length2 = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
    const float exact[3] = {steps * d[0] * d[0] / length2, steps * d[1] * d[1] / length2,
                            steps * d[2] * d[2] / length2};
    long part[3], sum = 0;
    for (int a = 0; a < 3; a++) sum += part[a] = lrintf(exact[a]);
    while (sum != SLICE_DIRECTION_STEPS) { /* the part that was rounded the farthest takes the remainder */
        long by = sum < SLICE_DIRECTION_STEPS ? 1 : -1;
        int worst = 0;
        for (int a = 1; a < 3; a++)
            if ((float)by * (exact[a] - (float)part[a]) > (float)by * (exact[worst] - (float)part[worst])) worst = a;
        part[worst] += by;
        sum += by;
    }
    return (uint8_t)(1 + part[0] * (SLICE_DIRECTION_STEPS + 1) - part[0] * (part[0] - 1) / 2 + part[1]);
}

struct code_job {
    const struct volume *v;
    const struct direction_volume *d;
    struct slice_codes *to;
};

/* The voxels of the scan that voxel i of the codes stands for along one axis. */
static void span(const struct code_job *j, int axis, size_t i, size_t *from, size_t *to)
{
    *from = i * j->to->factor;
    *to = *from + j->to->factor < j->v->n[axis] ? *from + j->to->factor : j->v->n[axis];
}

static void code_voxel(const struct code_job *j, const size_t at[3], size_t i_to)
{
    size_t from[3], to[3], n = 0, densest = 0;
    float sum = 0.0f, most = -1.0f;
    for (int a = 0; a < 3; a++) span(j, a, at[a], &from[a], &to[a]);
    for (size_t z = from[2]; z < to[2]; z++)
        for (size_t y = from[1]; y < to[1]; y++)
            for (size_t x = from[0]; x < to[0]; x++, n++) {
                size_t i = volume_index(j->v->n, x, y, z);
                float density = fminf(1.0f, fmaxf(0.0f, j->v->density[i]));
                sum += density;
                if (j->d->density[i] == 0 || density <= most) continue;
                most = density;
                densest = i;
            }
    j->to->density[i_to] = (uint8_t)lrintf((float)SLICE_DENSITY_STEPS * sum / (float)n);
    if (most < 0.0f) return;
    float d[3];
    direction_volume_get(j->d, densest, d);
    j->to->direction[i_to] = slice_direction_code(d);
}

static void code_layer(void *context, size_t i_task, size_t i_thread)
{
    const struct code_job *j = context;
    (void)i_thread;
    scratch_keep_within(j->v->space);
    for (size_t y = 0; y < j->to->n[1]; y++)
        for (size_t x = 0; x < j->to->n[0]; x++)
            code_voxel(j, (const size_t[3]){x, y, i_task}, volume_index(j->to->n, x, y, i_task));
}

status slice_codes_make(const struct volume *v, const struct direction_volume *d, size_t most_voxel,
                        struct thread_pool *pool, const struct progress *progress, struct slice_codes *codes,
                        struct error *err)
{
    *codes = (struct slice_codes){.factor = 1, .space = v->space};
    for (int a = 0; a < 3; a++)
        if (v->n[a] != d->n[a])
            return error_set(err, STATUS_INVALID, "cannot code the slices: densities and directions differ in size");
    for (;; codes->factor *= 2) {
        for (int a = 0; a < 3; a++) {
            codes->n[a] = (v->n[a] + codes->factor - 1) / codes->factor;
            codes->voxel_size_m[a] = v->voxel_size_m[a] * (double)codes->factor;
        }
        if (volume_n_voxel(codes->n) <= most_voxel) break;
    }
    size_t n = volume_n_voxel(codes->n);
    void *density = NULL, *direction = NULL;
    status s = scratch_new(v->space, n, "the densities of slices", &density, err);
    if (s == STATUS_OK) s = scratch_new(v->space, n, "the directions of slices", &direction, err);
    codes->density = density;
    codes->direction = direction;
    if (s != STATUS_OK) return s;
    struct code_job job = {v, d, codes};
    s = thread_pool_run(pool, codes->n[2], code_layer, &job, progress);
    return s == STATUS_OK ? s : error_set(err, s, "coding the slices was cancelled");
}

void slice_codes_release(struct slice_codes *codes)
{
    scratch_release(codes->space, codes->density);
    scratch_release(codes->space, codes->direction);
    *codes = (struct slice_codes){0};
}

void slice_codes_halve(const uint8_t *density, const uint8_t *direction, size_t width, size_t height,
                       uint8_t *to_density, uint8_t *to_direction)
{
    for (size_t y = 0; y < height; y += 2)
        for (size_t x = 0; x < width; x += 2) {
            unsigned sum = 0, n = 0, most = 0;
            uint8_t code = 0;
            for (size_t v = y; v < y + 2 && v < height; v++)
                for (size_t u = x; u < x + 2 && u < width; u++, n++) {
                    size_t i = v * width + u;
                    sum += density[i];
                    if (direction[i] == 0 || (code != 0 && density[i] <= most)) continue;
                    most = density[i];
                    code = direction[i];
                }
            *to_density++ = (uint8_t)((2 * sum + n) / (2 * n));
            *to_direction++ = code;
        }
}
