#include "renderer/glint/glint_map.h"

#include <math.h>
#include <stdlib.h>

void glint_map_normals_of_slopes(struct glint_map *m)
{
    for (size_t k = 0; k < m->n * m->n; k++) {
        const float *p = m->normal[k], scale = -1 / sqrtf(1 + p[0] * p[0] + p[1] * p[1]);
        m->normal[k][0] *= scale;
        m->normal[k][1] *= scale;
    }
}

status glint_map_make(const struct glint_option *o, struct glint_map *m, struct error *err)
{
    *m = (struct glint_map){.n = o->n_texel, .texel_um = o->texel_um, .is_flat = o->kind == GLINT_FLAKES};
    m->normal = calloc(m->n * m->n, sizeof *m->normal);
    if (m->normal == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot make a normal map: out of memory");
    status s = STATUS_OK;
    switch (o->kind) {
    case GLINT_NOISE:
        s = glint_noise_slopes(o, (double)o->slope, m, err);
        break;
    case GLINT_SCRATCHES:
        s = glint_scratch_slopes(o, m, err);
        break;
    case GLINT_FLAKES:
        s = glint_flake_slopes(o, m, err);
        break;
    default:
        s = error_set_field(err, STATUS_INVALID, "kind", "there is no kind %d of glint surfaces", (int)o->kind);
    }
    if (s == STATUS_OK)
        glint_map_normals_of_slopes(m);
    else
        glint_map_release(m);
    return s;
}

void glint_map_release(struct glint_map *m)
{
    free(m->normal);
    m->normal = NULL;
}

/* Weights of Catmull-Rom for four neighbours, and their derivatives by x in [0, 1). */
static void cubic_weights(double x, double weight[4], double slope[4])
{
    weight[0] = x * (-0.5 + x * (1 - 0.5 * x));
    weight[1] = 1 + x * x * (-2.5 + 1.5 * x);
    weight[2] = x * (0.5 + x * (2 - 1.5 * x));
    weight[3] = x * x * (-0.5 + 0.5 * x);
    slope[0] = -0.5 + x * (2 - 1.5 * x);
    slope[1] = x * (-5 + 4.5 * x);
    slope[2] = 0.5 + x * (4 - 4.5 * x);
    slope[3] = x * (-1 + 1.5 * x);
}

void glint_map_at(const struct glint_map *m, const double place[2], float normal[2], float jacobian[4])
{
    const double offset = m->is_flat ? 0 : 0.5, floor_of[2] = {floor(place[0] - offset), floor(place[1] - offset)};
    const size_t mask = m->n - 1, x = (size_t)(int64_t)floor_of[0], y = (size_t)(int64_t)floor_of[1];
    double w[2][4], d[2][4], sum[3][2] = {{0}};
    if (m->is_flat) {
        for (int c = 0; c < 2; c++) normal[c] = m->normal[(y & mask) * m->n + (x & mask)][c];
        for (int c = 0; jacobian != NULL && c < 4; c++) jacobian[c] = 0;
        return;
    }
    for (int a = 0; a < 2; a++) cubic_weights(place[a] - offset - floor_of[a], w[a], d[a]);
    for (size_t j = 0; j < 4; j++)
        for (size_t i = 0; i < 4; i++) {
            const float *p = m->normal[((y + j - 1) & mask) * m->n + ((x + i - 1) & mask)];
            for (int c = 0; c < 2; c++) {
                sum[0][c] += w[0][i] * w[1][j] * (double)p[c];
                sum[1][c] += d[0][i] * w[1][j] * (double)p[c];
                sum[2][c] += w[0][i] * d[1][j] * (double)p[c];
            }
        }
    for (int c = 0; c < 2; c++) {
        normal[c] = (float)sum[0][c];
        if (jacobian == NULL) continue;
        jacobian[2 * c] = (float)sum[1][c];
        jacobian[2 * c + 1] = (float)sum[2][c];
    }
}
