/* The energy-conserving longitudinal lobe (d'Eon et al. 2011, "An energy-conserving hair reflectance model", section
 * 3.1): light on the cone th_o = -th_i, blurred on the sphere by a von Mises-Fisher density of concentration k.
 *     M(th_i, th_o) = k / (2 sinh k) exp(-k sin th_i sin th_o) I0(k cos th_i cos th_o),   k = 1 / beta^2
 * Symmetric; the integral of M cos th d th over either angle is exactly 1. Models divide it by max(cos th_i, cos th_o):
 * the light that leaves is then never more than the light that came, from either side, reciprocity stays, and sampling
 * weights are bounded. (Division by cos th_o alone, as published, is lossless but unbounded for views along the fiber.)
 *
 * No angles are computed: 1 - cos(th_i + th_o) comes from sines and cosines without cancellation. I0 and I1 are scaled
 * by exp(-x); polynomials of Abramowitz and Stegun 9.8.1-9.8.4, relative error 2e-7.
 */
#ifndef SELVEDGE_RENDERER_CONE_LOBE_H
#define SELVEDGE_RENDERER_CONE_LOBE_H

#include <math.h>
#include <stddef.h>

struct cone_lobe {
    float beta_rad, kappa;
    float norm;  /* k / (1 - exp(-2 k)) */
    float exp_2; /* exp(-2 k) */
};

static inline void cone_lobe_init(struct cone_lobe *m, double beta_rad)
{
    double k = 1 / (beta_rad * beta_rad);
    m->beta_rad = (float)beta_rad;
    m->kappa = (float)k;
    m->exp_2 = (float)exp(-2 * k);
    m->norm = (float)(k / -expm1(-2 * k));
}

/* exp(-x) I0(x), and 1 - I1(x) / I0(x) when wanted. */
static inline float cone_lobe_bessel(float x, float *deficit)
{
    float i0;
    if (x < 3.75f) {
        float t = x * (1 / 3.75f), u = t * t, e = expf(-x);
        i0 = e * (1 + u * (3.5156229f +
                           u * (3.0899424f + u * (1.2067492f + u * (0.2659732f + u * (0.0360768f + u * 0.0045813f))))));
        if (deficit != NULL) {
            float i1 =
                e * x *
                (0.5f +
                 u * (0.87890594f +
                      u * (0.51498869f + u * (0.15084934f + u * (0.02658733f + u * (0.00301532f + u * 0.00032411f))))));
            *deficit = 1 - i1 / i0;
        }
        return i0;
    }
    float y = 1 / x, u = 3.75f * y, r = 1 / sqrtf(x);
    i0 = 0.39894228f +
         u * (0.01328592f +
              u * (0.00225319f +
                   u * (-0.00157565f +
                        u * (0.00916281f +
                             u * (-0.02057706f + u * (0.02635537f + u * (-0.01647633f + u * 0.00392377f)))))));
    if (deficit != NULL) {
        if (x > 12) { /* asymptotic: the difference of two numbers close to 1 would lose its digits */
            *deficit = y * (0.5f + y * (0.125f + y * (0.125f + y * (0.1953125f + y * (0.40625f + y * 1.0478516f)))));
        } else {
            float i1 =
                0.39894228f +
                u * (-0.03988024f +
                     u * (-0.00362018f +
                          u * (0.00163801f +
                               u * (-0.01031555f +
                                    u * (0.02282967f + u * (-0.02895312f + u * (0.01787654f - u * 0.00420059f)))))));
            *deficit = 1 - i1 / i0;
        }
    }
    return i0 * r;
}

/* M, and d ln M / d beta when wanted. sin and cos of both longitudinal angles, cosines >= 0. */
static inline float cone_lobe_eval(const struct cone_lobe *m, float sin_i, float cos_i, float sin_o, float cos_o,
                                   float *score)
{
    float s = sin_i + sin_o, c = cos_i - cos_o, off = 0.5f * (s * s + c * c); /* 1 - cos(th_i + th_o) */
    float cc = cos_i * cos_o, deficit;
    float i0 = cone_lobe_bessel(m->kappa * cc, score != NULL ? &deficit : NULL);
    if (score != NULL) *score = -2 / m->beta_rad * (1 - 2 * m->exp_2 * m->norm - m->kappa * (off + cc * deficit));
    return m->norm * expf(-m->kappa * off) * i0;
}

/* sin th_i for a given th_o, density M with respect to sin th_i; u in [0, 1)^2. */
static inline float cone_lobe_sample(const struct cone_lobe *m, float sin_o, float cos_o, float u, float v)
{
    float turn = -logf(fmaxf(u, 3e-8f) * (1 - m->exp_2) + m->exp_2) / m->kappa; /* 1 - cos of the angle off the cone */
    turn = fminf(turn, 2);
    float sine = sqrtf(turn * (2 - turn));
    float s = -(1 - turn) * sin_o + sine * cosf((float)(2 * M_PI) * v) * cos_o;
    return fminf(fmaxf(s, -1), 1);
}

#endif
