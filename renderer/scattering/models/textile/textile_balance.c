#include "renderer/scattering/lobe_balance.h"
#include "renderer/scattering/models/textile/textile.h"

enum { N = LOBE_BALANCE_N };

struct balance {
    struct lobe_balance solver;
    double share[TEXTILE_DEGREE + 1], d_share[TEXTILE_DEGREE + 1];
    double a[N], d_ln_a[N], b[N], d_ln_b[N];
    double rho[N], d_rho[2][N], d_ln_b_of[2][N]; /* by beta_R and by s */
};

/* Coefficients of K in powers of y = 1 - cos d: with c = cos(ph/2), (1 - c cos d)^5 = (1 - c + c y)^5 = sum over k of
 * binomial(5, k) (1 - c)^(5 - k) c^k y^k, in which all terms are positive. The mean of c^n over ph is m_n, m_0 = 1,
 * m_1 = 2 / pi, m_n = (n - 1) / n m_(n - 2); under cos(ph/2) / 4 it is (pi / 2) m_(n + 1). */
static void fill_share(struct balance *b, double s)
{
    static const double binomial[TEXTILE_DEGREE + 1][TEXTILE_DEGREE + 1] = {
        {1}, {1, 1}, {1, 2, 1}, {1, 3, 3, 1}, {1, 4, 6, 4, 1}, {1, 5, 10, 10, 5, 1}};
    double mean[TEXTILE_DEGREE + 2] = {1, M_2_PI};
    for (int n = 2; n <= TEXTILE_DEGREE + 1; n++) mean[n] = mean[n - 2] * (n - 1) / n;
    for (int k = 0; k <= TEXTILE_DEGREE; k++) {
        double uniform = 0, smooth = 0;
        for (int j = 0; j <= TEXTILE_DEGREE - k; j++) {
            double factor = binomial[TEXTILE_DEGREE][k] * binomial[TEXTILE_DEGREE - k][j] * (j % 2 == 0 ? 1 : -1);
            uniform += factor * mean[k + j];
            smooth += factor * M_PI_2 * mean[k + j + 1];
        }
        b->share[k] = (1 - s) * uniform + s * smooth;
        b->d_share[k] = smooth - uniform;
    }
}

/* Sets the solver's share at half of each distance. */
static void take_share(struct lobe_balance *solver, const double c[TEXTILE_DEGREE + 1])
{
    for (int i = 0; i < 2 * N; i++) {
        double y = 1 - cos(0.5 * lobe_balance_angle_rad(i)), sum = c[TEXTILE_DEGREE];
        for (int k = TEXTILE_DEGREE - 1; k >= 0; k--) sum = sum * y + c[k];
        solver->share[i] = sum;
    }
}

static void balance_r(struct balance *b, double beta)
{
    struct lobe_balance *v = &b->solver;
    lobe_balance_r(v, beta, b->a, b->d_ln_a);
    take_share(v, b->d_share);
    lobe_balance_fill_kernel(v, beta, 0, 1);
    lobe_balance_multiply(v, v->kernel, b->a, b->d_rho[1]);
    for (int i = 0; i < N; i++) b->d_rho[1][i] *= b->a[i];
    take_share(v, b->share);
    lobe_balance_share(v, beta, b->a, b->d_ln_a, b->rho, b->d_rho[0]);
}

static void balance_tt(struct balance *b, double beta)
{
    struct lobe_balance *v = &b->solver;
    double by_s[N]; /* of the sum over the kernel by s, at fixed b */
    for (int i = 0; i < N; i++) v->want[i] = 1 - b->rho[i];
    lobe_balance_fill_kernel(v, beta, 1, -1);
    lobe_balance_solve(v, b->b);
    take_share(v, b->d_share);
    lobe_balance_fill_kernel(v, beta, 0, -1);
    lobe_balance_multiply(v, v->kernel, b->b, by_s);
    take_share(v, b->share);
    lobe_balance_fill_kernel(v, beta, 1, -1);
    lobe_balance_source_of_kernel(v, b->b);
    lobe_balance_solve_derivative(v, b->b, b->d_ln_b);
    for (int k = 0; k < 2; k++) {
        for (int i = 0; i < N; i++) v->source[i] = -(b->d_rho[k][i] + (k == 1 ? b->b[i] * by_s[i] : 0)) / v->want[i];
        lobe_balance_solve_derivative(v, b->b, b->d_ln_b_of[k]);
    }
}

/* Z, and d Z by beta_R and by s. */
static void sum_diffuse(const struct balance *b, double *z, double d_z[2])
{
    *z = d_z[0] = d_z[1] = 0;
    for (int i = 0; i < N; i++) {
        double weight = 4 * M_PI * b->solver.weight[i]; /* both signs of th, all azimuths */
        *z += weight * (1 - b->rho[i]);
        for (int k = 0; k < 2; k++) d_z[k] -= weight * b->d_rho[k][i];
    }
}

static void fill_scales(const struct balance *b, struct scattering_state *s)
{
    for (int i = 0; i <= TWO_LOBE_N_TABLE; i++) {
        double a = lobe_balance_at_entry(b->a, i), tt = lobe_balance_at_entry(b->b, i);
        double rho = lobe_balance_at_entry(b->rho, i);
        s->normal[i].value[TWO_LOBE_R] = (float)a;
        s->normal[i].value[TWO_LOBE_TT] = (float)tt;
        s->normal[i].d_beta[TWO_LOBE_R] = (float)(a * lobe_balance_at_entry(b->d_ln_a, i));
        s->normal[i].d_beta[TWO_LOBE_TT] = (float)(tt * lobe_balance_at_entry(b->d_ln_b, i));
        s->cross[i] = (float)lobe_balance_at_entry(b->d_ln_b_of[0], i);
        s->sampling[i].energy[0] = 1;
        s->sampling[i].energy[1] = (float)rho;
        s->sampling[i].energy[2] = (float)(1 - rho);
    }
    for (int k = 0; k < 2; k++) two_lobe_level_lines(s, k);
    two_lobe_fill_reach(s);
}

static void fill_entries(const struct balance *b, struct textile_state *t)
{
    double z, d_z[2];
    sum_diffuse(b, &z, d_z);
    t->inv_z = (float)(1 / z);
    for (int i = 0; i <= TWO_LOBE_N_TABLE; i++) {
        double q = 1 - lobe_balance_at_entry(b->rho, i);
        t->entry[i].q = (float)q;
        for (int k = 0; k < 2; k++)
            t->entry[i].d_q[k] = (float)(-lobe_balance_at_entry(b->d_rho[k], i) / q - 0.5 * d_z[k] / z);
        t->entry[i].cross_s = (float)lobe_balance_at_entry(b->d_ln_b_of[1], i);
    }
}

status textile_balance(struct textile_state *t, const double *param, struct error *err)
{
    struct balance *b = malloc(sizeof *b);
    if (b == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot prepare scattering model: out of memory");
    lobe_balance_init(&b->solver);
    fill_share(b, param[TEXTILE_P_S]);
    balance_r(b, param[TWO_LOBE_P_BETA_R]);
    balance_tt(b, param[TWO_LOBE_P_BETA_TT]);
    fill_scales(b, &t->lobes);
    fill_entries(b, t);
    for (int k = 0; k <= TEXTILE_DEGREE; k++) {
        t->share[k] = (float)b->share[k];
        t->d_share[k] = (float)b->d_share[k];
    }
    free(b);
    return STATUS_OK;
}
