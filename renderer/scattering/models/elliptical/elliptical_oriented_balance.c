/* The scale m of elliptical_oriented.v1 (elliptical_oriented.h), by the angle along the fiber and the azimuth: a
 * lossless fiber keeps all light of every direction. The kernel is a matrix of blocks by two angles along the fiber, of
 * the azimuths of both; it and its blocks are symmetric. */
#include "renderer/scattering/models/elliptical/elliptical_oriented.h"

#include <stdlib.h>
#include <string.h>

enum {
    N_TURN = ORIENTED_N_TURN + 1,   /* azimuths */
    N_THETA = ORIENTED_N_THETA + 1, /* angles along the fiber */
    THETA_STRIDE = (LOBE_BALANCE_N - 1) / ORIENTED_N_THETA,
    N_NODE = N_THETA * N_TURN,
    N_BLOCK = N_THETA * (N_THETA + 1) / 2
};
#define LEAST_LOBE 1e-9 /* of M, below which a pair of angles adds nothing */

/* A derivative of the kernel: the part of F, and the parameter along the fiber of the derivative, if any. */
enum along_part { ALONG_VALUE, ALONG_ALPHA, ALONG_BETA };
struct kernel_part {
    int f;
    enum along_part along;
};
static const struct kernel_part value_part = {ORIENTED_VALUE, ALONG_VALUE};
static const struct kernel_part derivative_part[ORIENTED_N_M] = {
    [ORIENTED_M_ETA] = {ORIENTED_BY_ETA, ALONG_VALUE},     [ORIENTED_M_RATIO] = {ORIENTED_BY_RATIO, ALONG_VALUE},
    [ORIENTED_M_ALPHA] = {ORIENTED_VALUE, ALONG_ALPHA},    [ORIENTED_M_BETA] = {ORIENTED_VALUE, ALONG_BETA},
    [ORIENTED_M_GAMMA] = {ORIENTED_BY_GAMMA, ALONG_VALUE},
};

typedef double nodes[N_NODE]; /* the azimuths of one angle along the fiber after the other */
struct balance {
    oriented_folded block[N_BLOCK]; /* of angles t >= u */
    nodes weight, want, x, source, d_ln_x;
    double work[3 * N_NODE];
};

/* Mean over the four images of the azimuth j, seen from the azimuth i. */
void oriented_fold_plane(oriented_plane plane, oriented_folded out)
{
    for (int i = 0; i < N_TURN; i++)
        for (int j = 0; j < N_TURN; j++) {
            const int image[4] = {j, -j, 2 * ORIENTED_N_TURN - j, 2 * ORIENTED_N_TURN + j};
            out[i][j] = 0;
            for (int k = 0; k < 4; k++)
                out[i][j] +=
                    0.25 * plane[oriented_fold(i + image[k], ORIENTED_N)][oriented_fold(image[k] - i, ORIENTED_N)];
        }
}

/* Adds the light that two angles along the fiber exchange: their th_i + th_o is `distance` nodes, their th_d half of
 * `half` nodes. */
static void add_exchange(const struct scattering_state *s, struct oriented_row *row, struct kernel_part part,
                         int distance, int half, oriented_folded out)
{
    int at;
    const double place = cos(0.5 * lobe_balance_angle_rad(half * THETA_STRIDE)) * ELLIPTICAL_N_ROW;
    const double x = (double)table_position((float)place, ELLIPTICAL_N_ROW, &at);
    for (int p = 0; p < ELLIPTICAL_N_LOBE; p++) {
        float d[2];
        double m = (double)tilted_lobe_eval(&s->along[p], (float)lobe_balance_angle_rad(distance * THETA_STRIDE), d);
        if (part.along == ALONG_ALPHA) m = (double)d[0] * elliptical_shift[p];
        if (part.along == ALONG_BETA) m = (double)d[1] * elliptical_width[p];
        if (fabs(m) < LEAST_LOBE) continue;
        oriented_folded *a = &row[at].f[p][part.f], *b = &row[at + 1].f[p][part.f];
        for (int i = 0; i < N_TURN; i++)
            for (int j = 0; j < N_TURN; j++) out[i][j] += m * ((1 - x) * (*a)[i][j] + x * (*b)[i][j]);
    }
}

static void fill_block(const struct scattering_state *s, struct oriented_row *row, struct kernel_part part, int t,
                       int u, oriented_folded out)
{
    memset(out, 0, sizeof(oriented_folded));
    add_exchange(s, row, part, t - u, t + u, out);
    add_exchange(s, row, part, t + u, t - u, out);
}

/* y += block x, whose columns are its rows. */
static void add_block(oriented_folded block, const double *x, double *y)
{
    for (int j = 0; j < N_TURN; j++)
        for (int i = 0; i < N_TURN; i++) y[i] += block[j][i] * x[j];
}

/* Adds the light that the angles t and u send to each other. wx: x with the weights of the nodes. */
static void add_both(oriented_folded block, int t, int u, const double *wx, double *y)
{
    add_block(block, wx + u * N_TURN, y + t * N_TURN);
    if (t != u) add_block(block, wx + t * N_TURN, y + u * N_TURN);
}

static void weigh(const struct balance *b, const double *x, double *wx)
{
    for (int i = 0; i < N_NODE; i++) wx[i] = b->weight[i] * x[i];
}

static void multiply(void *balance, const double *x, double *y)
{
    struct balance *b = balance;
    nodes wx, sum = {0};
    weigh(b, x, wx);
    for (int t = 0, k = 0; t < N_THETA; t++)
        for (int u = 0; u <= t; u++, k++) add_both(b->block[k], t, u, wx, sum);
    memcpy(y, sum, sizeof sum);
}

/* The derivative of ln want less x (dK x) / want. */
static void set_source(const struct scattering_state *s, struct oriented_row *row, int by, struct balance *b)
{
    nodes wx, sum = {0};
    oriented_folded block;
    weigh(b, b->x, wx);
    for (int t = 0; t < N_THETA; t++)
        for (int u = 0; u <= t; u++) {
            fill_block(s, row, derivative_part[by], t, u, block);
            add_both(block, t, u, wx, sum);
        }
    for (int i = 0; i < N_NODE; i++) b->source[i] = -b->x[i] * sum[i] / b->want[i];
}

static void set_nodes(const struct scattering_state *s, struct balance *b, double d_ln_want[N_TURN])
{
    const double h = M_PI_2 / ORIENTED_N_THETA;
    for (int i = 0; i < N_TURN; i++) {
        const double long_axis = cos(0.5 * M_PI * i / ORIENTED_N_TURN);
        double by_ratio, width = oriented_width((double)s->ratio, long_axis * long_axis, &by_ratio);
        d_ln_want[i] = by_ratio / width;
        for (int t = 0; t < N_THETA; t++) {
            const double c = cos(t * h), both_signs = t == 0 ? 0.5 : 1, images = i == 0 || i == N_TURN - 1 ? 2 : 4;
            const int k = t * N_TURN + i;
            b->weight[k] = c * c * h * both_signs * images * 2 * M_PI / ORIENTED_N_AROUND;
            b->want[k] = width;
            b->x[k] = (double)s->scale.a[t * THETA_STRIDE];
        }
    }
}

status oriented_balance(struct scattering_state *s, struct oriented_row *row, struct error *err)
{
    static const int of_scale[ORIENTED_N_M] = {[ORIENTED_M_ETA] = ELLIPTICAL_S_ETA,
                                               [ORIENTED_M_RATIO] = ELLIPTICAL_S_RATIO,
                                               [ORIENTED_M_ALPHA] = ELLIPTICAL_S_ALPHA,
                                               [ORIENTED_M_BETA] = ELLIPTICAL_S_BETA,
                                               [ORIENTED_M_GAMMA] = ELLIPTICAL_N_SCALE}; /* none */
    struct balance *b = malloc(sizeof *b);
    if (b == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot prepare scattering model: out of memory");
    const struct balance_equation equation = {N_NODE, multiply, b, b->want, b->work};
    double d_ln_want[N_TURN];
    set_nodes(s, b, d_ln_want);
    for (int t = 0, k = 0; t < N_THETA; t++)
        for (int u = 0; u <= t; u++, k++) fill_block(s, row, value_part, t, u, b->block[k]);
    balance_equation_solve(&equation, b->x);
    for (int t = 0; t < N_THETA; t++)
        for (int i = 0; i < N_TURN; i++)
            s->balance[t][i].m = (float)(b->x[t * N_TURN + i] / (double)s->scale.a[t * THETA_STRIDE]);
    for (int q = 0; q < ORIENTED_N_M; q++) {
        set_source(s, row, q, b);
        for (int t = 0; t < N_THETA && q == ORIENTED_M_RATIO; t++)
            for (int i = 0; i < N_TURN; i++) b->source[t * N_TURN + i] += d_ln_want[i];
        balance_equation_derivative(&equation, b->x, b->source, b->d_ln_x);
        for (int t = 0; t < N_THETA; t++) { /* m is x over a */
            const int k = of_scale[q];
            const double d_ln_a = k < ELLIPTICAL_N_SCALE ? (double)s->scale.d_ln[k][t * THETA_STRIDE] : 0;
            for (int i = 0; i < N_TURN; i++) s->balance[t][i].d_ln[q] = (float)(b->d_ln_x[t * N_TURN + i] - d_ln_a);
        }
    }
    free(b);
    return STATUS_OK;
}
