#include "geometry/orientation/structure_tensor.h"

#include "base/lanes.h"
#include "base/small_matrix.h"

#include <math.h>
#include <string.h>

void tensor_window_init(struct tensor_window *w, double sd_voxel)
{
    *w = (struct tensor_window){.reach = (int)ceil(2.0 * sd_voxel)};
    if (w->reach > TENSOR_MAX_REACH) w->reach = TENSOR_MAX_REACH;
    for (int i = -w->reach; i <= w->reach; i++)
        w->weight[i + w->reach] = (float)exp(-0.5 * i * i / (sd_voxel * sd_voxel));
}

static void add_scalar(const struct volume *v, size_t at, float weight, double sum[6])
{
    const float *p = v->density + at;
    size_t sy = v->n[0], sz = v->n[0] * v->n[1];
    float gx = p[1] - *(p - 1), gy = p[sy] - *(p - sy), gz = p[sz] - *(p - sz);
    sum[0] += (double)(weight * gx * gx);
    sum[1] += (double)(weight * gy * gy);
    sum[2] += (double)(weight * gz * gz);
    sum[3] += (double)(weight * gx * gy);
    sum[4] += (double)(weight * gx * gz);
    sum[5] += (double)(weight * gy * gz);
}

/* Adds n voxels of a row with weights w, which are padded with zeros to whole lanes. Reads up to LANES - 1 voxels
 * beyond. */
static void add_row(const struct volume *v, size_t at, const float *w, int n, float row_weight, lanes sum[6])
{
    size_t sy = v->n[0], sz = v->n[0] * v->n[1];
    for (int x = 0; x < n; x += LANES) {
        const float *p = v->density + at + x;
        lanes weight = *(const lanes *)(w + x) * row_weight;
        lanes gx = *(const lanes *)(p + 1) - *(const lanes *)(p - 1),
              gy = *(const lanes *)(p + sy) - *(const lanes *)(p - sy);
        lanes gz = *(const lanes *)(p + sz) - *(const lanes *)(p - sz), wx = weight * gx, wy = weight * gy;
        sum[0] += wx * gx;
        sum[1] += wy * gy;
        sum[2] += weight * gz * gz;
        sum[3] += wx * gy;
        sum[4] += wx * gz;
        sum[5] += wy * gz;
    }
}

static void collect_inner(const struct volume *v, const struct tensor_window *w, size_t i, size_t j, size_t k,
                          double sum[6])
{
    float padded[2 * TENSOR_MAX_REACH + 1 + LANES] = {0.0f};
    int r = w->reach, n = 2 * r + 1;
    lanes total[6] = {{0.0f}};
    memcpy(padded, w->weight, (size_t)n * sizeof *padded);
    for (int z = -r; z <= r; z++)
        for (int y = -r; y <= r; y++) {
            if (y * y + z * z > r * r) continue;
            size_t at = volume_index(v->n, i - (size_t)r, (size_t)((ptrdiff_t)j + y), (size_t)((ptrdiff_t)k + z));
            add_row(v, at, padded, n, w->weight[y + r] * w->weight[z + r], total);
        }
    for (int c = 0; c < 6; c++)
        for (int l = 0; l < LANES; l++) sum[c] += (double)total[c][l];
}

static void collect_border(const struct volume *v, const struct tensor_window *w, const size_t centre[3], double sum[6])
{
    int r = w->reach, o[3];
    for (o[2] = -r; o[2] <= r; o[2]++)
        for (o[1] = -r; o[1] <= r; o[1]++) {
            if (o[1] * o[1] + o[2] * o[2] > r * r) continue;
            for (o[0] = -r; o[0] <= r; o[0]++) {
                size_t x[3];
                int inside = 1;
                for (int a = 0; a < 3; a++) { /* the gradient needs a neighbour on both sides */
                    ptrdiff_t c = (ptrdiff_t)centre[a] + o[a];
                    inside = inside && c >= 1 && c + 1 < (ptrdiff_t)v->n[a];
                    x[a] = (size_t)c;
                }
                if (inside)
                    add_scalar(v, volume_index(v->n, x[0], x[1], x[2]),
                               w->weight[o[0] + r] * w->weight[o[1] + r] * w->weight[o[2] + r], sum);
            }
        }
}

void structure_tensor_direction(const struct volume *v, const struct tensor_window *w, size_t i, size_t j, size_t k,
                                float d[3])
{
    double sum[6] = {0.0};
    size_t r = (size_t)w->reach + 1, centre[3] = {i, j, k};
    if (i >= r && j >= r && k >= r && i + r + LANES < v->n[0] && j + r < v->n[1] && k + r < v->n[2])
        collect_inner(v, w, i, j, k, sum);
    else
        collect_border(v, w, centre, sum);
    double m[3][3] = {{sum[0], sum[3], sum[4]}, {sum[3], sum[1], sum[5]}, {sum[4], sum[5], sum[2]}};
    float vector[3][3], value[3];
    small_eigen_3(m, vector, value);
    memcpy(d, vector[0], sizeof vector[0]);
}
