/* two_lobe.v1: the textile fiber model of the fabric thesis, section 5.4, as published. */
#include "renderer/scattering/cone_lobe.h"
#include "renderer/scattering/models/two_lobe/gauss_polynomial.h"
#include "renderer/scattering/models/two_lobe/two_lobe_core.h"

/* Light that a uniform environment sends to th_o through each lobe, before colours. */
static void lobe_energy(const struct scattering_state *s, float theta_o, float energy[3])
{
    enum { N = 24 };
    float unused[2], sum[2][2] = {{0}};
    for (int k = 0; k < 2; k++) {
        float lo = fmaxf((float)-M_PI_2, -theta_o - 4 * s->beta[k]),
              hi = fminf((float)M_PI_2, -theta_o + 4 * s->beta[k]);
        float step = (hi - lo) / N;
        for (int i = 0; i < N; i++) {
            float t = lo + ((float)i + 0.5f) * step, x = t + theta_o, cos_t = cosf(t), scale[2];
            two_lobe_scale_at(s, false, t, scale, unused);
            float m = s->peak[k] * expf(-x * x * s->inv_2var[k]) * scale[k] * cos_t * cos_t * step;
            sum[k][0] += m;
            sum[k][1] += m * two_lobe_schlick(cos_t);
        }
    }
    energy[0] = sum[TWO_LOBE_R][0];
    energy[1] = sum[TWO_LOBE_R][1];
    energy[2] = sum[TWO_LOBE_TT][0] - sum[TWO_LOBE_TT][1];
}

static void fill_energy(struct scattering_state *s)
{
    enum { STRIDE = 16 };
    for (int i = 0; i <= TWO_LOBE_N_TABLE; i += STRIDE)
        lobe_energy(s, (float)(i * (M_PI_2 / TWO_LOBE_N_TABLE)), s->sampling[i].energy);
    for (int i = 0; i <= TWO_LOBE_N_TABLE; i++) {
        int i0 = i / STRIDE * STRIDE;
        float t = (float)(i - i0) / STRIDE;
        for (int k = 0; k < 3 && i != i0; k++) /* i0 + STRIDE is in the table unless i == i0 */
            // cppcheck-suppress arrayIndexOutOfBounds
            s->sampling[i].energy[k] = two_lobe_mix(s->sampling[i0].energy[k], s->sampling[i0 + STRIDE].energy[k], t);
    }
}

void two_lobe_init_published(struct scattering_state *s, const double *param)
{
    two_lobe_state_init(s, param);
    for (int i = 0; i <= TWO_LOBE_N_TABLE; i++)
        for (int k = 0; k < 2; k++) {
            double d_beta;
            double g = lobe_normaliser(i * (M_PI_2 / TWO_LOBE_N_TABLE), param[TWO_LOBE_P_BETA_R + k], NULL, &d_beta);
            s->normal[i].value[k] = (float)g;
            s->normal[i].d_beta[k] = (float)d_beta;
        }
    fill_energy(s);
    two_lobe_fill_reach(s);
}

static status prepare(const double *param, struct scattering_state **state, struct error *err)
{
    status st = param_check(scattering_two_lobe.param, scattering_two_lobe.n_param, scattering_two_lobe.id, param, err);
    if (st != STATUS_OK) return st;
    struct scattering_state *s = malloc(sizeof *s);
    if (s == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot prepare scattering model: out of memory");
    two_lobe_init_published(s, param);
    *state = s;
    return STATUS_OK;
}

static void eval(const struct scattering_state *s, const float wi[3], const float wo[3], float s_rgb[3], float *score)
{
    struct fiber_direction di = fiber_direction_of(wi), dout = fiber_direction_of(wo);
    struct two_lobe_terms t = two_lobe_terms_of(s, &di, &dout);
    two_lobe_eval_terms(s, false, &di, &dout, &t, s_rgb, score);
}

static float eval_pdf(const struct scattering_state *s, const float wi[3], const float wo[3], const float *weight_rgb,
                      float s_rgb[3], float *score)
{
    struct scattering_view v;
    two_lobe_view_of(s, wo, weight_rgb, &v);
    return two_lobe_eval_pdf(s, false, wi, &v, s_rgb, score);
}

static float eval_pdf_view(const struct scattering_state *s, const float wi[3], const struct scattering_view *v,
                           float s_rgb[3], float *score)
{
    return two_lobe_eval_pdf(s, false, wi, v, s_rgb, score);
}

/* The product of a lobe's normal density of th_i about -th_o and of the Gaussian, a normal density of variance
 * 1 / sharpness about its axis' angle: its integral over th_i. *theta: its middle, weighted by 1 / beta^2 and the
 * sharpness (fabric thesis, section 6.5.2, where the weight of th_o is misprinted as beta^2). */
static float product_integral(const struct scattering_state *s, int lobe, float theta_o, float theta_axis,
                              float sharpness, float *theta)
{
    float narrow = 2 * s->inv_2var[lobe], both = narrow + sharpness, sum = theta_o + theta_axis,
          root = sqrtf(0.5f * both);
    *theta = (sharpness * theta_axis - narrow * theta_o) / both;
    float inside = erff(root * ((float)M_PI_2 - *theta)) + erff(root * ((float)M_PI_2 + *theta));
    return s->peak[lobe] * expf(-0.5f * narrow * sharpness / both * sum * sum) * 0.5f * sqrtf((float)M_PI) / root *
           inside;
}

/* Fabric thesis, equation 6.2 and appendix C.2: the rest of the integrand is taken at the middle of the product. I0 is
 * scaled by exp(-x) throughout. */
static void gaussian(const struct scattering_state *s, const float axis[3], float sharpness, const float wo[3],
                     float rgb[3])
{
    struct fiber_direction a = fiber_direction_of(axis), o = fiber_direction_of(wo);
    float value[2], k[2], opposite = fiber_one_minus_cos_opposite(&a, &o), kappa = s->azimuth.kappa;
    for (int lobe = 0; lobe < 2; lobe++) {
        float theta, scale[2], unused[2];
        value[lobe] = product_integral(s, lobe, o.theta_rad, a.theta_rad, sharpness, &theta);
        two_lobe_scale_at(s, false, theta, scale, unused);
        float cos_t = fmaxf(cosf(theta), 0), x = sharpness * a.cos_theta * cos_t;
        k[lobe] = two_lobe_schlick(cos_t);
        value[lobe] *= scale[lobe] * cos_t * cos_t;
        if (lobe == TWO_LOBE_R) {
            value[lobe] *= cone_lobe_bessel(x, NULL);
            continue;
        }
        /* 2 pi I0(m) / exp(kappa + x), with m the length of the sum of vectors of length kappa and x */
        float all = kappa + x, m = sqrtf(fmaxf(all * all - 2 * kappa * x * opposite, 0));
        float loss = all + m > 0 ? 2 * kappa * x * opposite / (all + m) : 0; /* all - m without cancellation */
        value[lobe] *= (float)(2 * M_PI) * s->azimuth.norm * cone_lobe_bessel(m, NULL) * expf(-loss);
    }
    for (int c = 0; c < 3; c++)
        rgb[c] = (s->c_r[c] + s->not_c_r[c] * k[TWO_LOBE_R]) * value[TWO_LOBE_R] +
                 s->c_tt[c] * s->not_c_r[c] * (1 - k[TWO_LOBE_TT]) * value[TWO_LOBE_TT];
}

const struct scattering_model scattering_two_lobe = {
    SURFACE_MODEL_ROW(two_lobe),    .prepare = prepare,
    .release = two_lobe_release,    .eval = eval,
    .sample = two_lobe_sample,      .pdf = two_lobe_pdf,
    .eval_pdf = eval_pdf,           .gaussian = gaussian,
    .lobe_rad = two_lobe_lobe_rad,  .view_of = two_lobe_view_of,
    .eval_pdf_view = eval_pdf_view, .sample_view = two_lobe_sample_view,
};
