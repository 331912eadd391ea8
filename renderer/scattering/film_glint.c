#include "renderer/scattering/film_glint.h"

#include <math.h>

#define GLINT_SHARE 0.7f
/* Cosine of the view below which a footprint grows no longer along it. */
#define LEAST_COS 0.05f

void film_glint_see(struct film_glint *g, const float center_um[2], float pixel_um, const float wo[3])
{
    const float flat2 = wo[0] * wo[0] + wo[2] * wo[2], cosine = fmaxf(fabsf(wo[1]), LEAST_COS),
                p2 = pixel_um * pixel_um, longer = flat2 > 1e-8f ? p2 * (1 / (cosine * cosine) - 1) / flat2 : 0;
    for (int a = 0; a < 2; a++) g->at.center_um[a] = center_um[a];
    g->at.covariance_um2[0] = p2 + longer * wo[0] * wo[0];
    g->at.covariance_um2[1] = longer * wo[0] * wo[2];
    g->at.covariance_um2[2] = p2 + longer * wo[2] * wo[2];
}

/* Takes white out of a color until no channel is below 0; its luminance stays (Rec. 709). */
static void into_gamut(float rgb[3])
{
    const float white = 0.2126f * rgb[0] + 0.7152f * rgb[1] + 0.0722f * rgb[2];
    const float least = fminf(fminf(rgb[0], rgb[1]), rgb[2]);
    if (least >= 0) return;
    const float share = white > 0 ? white / (white - least) : 0;
    for (int c = 0; c < 3; c++) rgb[c] = fmaxf(white + share * (rgb[c] - white), 0);
}

/* f_r by waves: of a perfect mirror, times Fresnel's factor of the film's color. */
static void eval_waves(const struct film_material *m, const struct film_glint *g, const float wi[3], const float wo[3],
                       float cosine, float f_rgb[3])
{
    const float sign = wo[1] < 0 ? -1.0f : 1.0f, away = fmaxf(0, 1 - cosine),
                grazing = away * away * (away * away) * away;
    const struct wave_glint_query q = {{(double)g->at.center_um[0], (double)g->at.center_um[1]},
                                       {wi[0], wi[2], sign * wi[1]},
                                       {wo[0], wo[2], sign * wo[1]}};
    wave_glint_rgb(g->waves, &q, METAL_N, f_rgb);
    into_gamut(f_rgb);
    for (int c = 0; c < 3; c++) f_rgb[c] *= m->color[c] + (1 - m->color[c]) * grazing;
}

float film_glint_eval(const struct film_material *m, const struct film_glint *g, const float wi[3], const float wo[3],
                      float f_rgb[3])
{
    const float smooth = film_facets_eval(m, wi, wo, f_rgb, NULL, NULL);
    if (g->surface == NULL) return smooth;
    const float sign = wo[1] < 0 ? -1.0f : 1.0f;
    float h[3], length2 = 0, cosine = 0;
    for (int a = 0; a < 3; a++) {
        h[a] = wi[a] + wo[a];
        length2 += h[a] * h[a];
    }
    h[1] *= sign;
    if (!(length2 > 1e-12f) || !(h[1] > 0)) return (1 - GLINT_SHARE) * smooth;
    for (int a = 0; a < 3; a++) h[a] /= sqrtf(length2);
    cosine = fabsf(h[0] * wo[0] + h[1] * sign * wo[1] + h[2] * wo[2]);
    const float half[2] = {h[0], h[2]}, alpha2 = m->roughness * m->roughness,
                q = half[0] * half[0] + half[1] * half[1] + alpha2 * h[1] * h[1], d = alpha2 / ((float)M_PI * q * q),
                seen = glint_density(g->surface, &g->at, half);
    if (g->waves != NULL)
        eval_waves(m, g, wi, wo, cosine, f_rgb);
    else
        for (int c = 0; c < 3; c++) f_rgb[c] *= seen / d;
    return (1 - GLINT_SHARE) * smooth + GLINT_SHARE * seen * h[1] / (4 * fmaxf(cosine, 1e-6f));
}

void film_glint_sample(const struct film_material *m, const struct film_glint *g, const float wo[3], struct rng *rng,
                       float wi[3])
{
    float u[GLINT_N_NUMBER], half[2];
    const bool of_glints = rng_float(rng) < GLINT_SHARE;
    for (int a = 0; a < GLINT_N_NUMBER; a++) u[a] = rng_float(rng);
    if (!of_glints) {
        film_facets_sample(m, wo, u, wi);
        return;
    }
    glint_sample(g->surface, &g->at, u, half);
    const float sign = wo[1] < 0 ? -1.0f : 1.0f, r2 = half[0] * half[0] + half[1] * half[1],
                up = sqrtf(fmaxf(0, 1 - r2)), length = r2 > 1 ? sqrtf(r2) : 1,
                h[3] = {half[0] / length, sign * up, half[1] / length},
                twice = 2 * (h[0] * wo[0] + h[1] * wo[1] + h[2] * wo[2]);
    for (int a = 0; a < 3; a++) wi[a] = twice * h[a] - wo[a];
}
