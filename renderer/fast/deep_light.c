#include "renderer/fast/deep_light.h"

#include <math.h>

void deep_light_nodes(const struct deep_light *d, const double direction[3], size_t node[4], double weight[4])
{
    size_t at[2], last = d->edge - 1;
    double part[2], across = sqrt(direction[0] * direction[0] + direction[1] * direction[1]);
    double scale = across > 0.0 ? M_2_PI * atan2(across, fabs(direction[2])) / across : 0.0;
    for (int a = 0; a < 2; a++) {
        double x = (0.5 + 0.5 * scale * direction[a]) * (double)last;
        x = fmin(fmax(x, 0.0), (double)last);
        at[a] = (size_t)x < last ? (size_t)x : last - 1;
        part[a] = x - (double)at[a];
    }
    size_t side = d->n_side > 1 && direction[2] < 0.0 ? 1 : 0;
    for (size_t k = 0; k < 4; k++) {
        node[k] = (side * d->edge + at[1] + (k >> 1)) * d->edge + at[0] + (k & 1);
        weight[k] = ((k & 1) ? part[0] : 1.0 - part[0]) * ((k >> 1) ? part[1] : 1.0 - part[1]);
    }
}

size_t deep_light_class(const float tangent[3]) { return fabsf(tangent[0]) > fabsf(tangent[1]); }

void deep_light_kinds(const float tangent[3], size_t kind[2], double weight[2])
{
    const size_t i_class = deep_light_class(tangent), last = DEEP_LIGHT_N_TILT - 1;
    double tilt = (double)(copysignf(1, tangent[i_class == 1 ? 0 : 1]) * tangent[2] / DEEP_LIGHT_TILT);
    double x = (0.5 + 0.5 * fmin(fmax(tilt, -1.0), 1.0)) * (double)last;
    size_t node = (size_t)x < last ? (size_t)x : last - 1;
    for (size_t k = 0; k < 2; k++) {
        kind[k] = i_class * DEEP_LIGHT_N_TILT + node + k;
        weight[k] = k == 0 ? 1.0 - (x - (double)node) : x - (double)node;
    }
}

void deep_light_add(const struct deep_light *d, const float tangent[3], const float wo[3], const float wi[3],
                    const float scale[3], float rgb[3])
{
    size_t kind[2], view[4], light[4], n_node = deep_light_n_node(d);
    double kind_weight[2], view_weight[4], light_weight[4], from[3] = {(double)wi[0], (double)wi[1], (double)wi[2]},
                                                            to[3] = {(double)wo[0], (double)wo[1], (double)wo[2]};
    float sum[3] = {0, 0, 0};
    if (d->n_side == 1 && from[2] <= 0.0) return;
    if (d->n_side == 1) to[2] = fmax(to[2], 0.0);
    deep_light_kinds(tangent, kind, kind_weight);
    deep_light_nodes(d, to, view, view_weight);
    deep_light_nodes(d, from, light, light_weight);
    for (size_t k = 0; k < 32; k++) {
        const float *value = d->value + ((kind[k / 16] * n_node + view[k / 4 % 4]) * n_node + light[k % 4]) * 3;
        float weight = (float)(kind_weight[k / 16] * view_weight[k / 4 % 4] * light_weight[k % 4]);
        for (int c = 0; c < 3; c++) sum[c] += weight * value[c];
    }
    for (int c = 0; c < 3; c++) rgb[c] += scale[c] * (float)fabs(from[2]) * sum[c];
}

float deep_light_pile(const struct deep_light *d, size_t channel)
{
    const double r = (double)d->back[channel], t = (double)d->through[channel], b = 1.0 + r * r - t * t;
    return r > 0.0 ? (float)((b - sqrt(fmax(b * b - 4.0 * r * r, 0.0))) / (2.0 * r)) : 0.0f;
}

void deep_light_shift(const struct deep_light *d, const float wo[3], const float wi[3], float shift_mm[2])
{
    const float *direction[2] = {wo, wi};
    shift_mm[0] = shift_mm[1] = 0;
    for (size_t i = 0; i < 2; i++) {
        size_t node[4];
        double weight[4], z = (double)direction[i][2];
        const double at[3] = {(double)direction[i][0], (double)direction[i][1], d->n_side == 1 ? fmax(z, 0.0) : z};
        deep_light_nodes(d, at, node, weight);
        for (size_t k = 0; k < 4; k++)
            for (int a = 0; a < 2; a++)
                shift_mm[a] += (float)weight[k] * d->shift[i * deep_light_n_node(d) + node[k]][a];
    }
}
