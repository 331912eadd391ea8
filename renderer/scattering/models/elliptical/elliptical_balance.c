#include "renderer/scattering/models/elliptical/elliptical_lobes.h"

#include <stdlib.h>
#include <string.h>

enum { N = LOBE_BALANCE_N };

const double elliptical_shift[ELLIPTICAL_N_LOBE] = {1, 0.5, 1.5, 2.5};
const double elliptical_width[ELLIPTICAL_N_LOBE] = {1, 0.5, 2, 2};

void elliptical_lobes_set(struct tilted_lobe along[ELLIPTICAL_N_LOBE], const double *param)
{
    for (int p = 0; p < ELLIPTICAL_N_LOBE; p++) {
        along[p].shift = (float)(elliptical_shift[p] * param[ELLIPTICAL_P_ALPHA]);
        along[p].width = (float)(elliptical_width[p] * param[ELLIPTICAL_P_BETA]);
    }
}

void elliptical_absorbed(struct dual share, struct dual length, double c_t, double out[ELLIPTICAL_N_SUM])
{
    const double ln_c_t = log(c_t), t = exp(0.5 * ln_c_t * length.v);
    out[ELLIPTICAL_VALUE] = share.v * t;
    out[ELLIPTICAL_BY_C_T] = out[ELLIPTICAL_VALUE] * 0.5 * length.v / c_t;
    for (int k = 0; k < 2; k++) out[ELLIPTICAL_BY_ETA + k] = t * (share.d[k] + share.v * 0.5 * ln_c_t * length.d[k]);
}

struct balance {
    struct lobe_balance solver;
    struct dual share[2 * N][ELLIPTICAL_N_LOBE]; /* of the lobes, by half of the distance of so many nodes */
    double d[ELLIPTICAL_N_SCALE][N][N];          /* of the kernel */
    double a[N], d_ln_a[N];
};

static void fill_shares(const struct elliptical_energies *e, struct balance *b)
{
    memset(b->share, 0, sizeof b->share);
    for (int i = 0; i < 2 * N; i++) {
        double x = cos(0.5 * lobe_balance_angle_rad(i)) * ELLIPTICAL_N_ROW;
        int row = x < ELLIPTICAL_N_ROW - 1 ? (int)x : ELLIPTICAL_N_ROW - 1;
        x -= row;
        for (int p = 0; p < ELLIPTICAL_N_MODE; p++) {
            struct dual *to = &b->share[i][p < ELLIPTICAL_REST ? p : ELLIPTICAL_REST - 1];
            const struct dual *lower = &e->share[row][p], *upper = &e->share[row + 1][p];
            to->v += (1 - x) * lower->v + x * upper->v;
            for (int k = 0; k < 2; k++) to->d[k] += (1 - x) * lower->d[k] + x * upper->d[k];
        }
    }
}

/* Adds the light of one pair of directions, whose th_i + th_o is so many nodes and th_d half of `half` nodes. */
static void add_pair(const struct tilted_lobe *along, const struct balance *b, int distance, int half,
                     double sum[ELLIPTICAL_N_SCALE + 1])
{
    for (int p = 0; p < ELLIPTICAL_N_LOBE; p++) {
        float d[2];
        const struct dual *share = &b->share[half][p];
        double m = (double)tilted_lobe_eval(&along[p], (float)lobe_balance_angle_rad(distance), d);
        sum[ELLIPTICAL_S_ETA] += share->d[ELLIPSE_BY_ETA] * m;
        sum[ELLIPTICAL_S_RATIO] += share->d[ELLIPSE_BY_RATIO] * m;
        sum[ELLIPTICAL_S_ALPHA] += share->v * (double)d[0] * elliptical_shift[p];
        sum[ELLIPTICAL_S_BETA] += share->v * (double)d[1] * elliptical_width[p];
        sum[ELLIPTICAL_N_SCALE] += share->v * m;
    }
}

/* M and the shares are even in th_i + th_o and th_d, so the kernel of both signs of th_o folds to one. */
static void fill_kernel(const struct tilted_lobe *along, struct balance *b)
{
    for (int i = 0; i < N; i++)
        for (int j = 0; j <= i; j++) {
            double sum[ELLIPTICAL_N_SCALE + 1] = {0};
            add_pair(along, b, i - j, i + j, sum);
            add_pair(along, b, i + j, i - j, sum);
            for (int k = 0; k < ELLIPTICAL_N_SCALE; k++) b->d[k][i][j] = b->d[k][j][i] = sum[k];
            b->solver.kernel[i][j] = b->solver.kernel[j][i] = sum[ELLIPTICAL_N_SCALE];
        }
}

status elliptical_balance(const struct tilted_lobe along[ELLIPTICAL_N_LOBE], const struct elliptical_energies *energies,
                          struct elliptical_scale *scale, struct error *err)
{
    struct balance *b = malloc(sizeof *b);
    if (b == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot prepare scattering model: out of memory");
    lobe_balance_init(&b->solver);
    for (int i = 0; i < N; i++) b->solver.want[i] = 1;
    fill_shares(energies, b);
    fill_kernel(along, b);
    lobe_balance_solve(&b->solver, b->a);
    for (int i = 0; i < N; i++) scale->a[i] = (float)b->a[i];
    for (int k = 0; k < ELLIPTICAL_N_SCALE; k++) {
        memcpy(b->solver.d_kernel, b->d[k], sizeof b->d[k]);
        lobe_balance_source_of_kernel(&b->solver, b->a);
        lobe_balance_solve_derivative(&b->solver, b->a, b->d_ln_a);
        for (int i = 0; i < N; i++) scale->d_ln[k][i] = (float)b->d_ln_a[i];
    }
    free(b);
    return STATUS_OK;
}
