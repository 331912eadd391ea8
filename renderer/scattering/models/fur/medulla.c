#include "renderer/scattering/models/fur/medulla.h"
#include "renderer/scattering/models/fur/medulla_taps.h"

#include <string.h>

enum { ROUND = MEDULLA_ROUND_RANK };

void medulla_around_init(struct medulla_around *m, double g)
{
    float slope;
    const struct medulla_taps k = medulla_g_taps(g, &slope);
    medulla_read_factor(&k, medulla_round_g[0], ROUND, slope, m->g, m->d_g);
}

void medulla_ray_init(const struct medulla_around *m, double depth, double offset, struct medulla_ray *ray)
{
    float a[ROUND], d_a[ROUND], c[ROUND], d_c[ROUND], slope, sum = 0, d_sum[MEDULLA_RAY_N_BY] = {0};
    const float step = (float)((MEDULLA_N_OFFSET - 1) / M_PI_2);
    const struct medulla_taps by_depth = medulla_depth_taps(depth, &slope),
                              by_offset = medulla_taps_at(fmin(offset / M_PI_2, 1) * (MEDULLA_N_OFFSET - 1),
                                                          MEDULLA_N_OFFSET, false);
    medulla_read_factor(&by_depth, medulla_round_depth[0], ROUND, slope, a, d_a);
    medulla_read_factor(&by_offset, medulla_round_offset[0], ROUND, step, c, d_c);
    for (int r = 0; r < ROUND; r++) {
        ray->weight[r] = a[r] * m->g[r] * c[r];
        ray->d[MEDULLA_RAY_BY_DEPTH][r] = d_a[r] * m->g[r] * c[r];
        ray->d[MEDULLA_RAY_BY_G][r] = a[r] * m->d_g[r] * c[r];
        ray->d[MEDULLA_RAY_BY_OFFSET][r] = a[r] * m->g[r] * d_c[r];
    }
    for (int r = 0; r < ROUND; r++) {
        sum += ray->weight[r];
        for (int k = 0; k < MEDULLA_RAY_N_BY; k++) d_sum[k] += ray->d[k][r];
    }
    const float inv = 1 / sum;
    for (int r = 0; r < ROUND; r++) {
        ray->weight[r] *= inv;
        for (int k = 0; k < MEDULLA_RAY_N_BY; k++) ray->d[k][r] = (ray->d[k][r] - ray->weight[r] * d_sum[k]) * inv;
    }
}

double medulla_ray_density(const struct medulla_ray *ray, double psi, double *d)
{
    const double step = MEDULLA_N_TURN / (2 * M_PI);
    double turn = psi / (2 * M_PI);
    float f[ROUND], d_f[ROUND], sum = 0, by[MEDULLA_RAY_N_BY + 1] = {0};
    const struct medulla_taps k = medulla_taps_at((turn - floor(turn)) * MEDULLA_N_TURN, MEDULLA_N_TURN, true);
    medulla_read_factor(&k, medulla_round_turn[0], ROUND, (float)step, f, d != NULL ? d_f : NULL);
    for (int r = 0; r < ROUND; r++) sum += ray->weight[r] * f[r];
    if (d == NULL) return fmax((double)sum, MEDULLA_LEAST_DENSITY);
    for (int r = 0; r < ROUND; r++) {
        for (int j = 0; j < MEDULLA_RAY_N_BY; j++) by[j] += ray->d[j][r] * f[r];
        by[MEDULLA_RAY_N_BY] += ray->weight[r] * d_f[r];
    }
    bool bounded = (double)sum < MEDULLA_LEAST_DENSITY;
    for (int j = 0; j <= MEDULLA_RAY_N_BY; j++) d[j] = bounded ? 0 : (double)by[j];
    return fmax((double)sum, MEDULLA_LEAST_DENSITY);
}

/* A cubic through equidistant nodes has the waves of the nodes times a factor: the wave of the cubic of one node that
 * is 1. That is found by quadrature. */
static double wave_of_cubic(int k)
{
    enum { SUB = 64 };
    double sum = 0, step = 2 * M_PI / MEDULLA_N_TURN;
    for (int j = 0; j < 2 * SUB; j++) {
        double x = (j + 0.5) / SUB, far = x - 1, value;
        value = x < 1 ? 1 + x * x * (1.5 * x - 2.5) : -0.5 * far * (1 - far) * (1 - far);
        sum += 2 * value / SUB * cos(k * x * step);
    }
    return sum * step;
}

void medulla_waves(int n_wave, float (*cosine)[MEDULLA_ROUND_RANK], float (*sine)[MEDULLA_ROUND_RANK])
{
    double turn_cos[MEDULLA_N_TURN], turn_sin[MEDULLA_N_TURN];
    for (int j = 0; j < MEDULLA_N_TURN; j++) {
        turn_cos[j] = cos(2 * M_PI * j / MEDULLA_N_TURN);
        turn_sin[j] = sin(2 * M_PI * j / MEDULLA_N_TURN);
    }
    memset(cosine, 0, (size_t)n_wave * sizeof *cosine);
    memset(sine, 0, (size_t)n_wave * sizeof *sine);
    for (int k = 0; k < n_wave; k++) {
        float factor = (float)wave_of_cubic(k);
        for (int j = 0; j < MEDULLA_N_TURN; j++) {
            float c = factor * (float)turn_cos[k * j % MEDULLA_N_TURN],
                  s = factor * (float)turn_sin[k * j % MEDULLA_N_TURN];
            for (int r = 0; r < ROUND; r++) {
                cosine[k][r] += c * medulla_round_turn[j][r];
                sine[k][r] += s * medulla_round_turn[j][r];
            }
        }
    }
}
