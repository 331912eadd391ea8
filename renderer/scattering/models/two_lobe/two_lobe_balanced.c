/* two_lobe_balanced.v1: the two-lobe model made reciprocal and, where nothing absorbs, exactly lossless from both
 * sides. The published normaliser conserves energy for the incident side only. Here, with the Fresnel share k of the
 * difference angle, k(x, y) = (1 - cos((x - y) / 2))^5, which is symmetric,
 *     M_R(th_i, th_o)  = a(th_i) a(th_o) g(th_o; -th_i, beta_R),                a(t) sum_R[a] = 1
 *     rho(t)           = share of the light at t that the growing k sends into R = a(t) sum_R[a k]
 *     M_TT(th_i, th_o) = b(th_i) b(th_o) g(th_o; -th_i, beta_TT),               b(t) sum_TT[b (1 - k)] = 1 - rho(t)
 * with sum_x[f] the integral of f(u) g(u; -t, beta_x) cos^2 u du. R takes C_R + (1 - C_R) rho and TT is given the rest,
 * (1 - C_R)(1 - rho), in every channel: one pair of functions serves all colours. Both equations are solved by
 * Sinkhorn's balancing, y <- sqrt(y want / (K y)), and their derivatives by implicit differentiation; b depends on both
 * widths, through want also on beta_R.
 */
#include "renderer/scattering/lobe_balance.h"
#include "renderer/scattering/models/two_lobe/two_lobe_core.h"

enum { N = LOBE_BALANCE_N };

struct balance {
    struct lobe_balance solver;
    double a[N], d_ln_a[N], b[N], d_ln_b[N], cross[N];
    double rho[N], d_rho[N]; /* by beta_R */
};

static void fill_schlick(struct lobe_balance *b)
{
    const double h = lobe_balance_angle_rad(1);
    for (int i = 0; i < 2 * N; i++) b->share[i] = pow(1 - cos(0.5 * i * h), 5);
}

static void balance_tt(struct balance *b, double beta)
{
    struct lobe_balance *s = &b->solver;
    for (int i = 0; i < N; i++) s->want[i] = 1 - b->rho[i];
    lobe_balance_fill_kernel(s, beta, 1, -1);
    lobe_balance_solve(s, b->b);
    lobe_balance_source_of_kernel(s, b->b);
    lobe_balance_solve_derivative(s, b->b, b->d_ln_b);
    for (int i = 0; i < N; i++) s->source[i] = -b->d_rho[i] / s->want[i];
    lobe_balance_solve_derivative(s, b->b, b->cross);
}

static void fill_tables(const struct balance *b, struct scattering_state *s)
{
    for (int i = 0; i <= TWO_LOBE_N_TABLE; i++) {
        double a = lobe_balance_at_entry(b->a, i), tt = lobe_balance_at_entry(b->b, i),
               rho = lobe_balance_at_entry(b->rho, i);
        s->normal[i].value[TWO_LOBE_R] = (float)a;
        s->normal[i].value[TWO_LOBE_TT] = (float)tt;
        s->normal[i].d_beta[TWO_LOBE_R] = (float)(a * lobe_balance_at_entry(b->d_ln_a, i));
        s->normal[i].d_beta[TWO_LOBE_TT] = (float)(tt * lobe_balance_at_entry(b->d_ln_b, i));
        s->cross[i] = (float)lobe_balance_at_entry(b->cross, i);
        s->sampling[i].energy[0] = 1;
        s->sampling[i].energy[1] = (float)rho;
        s->sampling[i].energy[2] = (float)(1 - rho);
    }
    for (int k = 0; k < 2; k++) two_lobe_level_lines(s, k);
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
    lobe_balance_init(&b->solver);
    fill_schlick(&b->solver);
    lobe_balance_r(&b->solver, param[TWO_LOBE_P_BETA_R], b->a, b->d_ln_a);
    lobe_balance_share(&b->solver, param[TWO_LOBE_P_BETA_R], b->a, b->d_ln_a, b->rho, b->d_rho);
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
    struct scattering_view v;
    two_lobe_view_of(s, wo, weight_rgb, &v);
    return two_lobe_eval_pdf(s, true, wi, &v, s_rgb, score);
}

static float eval_pdf_view(const struct scattering_state *s, const float wi[3], const struct scattering_view *v,
                           float s_rgb[3], float *score)
{
    return two_lobe_eval_pdf(s, true, wi, v, s_rgb, score);
}

const struct scattering_model scattering_two_lobe_balanced = {
    SURFACE_MODEL_ROW(two_lobe_balanced),
    .prepare = prepare,
    .release = two_lobe_release,
    .eval = eval,
    .sample = two_lobe_sample,
    .pdf = two_lobe_pdf,
    .eval_pdf = eval_pdf,
    .lobe_rad = two_lobe_lobe_rad,
    .view_of = two_lobe_view_of,
    .eval_pdf_view = eval_pdf_view,
    .sample_view = two_lobe_sample_view,
};
