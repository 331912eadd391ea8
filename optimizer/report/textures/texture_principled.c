#include "optimizer/report/textures/texture_principled.h"

#include <math.h>
#include <string.h>

enum {
    SPECULAR,
    ROUGHNESS,
    ANISOTROPY,
    BASE, /* over the reflected share of even light; three channels */
    SHEEN = BASE + 3,
    SHEEN_TINT,
    NORMAL_SCALE,
    N_UNKNOWN,
    N_START = 3
};
/* Programs that leave out the rotation of the anisotropy show another surface with it, so it must bring the error down
 * to this part. */
static const double least_gain = 0.9;
/* Least part of the reflected light that the base keeps: without it the maps of dark cloths would be black. */
#define LEAST_BASE 0.05
static const double lower[N_UNKNOWN] = {0.0, 0.3, 0.0, LEAST_BASE, LEAST_BASE, LEAST_BASE, 0.0, 0.0, 0.2},
                    upper[N_UNKNOWN] = {1.0, 1.0, 1.0, 1.5, 1.5, 1.5, 3.0, 1.0, 2.5};
static const double start[N_START][TEXTURE_MAX_UNKNOWN] = {{0.5, 0.8, 0.1, 0.7, 0.7, 0.7, 0.8, 0.5, 1.0},
                                                           {0.3, 0.5, 0.3, 0.9, 0.9, 0.9, 0.1, 0.5, 1.0},
                                                           {0.8, 0.6, 0.8, 0.3, 0.3, 0.3, 0.5, 0.2, 1.0}};

static double dot(const double a[3], const double b[3]) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

static double schlick(double cosine) { return pow(fmin(fmax(1.0 - cosine, 0.0), 1.0), 5.0); }

static double rough(const struct texture_principled *p, double root_spread)
{
    return fmin(fmax(p->roughness * root_spread, 0.05), 1.0);
}

double texture_principled_roughness(const struct texture_principled *p, size_t i)
{
    return rough(p, sqrt((double)p->maps->spread[i]));
}

double texture_principled_anisotropy(const struct texture_principled *p, size_t i)
{
    return p->anisotropy * (double)p->maps->coherence[i];
}

static void take(void *surface, const double *x)
{
    struct texture_principled *p = surface;
    p->specular = x[SPECULAR];
    p->roughness = x[ROUGHNESS];
    p->anisotropy = x[ANISOTROPY];
    for (int c = 0; c < 3; c++) p->base[c] = fmin(x[BASE + c] * p->means.albedo[c], 1.0);
    p->sheen = x[SHEEN];
    p->sheen_tint = x[SHEEN_TINT];
    p->normal_scale = x[NORMAL_SCALE];
}

static double normal_scale(const void *surface) { return ((const struct texture_principled *)surface)->normal_scale; }

static void look(void *surface, const double wo[3]) { (void)surface, (void)wo; }

/* D G F / (4 cos_o), the cosine of the light included */
static double highlight(const struct texture_principled *p, const struct texture_sample *s, const double wi[3],
                        const double wo[3], const double h[3], double roughness)
{
    const double anisotropy = p->anisotropy * s->coherence;
    const double aspect = sqrt(1.0 - 0.9 * anisotropy), alpha = roughness * roughness;
    const double ax = fmax(alpha / aspect, 0.001), ay = fmax(alpha * aspect, 0.001);
    /* Smith's masking for both directions apart */
    const double g = 1.0 / ((1.0 + texture_smith(s, wi, ax, ay)) * (1.0 + texture_smith(s, wo, ax, ay)));
    return texture_ggx(s, h, ax, ay) * g * texture_fresnel(dot(wi, h), 0.08 * p->specular) / (4.0 * dot(wo, s->normal));
}

void texture_principled_reflect(const void *surface, const struct texture_sample *s, const double wi[3],
                                const double wo[3], double rgb[3])
{
    static const double luminance[3] = {0.2126, 0.7152, 0.0722};
    const struct texture_principled *p = surface;
    double h[3] = {wi[0] + wo[0], wi[1] + wo[1], wi[2] + wo[2]};
    const double length = sqrt(dot(h, h)), cos_i = dot(wi, s->normal), cos_o = dot(wo, s->normal);
    rgb[0] = rgb[1] = rgb[2] = 0.0;
    if (cos_i <= 0.0 || cos_o <= 0.0 || length <= 0.0) return;
    for (int a = 0; a < 3; a++) h[a] /= length;
    const double roughness = rough(p, s->root_spread);
    const double half = dot(wi, h), retro = 2.0 * roughness * half * half;
    const double i = schlick(cos_i), o = schlick(cos_o);
    const double diffuse = (1.0 - 0.5 * i) * (1.0 - 0.5 * o) + retro * (o + i + o * i * (retro - 1.0));
    const double shine = M_PI * highlight(p, s, wi, wo, h, roughness), sheen = M_PI * p->sheen * schlick(half);
    const double bright = dot(p->base, luminance);
    for (int c = 0; c < 3; c++) {
        const double tint = bright > 0.0 ? p->base[c] / bright : 1.0;
        rgb[c] = shine + cos_i * (p->base[c] * s->share[c] * diffuse + sheen * (1.0 + p->sheen_tint * (tint - 1.0)));
    }
}

status texture_principled_fit(struct texture_principled *p, const struct texture_target *target, struct error *err)
{
    double most[N_UNKNOWN];
    struct texture_model model = {N_UNKNOWN,   N_START, lower, most, start, take, look, texture_principled_reflect,
                                  normal_scale};
    struct texture_principled round = *p;
    memcpy(most, upper, sizeof most);
    status s = texture_fit_run(&model, p, p->maps, &p->means, target, &p->error, err);
    most[ANISOTROPY] = 0.0;
    if (s == STATUS_OK) s = texture_fit_run(&model, &round, p->maps, &p->means, target, &round.error, err);
    if (s == STATUS_OK && !(p->error.row_rel_rms < least_gain * round.error.row_rel_rms)) {
        struct texture_principled other = *p;
        *p = round;
        round = other;
    }
    texture_principled_release(&round);
    return s;
}

void texture_principled_release(struct texture_principled *p) { texture_error_release(&p->error); }
