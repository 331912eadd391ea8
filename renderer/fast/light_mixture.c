#include "renderer/fast/light_mixture.h"

#include <math.h>
#include <string.h>

enum { N_ROW = 64, N_COLUMN = 128 };

static void fibonacci(size_t k, float d[3])
{
    double z = 1.0 - 2.0 * ((double)k + 0.5) / MIXTURE_MAX, phi = 4.0 * M_PI * (double)k / (1.0 + sqrt(5.0));
    double r = sqrt(1.0 - z * z);
    d[0] = (float)(r * cos(phi));
    d[1] = (float)(r * sin(phi));
    d[2] = (float)z;
}

static size_t nearest(const float point[MIXTURE_MAX][3], const float d[3])
{
    size_t best = 0;
    float most = -2;
    for (size_t k = 0; k < MIXTURE_MAX; k++) {
        float c = point[k][0] * d[0] + point[k][1] * d[1] + point[k][2] * d[2];
        if (c <= most) continue;
        most = c;
        best = k;
    }
    return best;
}

static void keep_lit(struct light_mixture *m, const float sum[MIXTURE_MAX][3], const float rgb[MIXTURE_MAX][3])
{
    float all = 0;
    for (size_t k = 0; k < MIXTURE_MAX; k++) {
        float length = sqrtf(sum[k][0] * sum[k][0] + sum[k][1] * sum[k][1] + sum[k][2] * sum[k][2]);
        if (!(length > 0)) continue;
        for (int a = 0; a < 3; a++) m->direction[m->n][a] = sum[k][a] / length;
        memcpy(m->rgb[m->n], rgb[k], sizeof m->rgb[0]);
        all += rgb[k][0] + rgb[k][1] + rgb[k][2];
        m->cumulative[m->n++] = all;
    }
    for (size_t k = 0; k < m->n; k++) m->cumulative[k] /= all;
}

void light_mixture_init(struct light_mixture *m, const struct lights *l)
{
    float point[MIXTURE_MAX][3], sum[MIXTURE_MAX][3] = {{0}}, rgb[MIXTURE_MAX][3] = {{0}}, zonal[SPHERE_MAX_ORDER + 1];
    memset(m, 0, sizeof *m);
    if (!l->has_constant && l->image == NULL) return;
    for (size_t k = 0; k < MIXTURE_MAX; k++) fibonacci(k, point[k]);
    for (int i = 0; i < N_ROW * N_COLUMN; i++) {
        double low = M_PI * (i / N_COLUMN) / N_ROW, high = low + M_PI / N_ROW, theta = 0.5 * (low + high);
        double phi = 2.0 * M_PI * (i % N_COLUMN + 0.5) / N_COLUMN;
        const float d[3] = {(float)(sin(theta) * cos(phi)), (float)(sin(theta) * sin(phi)), (float)cos(theta)};
        float light[3] = {0}, angle = (float)((cos(low) - cos(high)) * 2.0 * M_PI / N_COLUMN);
        lights_add_environment(l, d, 0, light);
        size_t k = nearest((const float(*)[3])point, d);
        float brightness = (light[0] + light[1] + light[2]) * angle;
        for (int a = 0; a < 3; a++) {
            rgb[k][a] += light[a] * angle;
            sum[k][a] += d[a] * brightness;
        }
    }
    keep_lit(m, (const float(*)[3])sum, (const float(*)[3])rgb);
    /* as wide as the part of the sphere that each stands for */
    sphere_gaussian_zonal(SPHERE_MAX_ORDER, 0.5 * MIXTURE_MAX, zonal);
    for (int order = 0; order <= SPHERE_MAX_ORDER; order++)
        m->zonal[order] = zonal[order] * sqrtf((float)(4 * M_PI) / (float)(2 * order + 1));
}

size_t light_mixture_pick(const struct light_mixture *m, float u)
{
    size_t k = 0;
    while (k + 1 < m->n && u >= m->cumulative[k]) k++;
    return k;
}

void light_mixture_sample(const struct light_mixture *m, float u, float direction[3], float scale[3])
{
    const size_t k = light_mixture_pick(m, u);
    const float chance = m->cumulative[k] - (k > 0 ? m->cumulative[k - 1] : 0);
    memcpy(direction, m->direction[k], 3 * sizeof *direction);
    for (int c = 0; c < 3; c++) scale[c] = m->rgb[k][c] / chance * (float)M_1_PI;
}
