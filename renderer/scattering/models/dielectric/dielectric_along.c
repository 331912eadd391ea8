#include "renderer/scattering/models/dielectric/dielectric_along.h"
#include "renderer/scattering/models/dielectric/dielectric_ray.h"

#include <stdlib.h>
#include <string.h>

enum { N = LOBE_BALANCE_N, N_ROW = 64 };
enum { BY_ETA, BY_BETA };

const double dielectric_width[DIELECTRIC_N_LOBE] = {1, 0.5, 2};

/* Mean shares of the modes without absorption, and their derivative by eta, by cos th_d. */
struct energies {
    double share[N_ROW + 1][DIELECTRIC_N_MODE], d_eta[N_ROW + 1][DIELECTRIC_N_MODE];
};

static void fill_energies(double eta, struct energies *e)
{
    double x[DIELECTRIC_N_OFFSET], weight[DIELECTRIC_N_OFFSET];
    dielectric_offsets(x, weight);
    memset(e, 0, sizeof *e);
    for (int row = 0; row <= N_ROW; row++)
        for (int i = 0; i < DIELECTRIC_N_OFFSET; i++) {
            double cosine = fmax((double)row / N_ROW, DIELECTRIC_LEAST_COSINE);
            struct dielectric_ray ray = dielectric_ray_at(cosine, x[i], eta);
            struct dielectric_shares clear = dielectric_shares_of(&ray, 1, 0);
            for (int p = 0; p < DIELECTRIC_N_MODE; p++) {
                e->share[row][p] += weight[i] * clear.value[p];
                e->d_eta[row][p] += weight[i] * clear.d_eta[p];
            }
        }
}

/* Shares of the longitudinal lobes, by half of the distance of so many nodes; TRT's has the rest too. */
struct shares {
    double of[2 * N][DIELECTRIC_N_LOBE], d_eta[2 * N][DIELECTRIC_N_LOBE];
};

static void fill_shares(const struct energies *e, struct shares *y)
{
    for (int i = 0; i < 2 * N; i++) {
        double x = cos(0.5 * lobe_balance_angle_rad(i)) * N_ROW;
        int row = x < N_ROW - 1 ? (int)x : N_ROW - 1;
        x -= row;
        for (int p = 0; p < DIELECTRIC_N_MODE; p++) {
            int lobe = p < DIELECTRIC_N_LOBE ? p : DIELECTRIC_TRT;
            double share = (1 - x) * e->share[row][p] + x * e->share[row + 1][p];
            double d_eta = (1 - x) * e->d_eta[row][p] + x * e->d_eta[row + 1][p];
            y->of[i][lobe] = share + (p == DIELECTRIC_REST ? y->of[i][lobe] : 0);
            y->d_eta[i][lobe] = d_eta + (p == DIELECTRIC_REST ? y->d_eta[i][lobe] : 0);
        }
    }
}

/* Sums over the lobes of their share times M, and its derivatives. */
struct pair {
    double value, d[2];
};

/* Adds light between two directions with the given sines and cosines; th_d is half of so many nodes. */
static void add_pair(const struct dielectric_along *s, const struct shares *y, int half, const float t[2],
                     const float u[2], struct pair *sum)
{
    for (int lobe = 0; lobe < DIELECTRIC_N_LOBE; lobe++) {
        float score;
        double m = (double)cone_lobe_eval(&s->longitudinal[lobe], t[0], t[1], u[0], u[1], &score);
        sum->value += y->of[half][lobe] * m;
        sum->d[BY_ETA] += y->d_eta[half][lobe] * m;
        sum->d[BY_BETA] += y->of[half][lobe] * m * (double)score * dielectric_width[lobe];
    }
}

/* The kernel, with its derivative by beta as the solver's own; by eta in `d_eta`. */
static void fill_kernel(const struct dielectric_along *s, const struct shares *y, struct lobe_balance *b,
                        double (*d_eta)[N])
{
    float angle[N][2];
    for (int i = 0; i < N; i++) {
        angle[i][0] = (float)sin(lobe_balance_angle_rad(i));
        angle[i][1] = i < N - 1 ? (float)cos(lobe_balance_angle_rad(i)) : 0;
    }
    for (int i = 0; i < N; i++)
        for (int j = 0; j <= i; j++) { /* light at t leaves about -t, so -u is the near one of the folded pair */
            struct pair sum = {0};
            const float mirrored[2] = {-angle[j][0], angle[j][1]};
            add_pair(s, y, i + j, angle[i], mirrored, &sum);
            add_pair(s, y, i - j, angle[i], angle[j], &sum);
            b->kernel[i][j] = b->kernel[j][i] = sum.value;
            b->d_kernel[i][j] = b->d_kernel[j][i] = sum.d[BY_BETA];
            d_eta[i][j] = d_eta[j][i] = sum.d[BY_ETA];
        }
}

struct balance {
    struct lobe_balance solver;
    struct energies energies;
    struct shares shares;
    double d_eta[N][N], a[N], d_ln_a[2][N];
};

status dielectric_along_init(struct dielectric_along *s, double eta, double beta_rad, struct error *err)
{
    struct balance *b = malloc(sizeof *b);
    if (b == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot prepare scattering model: out of memory");
    for (int p = 0; p < DIELECTRIC_N_LOBE; p++) cone_lobe_init(&s->longitudinal[p], dielectric_width[p] * beta_rad);
    lobe_balance_init(&b->solver);
    for (int i = 0; i < N; i++) b->solver.want[i] = 1;
    fill_energies(eta, &b->energies);
    fill_shares(&b->energies, &b->shares);
    fill_kernel(s, &b->shares, &b->solver, b->d_eta);
    lobe_balance_solve(&b->solver, b->a);
    lobe_balance_source_of_kernel(&b->solver, b->a);
    lobe_balance_solve_derivative(&b->solver, b->a, b->d_ln_a[BY_BETA]);
    memcpy(b->solver.d_kernel, b->d_eta, sizeof b->d_eta);
    lobe_balance_source_of_kernel(&b->solver, b->a);
    lobe_balance_solve_derivative(&b->solver, b->a, b->d_ln_a[BY_ETA]);
    for (int i = 0; i < N; i++) {
        s->scale[i] = (float)b->a[i];
        for (int k = 0; k < 2; k++) s->d_ln_scale[k][i] = (float)b->d_ln_a[k][i];
    }
    free(b);
    return STATUS_OK;
}
