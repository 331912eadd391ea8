#include "renderer/scattering/models/fur/medulla_fit.h"
#include "base/rng.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { MOST_RANK = MEDULLA_FIT_MOST_RANK };

struct fit {
    const float *x;
    int n[4], rank;
    double **factor;
    double *sum; /* of the axis at hand: products of x and the other factors, [n][rank] */
};

/* s->sum for an axis. The last axis is the innermost of x, so one pass over it serves each of the others. */
static void contract(struct fit *s, int axis)
{
    const int rank = s->rank;
    const float *x = s->x;
    int i[3];
    memset(s->sum, 0, (size_t)s->n[axis] * (size_t)rank * sizeof *s->sum);
    for (i[0] = 0; i[0] < s->n[0]; i[0]++)
        for (i[1] = 0; i[1] < s->n[1]; i[1]++)
            for (i[2] = 0; i[2] < s->n[2]; i[2]++, x += s->n[3]) {
                double others[MOST_RANK], inner[MOST_RANK] = {0};
                for (int r = 0; r < rank; r++) others[r] = 1;
                for (int a = 0; a < 3; a++)
                    for (int r = 0; r < rank && a != axis; r++) others[r] *= s->factor[a][i[a] * rank + r];
                if (axis == 3) {
                    for (int l = 0; l < s->n[3]; l++)
                        for (int r = 0; r < rank; r++) s->sum[l * rank + r] += (double)x[l] * others[r];
                    continue;
                }
                for (int l = 0; l < s->n[3]; l++)
                    for (int r = 0; r < rank; r++) inner[r] += (double)x[l] * s->factor[3][l * rank + r];
                for (int r = 0; r < rank; r++) s->sum[i[axis] * rank + r] += others[r] * inner[r];
            }
}

/* Products of the columns of all factors but the factor of `axis` (-1: of all). */
static void grams(const struct fit *s, int axis, double (*g)[MOST_RANK])
{
    for (int q = 0; q < s->rank; q++)
        for (int r = 0; r < s->rank; r++) {
            g[q][r] = 1;
            for (int a = 0; a < 4; a++) {
                double sum = 0;
                for (int i = 0; i < s->n[a] && a != axis; i++)
                    sum += s->factor[a][i * s->rank + q] * s->factor[a][i * s->rank + r];
                if (a != axis) g[q][r] *= sum;
            }
        }
}

/* Columns of all axes but the last have the largest entry 1. */
static void normalise(struct fit *s, int axis)
{
    for (int r = 0; r < s->rank; r++) {
        double top = 1e-30;
        for (int i = 0; i < s->n[axis]; i++) top = fmax(top, s->factor[axis][i * s->rank + r]);
        for (int i = 0; i < s->n[axis]; i++) s->factor[axis][i * s->rank + r] /= top;
        for (int l = 0; l < s->n[3]; l++) s->factor[3][l * s->rank + r] *= top;
    }
}

static void improve(struct fit *s, int axis)
{
    static const double least = 1e-12; /* a column that is all 0 would stay so */
    double g[MOST_RANK][MOST_RANK], *f = s->factor[axis];
    contract(s, axis);
    grams(s, axis, g);
    for (int r = 0; r < s->rank; r++)
        for (int i = 0; i < s->n[axis]; i++) {
            double *row = f + i * s->rank, left = s->sum[i * s->rank + r];
            for (int q = 0; q < s->rank; q++) left -= row[q] * g[q][r];
            row[r] = fmax(row[r] + left / fmax(g[r][r], 1e-30), least);
        }
    if (axis < 3) normalise(s, axis);
}

/* |x - model|^2 = |x|^2 - 2 x . model + |model|^2; s->sum belongs to the last axis. */
static double relative_error(const struct fit *s)
{
    double g[MOST_RANK][MOST_RANK], all = 0, cross = 0, model = 0;
    size_t n = 1;
    for (int a = 0; a < 4; a++) n *= (size_t)s->n[a];
    for (size_t i = 0; i < n; i++) all += (double)s->x[i] * (double)s->x[i];
    grams(s, -1, g);
    for (int r = 0; r < s->rank; r++) {
        for (int q = 0; q < s->rank; q++) model += g[q][r];
        for (int l = 0; l < s->n[3]; l++) cross += s->sum[l * s->rank + r] * s->factor[3][l * s->rank + r];
    }
    return sqrt(fmax(all - 2 * cross + model, 0) / all);
}

status medulla_fit(const float *x, const int n[4], int rank, int n_sweep, uint64_t seed, double *factor[4],
                   double *rel_error, struct error *err)
{
    struct fit s = {.x = x, .rank = rank, .factor = factor};
    struct rng r;
    int most = 0;
    for (int a = 0; a < 4; a++) {
        s.n[a] = n[a];
        most = n[a] > most ? n[a] : most;
    }
    s.sum = malloc((size_t)most * (size_t)rank * sizeof *s.sum);
    if (s.sum == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot compress a table: out of memory");
    rng_start(&r, &(struct rng_key){.seed = seed}, 0, 0);
    for (int a = 0; a < 4; a++)
        for (int i = 0; i < n[a] * rank; i++) factor[a][i] = 0.1 + rng_double(&r);
    for (int sweep = 0; sweep < n_sweep; sweep++)
        for (int a = 0; a < 4; a++) improve(&s, a);
    *rel_error = relative_error(&s);
    free(s.sum);
    return STATUS_OK;
}
