#include "renderer/scattering/models/fur/fur.h"
#include "renderer/scattering/models/fur/fur_means.h"

#include <stdlib.h>
#include <string.h>

enum { N = LOBE_BALANCE_N, N_WIDE = FUR_N_WIDE };

const double fur_shift[FUR_N_LOBE] = {1, 0.5, 1.5}, fur_width[FUR_N_LOBE] = {1, 0.5, 1.5};

/* M, and its derivatives by alpha and beta. */
struct lobe_value {
    double v, alpha, beta;
};

struct balance {
    struct lobe_balance solver;
    struct fur_mean part[2 * N][FUR_N_LOBE];    /* shares by th_d of half so many nodes */
    struct lobe_value along[2 * N][FUR_N_LOBE]; /* M by th_i + th_o of so many nodes */
    double a[N], d_ln_a[N], d_want[FUR_N_SCALE][N], source[FUR_N_SCALE][N];
    const struct fur_means *means;
};

/* ---- the scale of scattered light ---- */

/* Light that the medulla scatters from one angle to another, where the mean over h and ph has the share 1. */
struct exchange {
    double v, d[FUR_N_MEAN_BY];
};

static struct exchange exchange_of(const struct fur_along *s, const struct balance *b, double sum, double difference,
                                   const double *param)
{
    const double cosine = cos(0.5 * difference);
    const struct fur_mean back = fur_mean_at(b->means, cosine, FUR_PART_BACK),
                          through = fur_mean_at(b->means, cosine, FUR_PART_THROUGH);
    const double all = back.v + through.v, w = through.v / all;
    float half[MEDULLA_N_HALF], d_half[MEDULLA_N_BY][MEDULLA_N_HALF];
    medulla_along_at(&s->medulla, (float)sum, (float)difference, half, d_half);
    const double between = (double)half[1] - (double)half[0];
    struct exchange y = {(double)half[0] + w * between, {0}};
    for (int k = 0; k < FUR_N_MEAN_BY; k++) y.d[k] = between * (through.d[k] - w * (through.d[k] + back.d[k])) / all;
    double d[MEDULLA_N_BY];
    for (int q = 0; q < MEDULLA_N_BY; q++) d[q] = (1 - w) * (double)d_half[q][0] + w * (double)d_half[q][1];
    y.d[FUR_M_KAPPA] += d[MEDULLA_BY_DEPTH] * param[FUR_P_MS];
    y.d[FUR_M_MS] += d[MEDULLA_BY_DEPTH] * param[FUR_P_KAPPA];
    y.d[FUR_M_G] += d[MEDULLA_BY_G];
    return y;
}

/* b(t) * integral of b(u) exchange(t, u) cos^2 u du = the share of light from t that is scattered. All is even. */
static void balance_scattered(struct fur_along *s, struct balance *b, const double *param)
{
    const double step = M_PI_2 / (N_WIDE - 1);
    struct lobe_balance *y = &b->solver;
    struct fur_mean share[N_WIDE];
    y->n = N_WIDE;
    memset(b->source, 0, sizeof b->source);
    for (int i = 0; i < N_WIDE; i++) {
        double c = i < N_WIDE - 1 ? cos(i * step) : 0;
        y->weight[i] = c * c * step * (i == 0 ? 0.5 : 1);
        share[i] = fur_mean_at(b->means, c, FUR_PART_SCATTERED);
        y->want[i] = share[i].v;
    }
    for (int pass = 0; pass < 2; pass++) { /* first the scale, then its derivatives */
        for (int i = 0; i < N_WIDE; i++)
            for (int j = 0; j <= i; j++) {
                struct exchange near = exchange_of(s, b, (i - j) * step, (i + j) * step, param),
                                far = exchange_of(s, b, (i + j) * step, (i - j) * step, param);
                if (pass == 0) y->kernel[i][j] = y->kernel[j][i] = near.v + far.v;
                for (int k = 0; k < FUR_N_MEAN_BY && pass == 1; k++) {
                    double light = b->a[i] * b->a[j] * (near.d[k] + far.d[k]);
                    b->source[k][i] -= light * y->weight[j];
                    if (i != j) b->source[k][j] -= light * y->weight[i];
                }
            }
        if (pass == 0) lobe_balance_solve(y, b->a);
    }
    for (int i = 0; i < N_WIDE; i++) s->wide[i] = (float)b->a[i];
    for (int k = 0; k < FUR_N_MEAN_BY; k++) {
        for (int i = 0; i < N_WIDE; i++) y->source[i] = (share[i].d[k] + b->source[k][i]) / share[i].v;
        lobe_balance_solve_derivative(y, b->a, b->d_ln_a);
        for (int i = 0; i < N_WIDE; i++) s->d_ln_wide[k][i] = (float)b->d_ln_a[i];
    }
    for (int row = 0; row <= FUR_N_ROW; row++) {
        const struct fur_mean *m = &b->means->row[row][FUR_PART_SCATTERED];
        s->share[row] = (float)m->v;
        for (int k = 0; k < FUR_N_MEAN_BY; k++) s->d_share[k][row] = (float)m->d[k];
    }
}

/* ---- the scale of the lobes ---- */

static void fill_nodes(const struct fur_along *s, struct balance *b)
{
    lobe_balance_init(&b->solver);
    memset(b->d_want, 0, sizeof b->d_want);
    for (int i = 0; i < N; i++) {
        const struct fur_mean scattered =
            fur_mean_at(b->means, i < N - 1 ? cos(lobe_balance_angle_rad(i)) : 0, FUR_PART_SCATTERED);
        b->solver.want[i] = 1 - scattered.v;
        for (int k = 0; k < FUR_N_MEAN_BY; k++) b->d_want[k][i] = -scattered.d[k];
    }
    for (int i = 0; i < 2 * N; i++)
        for (int p = 0; p < FUR_N_LOBE; p++) {
            float d[2];
            double angle = lobe_balance_angle_rad(i);
            b->along[i][p].v = (double)tilted_lobe_eval(&s->lobe[p], (float)angle, d);
            b->along[i][p].alpha = (double)d[0] * fur_shift[p];
            b->along[i][p].beta = (double)d[1] * fur_width[p];
            b->part[i][p] = fur_mean_at(b->means, fmax(cos(0.5 * angle), 0), p);
        }
}

/* Adds light between angles whose th_i + th_o is so many nodes and th_d half of `half` nodes, and its derivatives when
 * d is not NULL. */
static void add_pair(const struct balance *b, int distance, int half, double *sum, double *d)
{
    for (int p = 0; p < FUR_N_LOBE; p++) {
        const struct lobe_value *m = &b->along[distance][p];
        const struct fur_mean *part = &b->part[half][p];
        *sum += part->v * m->v;
        if (d == NULL) continue;
        for (int k = 0; k < FUR_N_MEAN_BY; k++) d[k] += part->d[k] * m->v;
        d[FUR_S_ALPHA] += part->v * m->alpha;
        d[FUR_S_BETA] += part->v * m->beta;
    }
}

/* M and the shares are even in th_i + th_o and th_d, so the kernel of both signs of th_o folds to one. */
static double pair(const struct balance *b, int i, int j, double *d)
{
    double sum = 0;
    add_pair(b, abs(i - j), i + j, &sum, d);
    add_pair(b, i + j, abs(i - j), &sum, d);
    return sum;
}

/* source = (d want - x (d kernel x)) / want, for all parameters in one pass over the pairs. */
static void fill_sources(struct balance *b)
{
    memcpy(b->source, b->d_want, sizeof b->source);
    for (int i = 0; i < N; i++)
        for (int j = 0; j <= i; j++) {
            double d[FUR_N_SCALE] = {0};
            pair(b, i, j, d);
            for (int k = 0; k < FUR_N_SCALE; k++) {
                double light = b->a[i] * b->a[j] * d[k];
                b->source[k][i] -= light * b->solver.weight[j];
                if (i != j) b->source[k][j] -= light * b->solver.weight[i];
            }
        }
    for (int k = 0; k < FUR_N_SCALE; k++)
        for (int i = 0; i < N; i++) b->source[k][i] /= b->solver.want[i];
}

static void balance_lobes(struct fur_along *s, struct balance *b)
{
    fill_nodes(s, b);
    for (int i = 0; i < N; i++)
        for (int j = 0; j <= i; j++) b->solver.kernel[i][j] = b->solver.kernel[j][i] = pair(b, i, j, NULL);
    lobe_balance_solve(&b->solver, b->a);
    fill_sources(b);
    for (int i = 0; i < N; i++) s->scale[i] = (float)b->a[i];
    for (int k = 0; k < FUR_N_SCALE; k++) {
        memcpy(b->solver.source, b->source[k], sizeof b->source[k]);
        lobe_balance_solve_derivative(&b->solver, b->a, b->d_ln_a);
        for (int i = 0; i < N; i++) s->d_ln_scale[k][i] = (float)b->d_ln_a[i];
    }
}

/* Both scales, which do not depend on each other. */
enum { SCATTERED, LOBES, N_BALANCE };
struct balances {
    struct fur_along *along;
    const double *param;
    struct fur_means means;
    struct balance balance[N_BALANCE];
};

static void balance_either(void *context, size_t which, size_t i_thread)
{
    struct balances *all = context;
    (void)i_thread;
    all->balance[which].means = &all->means;
    if (which == SCATTERED)
        balance_scattered(all->along, &all->balance[which], all->param);
    else
        balance_lobes(all->along, &all->balance[which]);
}

status fur_along_init(struct fur_along *s, const double *param, struct thread_pool *pool, struct error *err)
{
    struct balances *b = malloc(sizeof *b);
    if (b == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot prepare scattering model: out of memory");
    b->along = s;
    b->param = param;
    s->fiber = fur_fiber_of(param);
    status st = medulla_along_init(&s->medulla, param[FUR_P_KAPPA] * param[FUR_P_MS], param[FUR_P_G], pool, err);
    if (st == STATUS_OK) {
        for (int p = 0; p < FUR_N_LOBE; p++) {
            s->lobe[p].shift = (float)(fur_shift[p] * param[FUR_P_ALPHA]);
            s->lobe[p].width = (float)(fur_width[p] * param[FUR_P_BETA]);
        }
        fur_means_fill(&b->means, param, pool);
        st = thread_pool_run(pool, N_BALANCE, balance_either, b, NULL);
    }
    free(b);
    return st;
}

/* ---- between directions ---- */

float fur_scale_at(const struct fur_along *s, float theta_rad, float d_ln[FUR_N_SCALE])
{
    int i;
    float t = table_position(fabsf(theta_rad) * (float)((LOBE_BALANCE_N - 1) / M_PI_2), LOBE_BALANCE_N - 1, &i);
    for (int k = 0; k < FUR_N_SCALE; k++) d_ln[k] += table_mix(s->d_ln_scale[k][i], s->d_ln_scale[k][i + 1], t);
    return table_mix(s->scale[i], s->scale[i + 1], t);
}

float fur_scattered_scale(const struct fur_along *s, const struct fiber_direction *in,
                          const struct fiber_direction *out, float cos_d, float d_ln[FUR_N_MEAN_BY])
{
    const float step = (float)((FUR_N_WIDE - 1) / M_PI_2);
    int i, j, row;
    float x = table_position(fabsf(in->theta_rad) * step, FUR_N_WIDE - 1, &i);
    float y = table_position(fabsf(out->theta_rad) * step, FUR_N_WIDE - 1, &j);
    float z = table_position(cos_d * FUR_N_ROW, FUR_N_ROW, &row),
          inv = 1 / table_mix(s->share[row], s->share[row + 1], z);
    for (int k = 0; k < FUR_N_MEAN_BY; k++)
        d_ln[k] = table_mix(s->d_ln_wide[k][i], s->d_ln_wide[k][i + 1], x) +
                  table_mix(s->d_ln_wide[k][j], s->d_ln_wide[k][j + 1], y) -
                  table_mix(s->d_share[k][row], s->d_share[k][row + 1], z) * inv;
    return table_mix(s->wide[i], s->wide[i + 1], x) * table_mix(s->wide[j], s->wide[j + 1], y) * inv;
}
