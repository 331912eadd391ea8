#include "renderer/scattering/models/fur/medulla_trace.h"

#include <stdlib.h>
#include <string.h>

enum { N = 90, N_INCIDENT = N / 2 }; /* angles over [-pi/2, pi/2], at the middles of bins */

void medulla_trace_round(const struct medulla_medium *m, double offset, int n_walk, uint64_t seed,
                         float turn[MEDULLA_N_TURN])
{
    double count[MEDULLA_N_TURN] = {0};
    struct rng r;
    rng_start(&r, &(struct rng_key){.seed = seed}, 0, 0);
    medulla_walk_round(m, offset, n_walk, &r, MEDULLA_N_TURN, count);
    for (int j = 0; j < MEDULLA_N_TURN; j++) turn[j] = (float)(count[j] * MEDULLA_N_TURN / (2 * M_PI * n_walk));
}

struct slab {
    double walk[2][N][N]; /* light that leaves, over its cosine, per light that comes, by incidence and exit */
    double weight[N][N];  /* reciprocal variance of walk over the value that it estimates */
    double f[N][N], scale[N];
};

static double angle_of_bin(double i) { return M_PI * ((i + 0.5) / N - 0.5); }

static void trace(struct slab *s, const struct medulla_medium *m, int n_walk, uint64_t seed)
{
    for (int k = 0; k < N_INCIDENT; k++) {
        const int i = N - 1 - k; /* the angles > 0; the others are their mirror images */
        double *const half[2] = {s->walk[0][i], s->walk[1][i]}, theta = angle_of_bin(i);
        double scattered = -expm1(-2 * m->depth / cos(theta));
        struct rng r;
        rng_start(&r, &(struct rng_key){.seed = seed}, (uint32_t)k, 0);
        medulla_walk_slab(m, theta, n_walk, &r, N, (double **)half);
        for (int j = 0; j < N; j++) {
            double cosine = cos(angle_of_bin(j));
            for (int side = 0; side < 2; side++) {
                s->walk[side][i][j] *= scattered * N / (M_PI * n_walk * cosine);
                s->walk[side][N - 1 - i][N - 1 - j] = s->walk[side][i][j];
            }
            s->weight[i][j] = s->weight[N - 1 - i][N - 1 - j] = cosine / scattered;
        }
    }
}

static void balance(struct slab *s, int side)
{
    for (int i = 0; i < N; i++) {
        s->scale[i] = 1;
        for (int j = 0; j < N; j++) {
            double there = s->weight[i][j], back = s->weight[j][i];
            s->f[i][j] = (there * s->walk[side][i][j] + back * s->walk[side][j][i]) / (there + back);
        }
    }
    for (int iteration = 0; iteration < 200; iteration++)
        for (int i = 0; i < N; i++) {
            double sum = 1e-30;
            for (int j = 0; j < N; j++) {
                double c = cos(angle_of_bin(j));
                sum += s->f[i][j] * s->scale[j] * c * c * (M_PI / N);
            }
            s->scale[i] = sqrt(s->scale[i] / sum);
        }
    for (int i = 0; i < N; i++)
        for (int j = 0; j < N; j++) s->f[i][j] *= s->scale[i] * s->scale[j];
}

static int place(double theta, double *t)
{
    double x = fmax(0, fmin(N - 1, (theta / M_PI + 0.5) * N - 0.5));
    int i = (int)fmin(x, N - 2);
    *t = x - i;
    return i;
}

static float value_at(const struct slab *s, double sum, double difference)
{
    double x, y, bounded = fmin(difference, M_PI - sum);
    int i = place(0.5 * (sum - bounded), &x), j = place(0.5 * (sum + bounded), &y);
    double before = s->f[i][j] + y * (s->f[i][j + 1] - s->f[i][j]);
    double after = s->f[i + 1][j] + y * (s->f[i + 1][j + 1] - s->f[i + 1][j]);
    return (float)(medulla_slab_weight(sum, difference) * (before + x * (after - before)));
}

status medulla_trace_slab(const struct medulla_medium *m, int n_walk, uint64_t seed,
                          float (*half)[MEDULLA_N_SUM][MEDULLA_N_DIFFERENCE], struct error *err)
{
    struct slab *s = calloc(1, sizeof *s);
    if (s == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot trace a medulla: out of memory");
    trace(s, m, n_walk, seed);
    for (int side = 0; side < 2; side++) {
        balance(s, side);
        for (int i = 0; i < MEDULLA_N_SUM; i++)
            for (int j = 0; j < MEDULLA_N_DIFFERENCE; j++)
                half[side][i][j] = value_at(s, i * M_PI / (MEDULLA_N_SUM - 1), j * M_PI / (MEDULLA_N_DIFFERENCE - 1));
    }
    free(s);
    return STATUS_OK;
}
