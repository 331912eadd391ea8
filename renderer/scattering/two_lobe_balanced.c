/* two_lobe_balanced.v1: the two-lobe model made reciprocal. The published normaliser conserves energy for the incident
 * side only; here a lobe is a(th_i) a(th_o) g(th_o; -th_i, beta) with a such that it is lossless from both sides: a(t)
 * * integral of a(u) g(u; -t, beta) cos^2 u du = 1. a is found by Sinkhorn's balancing, a <- sqrt(a / (K a)); d ln a /
 * d beta from the same equation by implicit differentiation. The Fresnel factor is taken at the difference angle (th_i
 * - th_o) / 2, which makes it symmetric too.
 */
#include "renderer/scattering/two_lobe_core.h"

#include <string.h>

enum { N = TWO_LOBE_N_TABLE / 2 + 1 }; /* nodes over [0, pi/2]; a is even */

struct balance {
    double kernel[N][N]; /* g folded to u >= 0: symmetric */
    double d_kernel[N][N];
    double weight[N]; /* cos^2 u du */
    double a[N], d_ln_a[N], work[N];
};

static void fill_kernel(struct balance *b, double beta)
{
    const double h = M_PI_2 / (N - 1);
    double g[2 * N], d_g[2 * N]; /* by distance in nodes */
    for (int i = 0; i < 2 * N; i++) {
        double z = i * h / beta;
        g[i] = exp(-0.5 * z * z) / (sqrt(2 * M_PI) * beta);
        d_g[i] = g[i] * (z * z - 1) / beta;
    }
    for (int i = 0; i < N; i++) {
        double c = cos(i * h);
        b->weight[i] = c * c * h * (i == 0 ? 0.5 : 1); /* the weight of the pole is 0 */
        for (int j = 0; j < N; j++) {
            b->kernel[i][j] = g[abs(i - j)] + g[i + j];
            b->d_kernel[i][j] = d_g[abs(i - j)] + d_g[i + j];
        }
    }
}

/* y_i = sum of m_ij weight_j x_j, column by column so that it vectorises. */
static void multiply(struct balance *b, double (*m)[N], const double *x, double *y)
{
    memset(y, 0, N * sizeof *y);
    for (int j = 0; j < N; j++) {
        double wx = b->weight[j] * x[j];
        for (int i = 0; i < N; i++) y[i] += m[j][i] * wx;
    }
}

static void solve(struct balance *b)
{
    for (int i = 0; i < N; i++) b->a[i] = 1;
    for (int iteration = 0; iteration < 200; iteration++) {
        multiply(b, b->kernel, b->a, b->work);
        double worst = 0;
        for (int i = 0; i < N; i++) {
            worst = fmax(worst, fabs(b->a[i] * b->work[i] - 1));
            b->a[i] = sqrt(b->a[i] / b->work[i]);
        }
        if (worst < 1e-9) break;
    }
    /* (I + P) x = -r with P = diag(a) K diag(a), rows summing to 1, and r = a * (dK a): half steps converge */
    double r[N], ax[N];
    multiply(b, b->d_kernel, b->a, r);
    for (int i = 0; i < N; i++) {
        r[i] *= b->a[i];
        b->d_ln_a[i] = -0.5 * r[i];
    }
    for (int iteration = 0; iteration < 200; iteration++) {
        for (int i = 0; i < N; i++) ax[i] = b->a[i] * b->d_ln_a[i];
        multiply(b, b->kernel, ax, b->work);
        double worst = 0;
        for (int i = 0; i < N; i++) {
            double residual = b->d_ln_a[i] + b->a[i] * b->work[i] + r[i];
            worst = fmax(worst, fabs(residual));
            b->d_ln_a[i] -= 0.5 * residual;
        }
        if (worst < 1e-7) break;
    }
}

static status prepare(const double *param, struct scattering_state **state, struct error *err)
{
    status st = scattering_check_param(&scattering_two_lobe_balanced, param, err);
    if (st != STATUS_OK) return st;
    struct scattering_state *s = two_lobe_state_new(param);
    struct balance *b = malloc(sizeof *b);
    if (s == NULL || b == NULL) {
        free(s);
        free(b);
        return error_set(err, STATUS_NO_MEMORY, "cannot prepare scattering model: out of memory");
    }
    for (int k = 0; k < 2; k++) {
        fill_kernel(b, param[TWO_LOBE_P_BETA_R + k]);
        solve(b);
        for (int i = 0; i <= TWO_LOBE_N_TABLE; i++) {
            int j = i / 2, next = j + i % 2;
            double a = 0.5 * (b->a[j] + b->a[next]), d_ln = 0.5 * (b->d_ln_a[j] + b->d_ln_a[next]);
            s->normal[i].value[k] = (float)a;
            s->normal[i].d_beta[k] = (float)(a * d_ln);
        }
    }
    free(b);
    two_lobe_fill_sampling(s, true);
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
    .id = "two_lobe_balanced.v1",
    .title = "Two-lobe textile fiber, reciprocal and lossless from both sides",
    .n_param = TWO_LOBE_N_PARAM,
    .param = two_lobe_param,
    .prepare = prepare,
    .release = two_lobe_release,
    .eval = eval,
    .sample = two_lobe_sample,
    .pdf = two_lobe_pdf,
    .eval_pdf = eval_pdf,
};
