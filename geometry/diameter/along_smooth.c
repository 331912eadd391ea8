#include "geometry/diameter/along_smooth.h"

#include "geometry/orientation/structure_tensor.h"
#include "geometry/volume/noise_smoothing.h"

#include <math.h>
#include <string.h>

enum { CELL = 2, REACH = 4 }; /* voxels with one direction, along each axis; voxels to each side along the fiber */
/* Standard deviations: of the blur before the gradient, of the tensor's window, and of the mean along the fiber. With 4
 * in place of 2 along the fiber, errors of the direction blur the walls of bent fibers (geometry/NOTES.md). */
static const double GRADIENT_SD = 0.8, WINDOW_SD = 2.5, ALONG_SD = 2.0;
static const float VOID_DENSITY = 0.1f; /* cells without more are only blurred */

struct along {
    const struct volume *v;
    struct volume blurred;
    struct tensor_window window;
    float weight[2 * REACH + 1]; /* of the mean along the fiber */
    float unit;
    uint8_t *smooth;
};

/* Density at p in voxels, linear between their centers and constant beyond the outer ones. */
static float density_at(const struct volume *v, const float p[3])
{
    const size_t sy = v->n[0], sz = v->n[0] * v->n[1];
    size_t i[3];
    float f[3];
    for (int a = 0; a < 3; a++) {
        const float last = (float)(v->n[a] - 1), q = p[a] < 0.0f ? 0.0f : p[a] > last ? last : p[a];
        i[a] = (size_t)q;
        if (i[a] + 2 > v->n[a]) i[a] = v->n[a] - 2;
        f[a] = q - (float)i[a];
    }
    const float *d = v->density + volume_index(v->n, i[0], i[1], i[2]);
    float row[4];
    for (int r = 0; r < 4; r++) {
        const float *from = d + (r & 1 ? sy : 0) + (r & 2 ? sz : 0);
        row[r] = from[0] + f[0] * (from[1] - from[0]);
    }
    const float near = row[0] + f[1] * (row[1] - row[0]), far = row[2] + f[1] * (row[3] - row[2]);
    return near + f[2] * (far - near);
}

static uint8_t mean_along(const struct along *s, const size_t x[3], const float direction[3])
{
    float sum = 0.0f;
    for (int m = -REACH; m <= REACH; m++) {
        float p[3];
        for (int a = 0; a < 3; a++) p[a] = (float)x[a] + (float)m * direction[a];
        sum += s->weight[m + REACH] * density_at(s->v, p);
    }
    return (uint8_t)(s->unit * sum + 0.5f);
}

static void smooth_cell(const struct along *s, const size_t from[3], const size_t to[3])
{
    size_t x[3];
    float direction[3] = {0.0f}, most = 0.0f;
    for (x[2] = from[2]; x[2] < to[2]; x[2]++)
        for (x[1] = from[1]; x[1] < to[1]; x[1]++)
            for (x[0] = from[0]; x[0] < to[0]; x[0]++)
                most = fmaxf(most, s->blurred.density[volume_index(s->v->n, x[0], x[1], x[2])]);
    if (most > VOID_DENSITY) structure_tensor_direction(&s->blurred, &s->window, from[0], from[1], from[2], direction);
    for (x[2] = from[2]; x[2] < to[2]; x[2]++)
        for (x[1] = from[1]; x[1] < to[1]; x[1]++)
            for (x[0] = from[0]; x[0] < to[0]; x[0]++) {
                const size_t at = volume_index(s->v->n, x[0], x[1], x[2]);
                s->smooth[at] = most > VOID_DENSITY ? mean_along(s, x, direction)
                                                    : (uint8_t)(s->unit * s->blurred.density[at] + 0.5f);
            }
}

/* Smooths the slices of one layer of cells. */
static void smooth_layer(void *context, size_t i_layer, size_t i_thread)
{
    const struct along *s = context;
    const size_t *n = s->v->n;
    size_t from[3] = {0, 0, CELL * i_layer}, to[3];
    (void)i_thread;
    scratch_keep_within(s->v->space);
    for (; from[1] < n[1]; from[1] += CELL)
        for (from[0] = 0; from[0] < n[0]; from[0] += CELL) {
            for (int a = 0; a < 3; a++) to[a] = from[a] + CELL < n[a] ? from[a] + CELL : n[a];
            smooth_cell(s, from, to);
        }
}

status density_smooth_along(const struct volume *v, struct thread_pool *pool, int unit, uint8_t *smooth,
                            struct error *err)
{
    struct along s = {.v = v, .unit = (float)unit, .smooth = smooth};
    const size_t n_slice = v->n[0] * v->n[1];
    double sum = 0.0;
    status st = volume_init_in(&s.blurred, v->n, v->voxel_size_m, v->space, err);
    if (st != STATUS_OK) return st;
    for (size_t k = 0; k < v->n[2]; k++) {
        memcpy(s.blurred.density + k * n_slice, v->density + k * n_slice, n_slice * sizeof *v->density);
        scratch_keep_within(v->space);
    }
    st = volume_smooth_noise(&s.blurred, GRADIENT_SD, pool, err);
    tensor_window_init(&s.window, WINDOW_SD);
    for (int m = -REACH; m <= REACH; m++) sum += exp(-0.5 * m * m / (ALONG_SD * ALONG_SD));
    for (int m = -REACH; m <= REACH; m++)
        s.weight[m + REACH] = (float)(exp(-0.5 * m * m / (ALONG_SD * ALONG_SD)) / sum);
    if (st == STATUS_OK && v->n[0] > 1 && v->n[1] > 1 && v->n[2] > 1) {
        st = thread_pool_run(pool, (v->n[2] + CELL - 1) / CELL, smooth_layer, &s, NULL);
        if (st != STATUS_OK) error_set(err, st, "smoothing the scan along its fibers was cancelled");
    } else if (st == STATUS_OK)
        for (size_t i = 0; i < v->n[2] * n_slice; i++) smooth[i] = (uint8_t)(s.unit * s.blurred.density[i] + 0.5f);
    volume_release(&s.blurred);
    return st;
}
