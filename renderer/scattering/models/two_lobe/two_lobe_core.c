#include "renderer/scattering/models/two_lobe/two_lobe_core.h"

#include <math.h>

void two_lobe_state_init(struct scattering_state *s, const double *param)
{
    *s = (struct scattering_state){0};
    for (int c = 0; c < 3; c++) {
        s->c_r[c] = (float)param[TWO_LOBE_P_C_R + c];
        s->not_c_r[c] = (float)(1 - param[TWO_LOBE_P_C_R + c]);
        s->c_tt[c] = (float)param[TWO_LOBE_P_C_TT + c];
    }
    s->c_r[3] = s->not_c_r[3] = s->c_tt[3] = 1;
    for (int k = 0; k < 2; k++) {
        double beta = param[TWO_LOBE_P_BETA_R + k];
        s->beta[k] = (float)beta;
        s->peak[k] = (float)(1 / (sqrt(2 * M_PI) * beta));
        s->inv_2var[k] = (float)(0.5 / (beta * beta));
        s->inv[k] = (float)(1 / beta);
        s->inv_cube[k] = (float)(1 / (beta * beta * beta));
    }
    von_mises_init(&s->azimuth, param[TWO_LOBE_P_GAMMA_TT]);
}

void two_lobe_fill_reach(struct scattering_state *s)
{
    const double step = M_PI_2 / TWO_LOBE_N_TABLE;
    for (int i = 0; i <= TWO_LOBE_N_TABLE; i++)
        for (int k = 0; k < 2; k++) {
            s->sampling[i].near[k] = (float)erf((M_PI_2 - i * step) / (M_SQRT2 * (double)s->beta[k]));
            s->sampling[i].far[k] = (float)erf((M_PI_2 + i * step) / (M_SQRT2 * (double)s->beta[k]));
        }
}

float two_lobe_pdf(const struct scattering_state *s, const float wi[3], const float wo[3], const float *weight_rgb)
{
    struct fiber_direction di = fiber_direction_of(wi);
    struct scattering_view v;
    two_lobe_view_of(s, wo, weight_rgb, &v);
    struct two_lobe_terms t = two_lobe_terms_of(s, &di, &v.out);
    return two_lobe_pdf_terms(&di, &v, &t);
}

float two_lobe_sample_theta(const struct scattering_state *s, const float near[2], const float far[2], int lobe,
                            float theta_o, float u)
{
    bool upper_near = theta_o <= 0; /* the pole on the side of -th_o is the near one */
    float hi = upper_near ? near[lobe] : far[lobe], lo = -(upper_near ? far[lobe] : near[lobe]);
    float theta = -theta_o + (float)M_SQRT2 * s->beta[lobe] * erf_inverse(lo + u * (hi - lo));
    theta = theta > (float)-M_PI_2 ? theta : (float)-M_PI_2;
    return theta < (float)M_PI_2 ? theta : (float)M_PI_2;
}

void two_lobe_sample(const struct scattering_state *s, const float wo[3], const float *weight_rgb, const float u[3],
                     float wi[3])
{
    struct scattering_view v;
    two_lobe_view_of(s, wo, weight_rgb, &v);
    two_lobe_sample_view(s, &v, u, wi);
}

void two_lobe_view_of(const struct scattering_state *s, const float wo[3], const float *weight_rgb,
                      struct scattering_view *v)
{
    v->out = fiber_direction_of(wo);
    struct two_lobe_sampling_entry e = two_lobe_sampling_at(s, v->out.theta_rad);
    v->part[TWO_LOBE_V_P_R] = two_lobe_p_r(s, &e, weight_rgb);
    for (int k = 0; k < 2; k++) {
        v->part[TWO_LOBE_V_NEAR + k] = e.near[k];
        v->part[TWO_LOBE_V_FAR + k] = e.far[k];
    }
}

void two_lobe_sample_view(const struct scattering_state *s, const struct scattering_view *v, const float u[3],
                          float wi[3])
{
    const struct fiber_direction *dout = &v->out;
    int k = u[0] < v->part[TWO_LOBE_V_P_R] ? TWO_LOBE_R : TWO_LOBE_TT;
    float theta =
        two_lobe_sample_theta(s, v->part + TWO_LOBE_V_NEAR, v->part + TWO_LOBE_V_FAR, k, dout->theta_rad, u[1]);
    float sin_theta = sinf(theta), cos_t = cosf(theta), cos_theta = cos_t > 0 ? cos_t : 0;

    float delta = k == TWO_LOBE_R ? (float)(2 * M_PI) * u[2] : von_mises_sample(&s->azimuth, u[2]);
    float c = -cosf(delta), d = -sinf(delta); /* turned by pi: forward is behind the fiber */
    wi[0] = sin_theta;
    wi[1] = cos_theta * (c * dout->azimuth[0] - d * dout->azimuth[1]);
    wi[2] = cos_theta * (d * dout->azimuth[0] + c * dout->azimuth[1]);
}

float two_lobe_lobe_rad(const struct scattering_state *s)
{
    return s->beta[TWO_LOBE_R] < s->beta[TWO_LOBE_TT] ? s->beta[TWO_LOBE_R] : s->beta[TWO_LOBE_TT];
}

void two_lobe_release(struct scattering_state *s) { free(s); }

/* The tables are read by straight lines, which lie above a convex function, on the average by step^2 f'' / 12: taken
 * off beforehand, as energy would grow by it near the poles of narrow lobes. */
void two_lobe_level_lines(struct scattering_state *s, int lobe)
{
    float before = s->normal[1].value[lobe]; /* even */
    for (int i = 0; i < TWO_LOBE_N_TABLE; i++) {
        float here = s->normal[i].value[lobe], bend = before - 2 * here + s->normal[i + 1].value[lobe];
        before = here;
        s->normal[i].value[lobe] = here - bend / 12;
    }
}
