#include "renderer/scattering/film_facets.h"

#include <math.h>

/* Both directions in the frame of the side that wo sees, [2] along its normal, with their half vector. */
struct facing {
    float i[3], o[3], h[3];
};

static void to_side(const float w[3], float sign, float out[3])
{
    out[0] = w[0];
    out[1] = w[2];
    out[2] = sign * w[1];
}

/* False: there is no half vector, or it points into the film. */
static bool face(const float wi[3], const float wo[3], struct facing *f)
{
    const float sign = wo[1] < 0 ? -1.0f : 1.0f;
    to_side(wi, sign, f->i);
    to_side(wo, sign, f->o);
    float length2 = 0;
    for (int a = 0; a < 3; a++) {
        f->h[a] = f->i[a] + f->o[a];
        length2 += f->h[a] * f->h[a];
    }
    if (!(length2 > 1e-12f) || !(f->h[2] > 0)) return false;
    for (int a = 0; a < 3; a++) f->h[a] /= sqrtf(length2);
    return true;
}

/* The slope-scaled length s of film_facets.h. */
static float stretched(const float w[3], float alpha)
{
    return sqrtf(w[2] * w[2] + alpha * alpha * (w[0] * w[0] + w[1] * w[1]));
}

/* ln f_r by alpha: q and s are as in D and in the masking. */
static float slope_by_alpha(const struct facing *f, float alpha, float q, float s_i, float s_o)
{
    const float by_s_i = alpha * (f->i[0] * f->i[0] + f->i[1] * f->i[1]) / s_i,
                by_s_o = alpha * (f->o[0] * f->o[0] + f->o[1] * f->o[1]) / s_o;
    return 2 / alpha - 4 * alpha * f->h[2] * f->h[2] / q -
           (f->o[2] * by_s_i + f->i[2] * by_s_o) / (f->o[2] * s_i + f->i[2] * s_o);
}

float film_facets_eval(const struct film_material *m, const float wi[3], const float wo[3], float f_rgb[3],
                       float by_color[3], float *by_alpha)
{
    struct facing f;
    const float alpha = m->roughness;
    for (int c = 0; c < 3; c++) f_rgb[c] = 0;
    for (int c = 0; c < 3 && by_color != NULL; c++) by_color[c] = 0;
    if (by_alpha != NULL) *by_alpha = 0;
    if (!face(wi, wo, &f)) return 0;
    const float across2 = f.h[0] * f.h[0] + f.h[1] * f.h[1], q = across2 + alpha * alpha * f.h[2] * f.h[2],
                d = alpha * alpha / ((float)M_PI * q * q), s_o = stretched(f.o, alpha), pdf = d / (2 * (f.o[2] + s_o));
    if (!(f.i[2] > 0 && f.o[2] > 0)) return pdf;
    const float s_i = stretched(f.i, alpha), masked = d / (2 * (f.o[2] * s_i + f.i[2] * s_o)),
                cosine = f.i[0] * f.h[0] + f.i[1] * f.h[1] + f.i[2] * f.h[2], away = fmaxf(0, 1 - cosine),
                grazing = away * away * (away * away) * away;
    for (int c = 0; c < 3; c++) {
        const float fresnel = m->color[c] + (1 - m->color[c]) * grazing;
        f_rgb[c] = fresnel * masked;
        if (by_color != NULL) by_color[c] = (1 - grazing) / fresnel;
    }
    if (by_alpha != NULL) *by_alpha = slope_by_alpha(&f, alpha, q, s_i, s_o);
    return pdf;
}

/* A facet that o sees, o[2] > 0: a point of the projected half disk of the stretched configuration. */
static void visible_facet(float alpha, const float o[3], const float u[2], float h[3])
{
    float v[3] = {alpha * o[0], alpha * o[1], o[2]};
    const float length = sqrtf(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
    for (int a = 0; a < 3; a++) v[a] /= length;
    const float flat = sqrtf(v[0] * v[0] + v[1] * v[1]);
    float t[3] = {1, 0, 0}, b[3];
    if (flat > 1e-7f) {
        t[0] = -v[1] / flat;
        t[1] = v[0] / flat;
    }
    for (int a = 0; a < 3; a++) b[a] = v[(a + 1) % 3] * t[(a + 2) % 3] - v[(a + 2) % 3] * t[(a + 1) % 3];
    const float r = sqrtf(u[0]), phi = (float)(2 * M_PI) * u[1], x = r * cosf(phi), s = 0.5f * (1 + v[2]);
    const float y = (1 - s) * sqrtf(fmaxf(0, 1 - x * x)) + s * r * sinf(phi), z = sqrtf(fmaxf(0, 1 - x * x - y * y));
    float l2 = 0;
    for (int a = 0; a < 3; a++) h[a] = x * t[a] + y * b[a] + z * v[a];
    h[0] *= alpha;
    h[1] *= alpha;
    h[2] = fmaxf(h[2], 1e-7f);
    for (int a = 0; a < 3; a++) l2 += h[a] * h[a];
    for (int a = 0; a < 3; a++) h[a] /= sqrtf(l2);
}

void film_facets_sample(const struct film_material *m, const float wo[3], const float u[2], float wi[3])
{
    const float sign = wo[1] < 0 ? -1.0f : 1.0f;
    float o[3], h[3], i[3];
    to_side(wo, sign, o);
    visible_facet(m->roughness, o, u, h);
    const float twice = 2 * (o[0] * h[0] + o[1] * h[1] + o[2] * h[2]);
    for (int a = 0; a < 3; a++) i[a] = twice * h[a] - o[a];
    wi[0] = i[0];
    wi[1] = sign * i[2];
    wi[2] = i[1];
}
