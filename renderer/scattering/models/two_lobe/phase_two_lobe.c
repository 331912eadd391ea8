/* phase_two_lobe.v1: the two-lobe fiber as a phase function (fabric thesis section 5.4, "volume"):
 *     f_c = alpha_c S_c(wi, wo) cos th_i / N_c(th_o),   N_c = integral of S_c cos th_i dwi
 *         N_c = C_R E_0 + (1 - C_R) E_1 + C_TT (1 - C_R) E_2      (azimuths integrate to 1)
 *     E_0 = integral of gbar_R cos^2 th_i dth_i,  E_1 the same times (1 - cos th_i)^5,
 *     E_2 = integral of gbar_TT (1 - (1 - cos th_i)^5) cos^2 th_i dth_i
 * E and its derivatives by the widths depend on |th_o| alone and are tabulated, with the tabulated S itself as
 * integrand so that f integrates to alpha. Extinction: s(w) = sine of the angle to the fiber (its visible width). Three
 * albedos beside the nine parameters of two_lobe.v1; sampling is that model's, whose density is exact here too.
 */
#include "renderer/scattering/models/two_lobe/two_lobe_core.h"
#include "renderer/scattering/phase_model.h"

#include <string.h>

enum { N_PARAM = volume_two_lobe_n_param, P_ALPHA = TWO_LOBE_N_PARAM, N_TABLE = TWO_LOBE_N_TABLE, N_NODE = 48 };

struct energy_entry {          /* by |th_o| */
    float value[3], d_beta[3]; /* E_0, E_1 by beta_R; E_2 by beta_TT */
};

struct phase_state {
    struct scattering_state *lobes;
    float alpha[3];
    struct energy_entry energy[N_TABLE + 1];
    struct phase_extinction extinction;
};

/* Adds lobe k's energies at theta_o: Simpson's rule over +-5 widths about -theta_o. */
static void add_lobe_energy(const struct scattering_state *s, int k, float theta_o, struct energy_entry *e)
{
    float reach = 5 * s->beta[k], lo = fmaxf((float)-M_PI_2, -theta_o - reach),
          hi = fminf((float)M_PI_2, -theta_o + reach), step = (hi - lo) / N_NODE;
    for (int i = 0; i <= N_NODE; i++) {
        float t = lo + (float)i * step, x = t + theta_o, cos_t = cosf(t), scale[2], score[2];
        two_lobe_scale_at(s, false, t, scale, score);
        float weight = step / 3 * (i == 0 || i == N_NODE ? 1.0f : i % 2 == 1 ? 4.0f : 2.0f);
        float m = s->peak[k] * expf(-x * x * s->inv_2var[k]) * scale[k] * cos_t * cos_t * weight;
        float d = m * (x * x * s->inv_cube[k] - s->inv[k] + score[k]), schlick = two_lobe_schlick(cos_t);
        if (k == TWO_LOBE_R) {
            e->value[0] += m;
            e->d_beta[0] += d;
            e->value[1] += m * schlick;
            e->d_beta[1] += d * schlick;
        } else {
            e->value[2] += m * (1 - schlick);
            e->d_beta[2] += d * (1 - schlick);
        }
    }
}

static void release(struct phase_state *s)
{
    if (s == NULL) return;
    scattering_two_lobe.release(s->lobes);
    free(s);
}

static status prepare(const double *param, struct phase_state **state, struct error *err)
{
    status st = param_check(phase_two_lobe.param, phase_two_lobe.n_param, phase_two_lobe.id, param, err);
    if (st != STATUS_OK) return st;
    struct phase_state *s = calloc(1, sizeof *s);
    if (s == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot prepare phase function: out of memory");
    st = scattering_two_lobe.prepare(param, &s->lobes, err);
    if (st != STATUS_OK) {
        free(s);
        return st;
    }
    for (int c = 0; c < 3; c++) s->alpha[c] = (float)param[P_ALPHA + c];
    for (int i = 0; i <= N_TABLE; i++)
        for (int k = 0; k < 2; k++) add_lobe_energy(s->lobes, k, (float)(i * (M_PI_2 / N_TABLE)), &s->energy[i]);
    for (int i = 0; i <= PHASE_N_EXTINCTION; i++) s->extinction.value[i] = (float)i / PHASE_N_EXTINCTION;
    s->extinction.largest = 1;
    s->extinction.i_param = -1;
    *state = s;
    return STATUS_OK;
}

static const struct phase_extinction *extinction(const struct phase_state *s) { return &s->extinction; }

static void sample(const struct phase_state *s, const float wo[3], const float *weight_rgb, const float u[3],
                   float wi[3])
{
    two_lobe_sample(s->lobes, wo, weight_rgb, u, wi);
}

static float eval_pdf(const struct phase_state *s, const float wi[3], const float wo[3], const float *weight_rgb,
                      float f_rgb[3], float *score)
{
    const struct scattering_state *l = s->lobes;
    struct fiber_direction di = fiber_direction_of(wi);
    struct scattering_view v;
    two_lobe_view_of(l, wo, weight_rgb, &v);
    struct two_lobe_terms t = two_lobe_terms_of(l, &di, &v.out);
    float own[3 * TWO_LOBE_N_PARAM], e[3], d[3];
    two_lobe_eval_terms(l, false, &di, &v.out, &t, f_rgb, score != NULL ? own : NULL);
    int i;
    float x = two_lobe_table_position(v.out.theta_rad, &i);
    const struct energy_entry *a = &s->energy[i], *b = a + 1;
    for (int k = 0; k < 3; k++) {
        e[k] = two_lobe_mix(a->value[k], b->value[k], x);
        d[k] = two_lobe_mix(a->d_beta[k], b->d_beta[k], x);
    }
    for (int c = 0; c < 3; c++) {
        float not_c_r = l->not_c_r[c], c_tt = l->c_tt[c];
        float inv = 1 / (l->c_r[c] * e[0] + not_c_r * e[1] + c_tt * not_c_r * e[2]);
        f_rgb[c] *= s->alpha[c] * di.cos_theta * inv;
        if (score == NULL) continue;
        float *h = score + c * N_PARAM;
        memcpy(h, own + c * TWO_LOBE_N_PARAM, TWO_LOBE_N_PARAM * sizeof *h);
        memset(h + P_ALPHA, 0, 3 * sizeof *h);
        if (!(f_rgb[c] > 0)) { /* no weight, no score */
            memset(h, 0, N_PARAM * sizeof *h);
            continue;
        }
        h[TWO_LOBE_P_C_R + c] -= (e[0] - e[1] - c_tt * e[2]) * inv;
        h[TWO_LOBE_P_C_TT + c] -= not_c_r * e[2] * inv;
        h[TWO_LOBE_P_BETA_R] -= (l->c_r[c] * d[0] + not_c_r * d[1]) * inv;
        h[TWO_LOBE_P_BETA_TT] -= c_tt * not_c_r * d[2] * inv;
        h[P_ALPHA + c] = 1 / s->alpha[c];
    }
    return two_lobe_pdf_terms(&di, &v, &t);
}

const struct phase_model phase_two_lobe = {
    VOLUME_MODEL_ROW(two_lobe), .prepare = prepare, .release = release,
    .extinction = extinction,   .sample = sample,   .eval_pdf = eval_pdf,
};
