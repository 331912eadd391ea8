#include "renderer/scattering/azimuth_table.h"
#include "renderer/scattering/lobe_balance.h"
#include "renderer/scattering/models/fur/medulla.h"
#include "renderer/scattering/models/fur/medulla_taps.h"

#include <stdlib.h>
#include <string.h>

enum { SLAB = MEDULLA_SLAB_RANK };

struct slab_table {
    const float *depth, *g, *sum, *difference;
};

static const struct slab_table slab[MEDULLA_N_HALF] = {
    {medulla_back_depth[0], medulla_back_g[0], medulla_back_sum[0], medulla_back_difference[0]},
    {medulla_through_depth[0], medulla_through_g[0], medulla_through_sum[0], medulla_through_difference[0]}};

/* Fills in one half. A weight for each column, and its derivatives. */
static void fill_half(struct medulla_along *m, int half, float (*weight)[SLAB])
{
    float across[MEDULLA_FINE_DIFFERENCE][SLAB];
    for (int j = 0; j < MEDULLA_FINE_DIFFERENCE; j++) {
        double x = (double)j * (MEDULLA_N_DIFFERENCE - 1) / (MEDULLA_FINE_DIFFERENCE - 1);
        const struct medulla_taps k = medulla_taps_at(x, MEDULLA_N_DIFFERENCE, false);
        medulla_read_factor(&k, slab[half].difference, SLAB, 0, across[j], NULL);
    }
    for (int i = 0; i < MEDULLA_FINE_SUM; i++) {
        const struct medulla_taps k =
            medulla_taps_at((double)i * (MEDULLA_N_SUM - 1) / (MEDULLA_FINE_SUM - 1), MEDULLA_N_SUM, false);
        float f[SLAB];
        medulla_read_factor(&k, slab[half].sum, SLAB, 0, f, NULL);
        for (int j = 0; j < MEDULLA_FINE_DIFFERENCE; j++) {
            float value[1 + MEDULLA_N_BY] = {0};
            for (int q = 0; q <= MEDULLA_N_BY; q++)
                for (int r = 0; r < SLAB; r++) value[q] += weight[q][r] * f[r] * across[j][r];
            const float unweighted = (float)(1 / medulla_slab_weight(M_PI * i / (MEDULLA_FINE_SUM - 1),
                                                                     M_PI * j / (MEDULLA_FINE_DIFFERENCE - 1)));
            for (int q = 0; q <= MEDULLA_N_BY; q++) value[q] *= unweighted;
            bool bounded = (double)value[0] < MEDULLA_LEAST_DENSITY;
            m->m[i][j][half] = bounded ? (float)MEDULLA_LEAST_DENSITY : value[0];
            for (int q = 0; q < MEDULLA_N_BY; q++) m->d[q][i][j][half] = bounded ? 0 : value[1 + q];
        }
    }
}

static void fill(struct medulla_along *m, int half, double depth, double g)
{
    float a[SLAB], d_a[SLAB], b[SLAB], d_b[SLAB], weight[1 + MEDULLA_N_BY][SLAB], depth_slope, g_slope;
    const struct medulla_taps by_depth = medulla_depth_taps(depth, &depth_slope), by_g = medulla_g_taps(g, &g_slope);
    medulla_read_factor(&by_depth, slab[half].depth, SLAB, depth_slope, a, d_a);
    medulla_read_factor(&by_g, slab[half].g, SLAB, g_slope, b, d_b);
    for (int r = 0; r < SLAB; r++) {
        weight[0][r] = a[r] * b[r];
        weight[1 + MEDULLA_BY_DEPTH][r] = d_a[r] * b[r];
        weight[1 + MEDULLA_BY_G][r] = a[r] * d_b[r];
    }
    fill_half(m, half, weight);
}

/* Where the table is read for two angles. */
struct table_index {
    int i, j;
    float x, y;
};

static struct table_index index_of(float sum, float difference)
{
    struct table_index g;
    g.x = table_position(fabsf(sum) * (float)((MEDULLA_FINE_SUM - 1) / M_PI), MEDULLA_FINE_SUM - 1, &g.i);
    g.y = table_position(fabsf(difference) * (float)((MEDULLA_FINE_DIFFERENCE - 1) / M_PI), MEDULLA_FINE_DIFFERENCE - 1,
                         &g.j);
    return g;
}

static inline float read_half(const float (*table)[MEDULLA_FINE_DIFFERENCE][MEDULLA_N_HALF],
                              const struct table_index *g, int half)
{
    const float(*row)[MEDULLA_N_HALF] = &table[g->i][g->j], (*next)[MEDULLA_N_HALF] = &table[g->i + 1][g->j];
    return table_mix(table_mix(row[0][half], row[1][half], g->y), table_mix(next[0][half], next[1][half], g->y), g->x);
}

void medulla_along_at(const struct medulla_along *m, float sum, float difference, float value[MEDULLA_N_HALF],
                      float (*d)[MEDULLA_N_HALF])
{
    const struct table_index g = index_of(sum, difference);
    for (int half = 0; half < MEDULLA_N_HALF; half++) {
        value[half] = read_half(m->m, &g, half);
        for (int q = 0; q < MEDULLA_N_BY && d != NULL; q++) d[q][half] = read_half(m->d[q], &g, half);
    }
}

/* ---- balance ---- */

/* Nodes of theta over [0, pi/2]; the fine tables have every multiple of half a degree. */
enum { N_THETA = 129 };

struct balance {
    struct medulla_along *along;
    double depth, g;
    struct lobe_balance solver;
    int half;
    double d_kernel[MEDULLA_N_BY][LOBE_BALANCE_N][LOBE_BALANCE_N];
    double scale[N_THETA], d_ln[MEDULLA_N_BY][N_THETA];
};

/* M is the same for both angles with the other sign, so angles below 0 are folded to those above. Reads its own half
 * alone: another thread writes the other one. */
static void fill_kernel(const struct medulla_along *m, struct balance *b)
{
    const float step = (float)(M_PI_2 / (N_THETA - 1));
    for (int i = 0; i < N_THETA; i++)
        for (int j = 0; j <= i; j++) {
            const float sum = (float)(i + j) * step, difference = (float)(i - j) * step;
            const struct table_index near = index_of(difference, sum), far = index_of(sum, difference);
            b->solver.kernel[i][j] = b->solver.kernel[j][i] =
                (double)(read_half(m->m, &near, b->half) + read_half(m->m, &far, b->half));
            for (int q = 0; q < MEDULLA_N_BY; q++)
                b->d_kernel[q][i][j] = b->d_kernel[q][j][i] =
                    (double)(read_half(m->d[q], &near, b->half) + read_half(m->d[q], &far, b->half));
        }
}

static double at_angle(const double *f, double theta)
{
    double x = fmin(fabs(theta) / M_PI_2, 1) * (N_THETA - 1);
    int i = (int)fmin(x, N_THETA - 2);
    return f[i] + (x - i) * (f[i + 1] - f[i]);
}

/* Multiplies one half by the scales of both angles. */
static void apply(struct medulla_along *m, const struct balance *b)
{
    for (int i = 0; i < MEDULLA_FINE_SUM; i++)
        for (int j = 0; j < MEDULLA_FINE_DIFFERENCE; j++) {
            double sum = M_PI * i / (MEDULLA_FINE_SUM - 1), difference = M_PI * j / (MEDULLA_FINE_DIFFERENCE - 1);
            double one = 0.5 * (sum + difference), other = 0.5 * (sum - difference);
            double scale = at_angle(b->scale, one) * at_angle(b->scale, other), before = (double)m->m[i][j][b->half];
            m->m[i][j][b->half] = (float)(scale * before);
            for (int q = 0; q < MEDULLA_N_BY; q++) {
                float *d = &m->d[q][i][j][b->half];
                *d = (float)(scale * ((double)*d + before * (at_angle(b->d_ln[q], one) + at_angle(b->d_ln[q], other))));
            }
        }
}

/* The integral of M cos^2 th_o dth_o becomes 1 for a half. */
static void balance_half(void *context, size_t half, size_t i_thread)
{
    struct balance *b = (struct balance *)context + half;
    struct medulla_along *m = b->along;
    (void)i_thread;
    const double step = M_PI_2 / (N_THETA - 1);
    b->solver.n = N_THETA;
    for (int i = 0; i < N_THETA; i++) {
        double c = i < N_THETA - 1 ? cos(i * step) : 0;
        b->solver.weight[i] = c * c * step * (i == 0 ? 0.5 : 1);
        b->solver.want[i] = 1;
    }
    fill(m, b->half, b->depth, b->g);
    fill_kernel(m, b);
    lobe_balance_solve(&b->solver, b->scale);
    for (int q = 0; q < MEDULLA_N_BY; q++) {
        for (int i = 0; i < N_THETA; i++)
            memcpy(b->solver.d_kernel[i], b->d_kernel[q][i], N_THETA * sizeof b->d_kernel[q][i][0]);
        lobe_balance_source_of_kernel(&b->solver, b->scale);
        lobe_balance_solve_derivative(&b->solver, b->scale, b->d_ln[q]);
    }
    apply(m, b);
}

status medulla_along_init(struct medulla_along *m, double depth, double g, struct thread_pool *pool, struct error *err)
{
    struct balance *b = calloc(MEDULLA_N_HALF, sizeof *b);
    if (b == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot prepare scattering model: out of memory");
    for (int half = 0; half < MEDULLA_N_HALF; half++) {
        b[half].along = m;
        b[half].depth = depth;
        b[half].g = g;
        b[half].half = half;
    }
    const status st = thread_pool_run(pool, MEDULLA_N_HALF, balance_half, b, NULL);
    free(b);
    return st;
}
