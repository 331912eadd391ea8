/* two_lobe_balanced.v1: the two-lobe model made reciprocal and, where nothing absorbs, exactly lossless from both
 * sides. The published normaliser conserves energy for the incident side only. Here, with the Fresnel share k of the
 * difference angle, k(x, y) = (1 - cos((x - y) / 2))^5, which is symmetric,
 *     M_R(th_i, th_o)  = a(th_i) a(th_o) g(th_o; -th_i, beta_R),                a(t) sum_R[a] = 1
 *     rho(t)           = what of the light at t the growing share k sends into R = a(t) sum_R[a k]
 *     M_TT(th_i, th_o) = b(th_i) b(th_o) g(th_o; -th_i, beta_TT),               b(t) sum_TT[b (1 - k)] = 1 - rho(t)
 * with sum_x[f] the integral of f(u) g(u; -t, beta_x) cos^2 u du. R takes C_R + (1 - C_R) rho and TT is given the rest,
 * (1 - C_R)(1 - rho), in every channel: one pair of functions serves all colours. Both equations are solved by
 * Sinkhorn's balancing, y <- sqrt(y want / (K y)), and their derivatives by implicit differentiation; b depends on both
 * widths, through want also on beta_R.
 */
#include "renderer/scattering/surface/two_lobe_core.h"

#include <string.h>

enum { N = TWO_LOBE_N_TABLE / 2 + 1 }; /* nodes over [0, pi/2]; all functions are even */

struct balance {
    double kernel[N][N];   /* g, or g (1 - k), folded to u >= 0: symmetric */
    double d_kernel[N][N]; /* by its own beta */
    double weight[N];      /* cos^2 u du */
    double schlick[2 * N]; /* k of half an angle of so many nodes */
    double a[N], d_ln_a[N], b[N], d_ln_b[N], cross[N];
    double rho[N], d_rho[N]; /* by beta_R */
    double want[N], work[N], source[N];
};

static void fill_grid(struct balance *b)
{
    const double h = M_PI_2 / (N - 1);
    for (int i = 0; i < N; i++) {
        double c = cos(i * h);
        b->weight[i] = c * c * h * (i == 0 ? 0.5 : 1); /* the weight of the pole is 0 */
    }
    for (int i = 0; i < 2 * N; i++) b->schlick[i] = pow(1 - cos(0.5 * i * h), 5);
}

/* Light at t leaves about -t: at u with the difference angle (t - u) / 2, or folded (t + u) / 2, the other way round
 * than the distance in g. share_only: g (k), times_rest: g (1 - k). */
static void fill_kernel(struct balance *b, double beta, double constant, double slope)
{
    const double h = M_PI_2 / (N - 1);
    double g[2 * N], d_g[2 * N]; /* by distance in nodes */
    for (int i = 0; i < 2 * N; i++) {
        double z = i * h / beta;
        g[i] = exp(-0.5 * z * z) / (sqrt(2 * M_PI) * beta);
        d_g[i] = g[i] * (z * z - 1) / beta;
    }
    for (int i = 0; i < N; i++)
        for (int j = 0; j < N; j++) {
            int near = abs(i - j), far = i + j;
            double k_near = constant + slope * b->schlick[far], k_far = constant + slope * b->schlick[near];
            b->kernel[i][j] = g[near] * k_near + g[far] * k_far;
            b->d_kernel[i][j] = d_g[near] * k_near + d_g[far] * k_far;
        }
}

/* y_i = sum of m_ij weight_j x_j, column by column so that it vectorises. */
static void multiply(const struct balance *b, double (*m)[N], const double *x, double *y)
{
    memset(y, 0, N * sizeof *y);
    for (int j = 0; j < N; j++) {
        double wx = b->weight[j] * x[j];
        for (int i = 0; i < N; i++) y[i] += m[j][i] * wx;
    }
}

/* The positive x with x_i (K x)_i = want_i. */
static void solve(struct balance *b, double *x)
{
    for (int i = 0; i < N; i++) x[i] = 1;
    for (int iteration = 0; iteration < 200; iteration++) {
        multiply(b, b->kernel, x, b->work);
        double worst = 0;
        for (int i = 0; i < N; i++) {
            worst = fmax(worst, fabs(x[i] * b->work[i] / b->want[i] - 1));
            x[i] = sqrt(x[i] * b->want[i] / b->work[i]);
        }
        if (worst < 1e-9) break;
    }
}

/* d ln x of that equation: (I + P) d = source, P = diag(x / want) K diag(x), whose rows sum to 1; half steps
 * converge. */
static void solve_derivative(struct balance *b, const double *x, double *d)
{
    double xd[N];
    for (int i = 0; i < N; i++) d[i] = 0.5 * b->source[i];
    for (int iteration = 0; iteration < 200; iteration++) {
        for (int i = 0; i < N; i++) xd[i] = x[i] * d[i];
        multiply(b, b->kernel, xd, b->work);
        double worst = 0;
        for (int i = 0; i < N; i++) {
            double residual = d[i] + x[i] / b->want[i] * b->work[i] - b->source[i];
            worst = fmax(worst, fabs(residual));
            d[i] -= 0.5 * residual;
        }
        if (worst < 1e-7) break;
    }
}

/* source = -x (dK x) / want: the kernel's own width. */
static void source_of_kernel(struct balance *b, const double *x)
{
    multiply(b, b->d_kernel, x, b->source);
    for (int i = 0; i < N; i++) b->source[i] *= -x[i] / b->want[i];
}

static void balance_r(struct balance *b, double beta)
{
    double da[N], ka[N];
    for (int i = 0; i < N; i++) b->want[i] = 1;
    fill_kernel(b, beta, 1, 0);
    solve(b, b->a);
    source_of_kernel(b, b->a);
    solve_derivative(b, b->a, b->d_ln_a);

    fill_kernel(b, beta, 0, 1);
    multiply(b, b->kernel, b->a, ka);
    for (int i = 0; i < N; i++) {
        b->rho[i] = b->a[i] * ka[i];
        b->d_rho[i] = b->rho[i] * b->d_ln_a[i];
        da[i] = b->a[i] * b->d_ln_a[i];
    }
    multiply(b, b->kernel, da, b->work);
    multiply(b, b->d_kernel, b->a, ka);
    for (int i = 0; i < N; i++) b->d_rho[i] += b->a[i] * (b->work[i] + ka[i]);
}

static void balance_tt(struct balance *b, double beta)
{
    for (int i = 0; i < N; i++) b->want[i] = 1 - b->rho[i];
    fill_kernel(b, beta, 1, -1);
    solve(b, b->b);
    source_of_kernel(b, b->b);
    solve_derivative(b, b->b, b->d_ln_b);
    for (int i = 0; i < N; i++) b->source[i] = -b->d_rho[i] / b->want[i];
    solve_derivative(b, b->b, b->cross);
}

/* f at table entry i of twice as many: cubic through four nodes, f even about the first. */
static double at_entry(const double *f, int i)
{
    int j = i / 2;
    if (i % 2 == 0) return f[j];
    int k = j > N - 3 ? N - 3 : j; /* one-sided at the pole */
    double before = f[k > 0 ? k - 1 : 1];
    return j == k ? (9 * (f[k] + f[k + 1]) - before - f[k + 2]) / 16
                  : (before - 5 * f[k] + 15 * f[k + 1] + 5 * f[k + 2]) / 16;
}

/* The tables are read by straight lines, which lie above a convex function, on the average by step^2 f'' / 12: taken
 * off beforehand, as energy would grow by it near the poles of narrow lobes. */
static void level_lines(struct scattering_state *s, int lobe)
{
    float before = s->normal[1].value[lobe]; /* even */
    for (int i = 0; i < TWO_LOBE_N_TABLE; i++) {
        float here = s->normal[i].value[lobe], bend = before - 2 * here + s->normal[i + 1].value[lobe];
        before = here;
        s->normal[i].value[lobe] = here - bend / 12;
    }
}

static void fill_tables(const struct balance *b, struct scattering_state *s)
{
    for (int i = 0; i <= TWO_LOBE_N_TABLE; i++) {
        double a = at_entry(b->a, i), tt = at_entry(b->b, i), rho = at_entry(b->rho, i);
        s->normal[i].value[TWO_LOBE_R] = (float)a;
        s->normal[i].value[TWO_LOBE_TT] = (float)tt;
        s->normal[i].d_beta[TWO_LOBE_R] = (float)(a * at_entry(b->d_ln_a, i));
        s->normal[i].d_beta[TWO_LOBE_TT] = (float)(tt * at_entry(b->d_ln_b, i));
        s->cross[i] = (float)at_entry(b->cross, i);
        s->sampling[i].energy[0] = 1;
        s->sampling[i].energy[1] = (float)rho;
        s->sampling[i].energy[2] = (float)(1 - rho);
    }
    for (int k = 0; k < 2; k++) level_lines(s, k);
    two_lobe_fill_reach(s);
}

static status prepare(const double *param, struct scattering_state **state, struct error *err)
{
    status st = param_check(scattering_two_lobe_balanced.param, scattering_two_lobe_balanced.n_param,
                            scattering_two_lobe_balanced.id, param, err);
    if (st != STATUS_OK) return st;
    struct scattering_state *s = malloc(sizeof *s);
    struct balance *b = malloc(sizeof *b);
    if (s == NULL || b == NULL) {
        free(s);
        free(b);
        return error_set(err, STATUS_NO_MEMORY, "cannot prepare scattering model: out of memory");
    }
    two_lobe_state_init(s, param);
    fill_grid(b);
    balance_r(b, param[TWO_LOBE_P_BETA_R]);
    balance_tt(b, param[TWO_LOBE_P_BETA_TT]);
    fill_tables(b, s);
    free(b);
    *state = s;
    return STATUS_OK;
}

static void eval(const struct scattering_state *s, const float wi[3], const float wo[3], float s_rgb[3], float *score)
{
    struct fiber_direction di = fiber_direction_of(wi), dout = fiber_direction_of(wo);
    struct two_lobe_terms t = two_lobe_terms_of(s, &di, &dout);
    two_lobe_eval_terms(s, true, &di, &dout, &t, s_rgb, score);
}

static float eval_pdf(const struct scattering_state *s, const float wi[3], const float wo[3], const float *weight_rgb,
                      float s_rgb[3], float *score)
{
    return two_lobe_eval_pdf(s, true, wi, wo, weight_rgb, s_rgb, score);
}

const struct scattering_model scattering_two_lobe_balanced = {
    SURFACE_MODEL_ROW(two_lobe_balanced),
    .prepare = prepare,
    .release = two_lobe_release,
    .eval = eval,
    .sample = two_lobe_sample,
    .pdf = two_lobe_pdf,
    .eval_pdf = eval_pdf,
};
