#include "optimizer/report/textures/texture_principled.h"

#include <math.h>
#include <string.h>

enum { N_UNKNOWN = 6, N_START = 3, ANISOTROPY = 2 };
/* Programs that leave out the rotation of the anisotropy show another surface with it, so it must bring the error down
 * to this part. */
static const double least_gain = 0.9;
/* specular; roughness and anisotropy; base color: brightness, and how much of its grey the highlight replaces; sheen */
static const double lower[N_UNKNOWN] = {0.0, 0.3, 0.0, 0.0, 0.0, 0.0},
                    upper[N_UNKNOWN] = {1.0, 1.0, 1.0, 2.0, 1.0, 1.0};
static const double start[N_START][TEXTURE_MAX_UNKNOWN] = {
    {0.5, 0.8, 0.0, 0.9, 0.6, 0.8}, {0.3, 0.5, 0.3, 0.9, 0.1, 0.1}, {0.2, 0.9, 0.1, 0.9, 0.1, 0.8}};

static double dot(const double a[3], const double b[3]) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

static double schlick(double cosine) { return pow(fmin(fmax(1.0 - cosine, 0.0), 1.0), 5.0); }

static void take(void *surface, const double *x)
{
    struct texture_principled *p = surface;
    const struct texture_surface *t = p->open_pbr;
    p->specular = x[0];
    p->roughness = x[1] / t->roughness;
    /* without anisotropy its map is zero, whatever the factor is */
    p->anisotropy = t->anisotropy > 0.02 ? fmin(x[2] / t->anisotropy, 1.0 / t->anisotropy) : 0.0;
    const double *albedo = t->means.albedo, grey = fmin(fmin(albedo[0], albedo[1]), albedo[2]);
    for (int c = 0; c < 3; c++) p->base[c] = fmin(x[3] * (albedo[c] - x[4] * grey), 1.0);
    p->sheen = x[5];
}

static void look(void *surface, const double wo[3]) { (void)surface, (void)wo; }

/* D G F / (4 cos_o), the cosine of the light included */
static double highlight(const struct texture_principled *p, const struct texture_sample *s, const double wi[3],
                        const double wo[3], const double h[3], double roughness)
{
    const double anisotropy = fmin(p->anisotropy * p->open_pbr->anisotropy * s->coherence, 1.0);
    const double aspect = sqrt(1.0 - 0.9 * anisotropy), alpha = roughness * roughness;
    const double ax = fmax(alpha / aspect, 0.001), ay = fmax(alpha * aspect, 0.001);
    /* Smith's masking for both directions apart */
    const double g = 1.0 / ((1.0 + texture_smith(s, wi, ax, ay)) * (1.0 + texture_smith(s, wo, ax, ay)));
    return texture_ggx(s, h, ax, ay) * g * texture_fresnel(dot(wi, h), 0.08 * p->specular) / (4.0 * dot(wo, s->normal));
}

static void reflect(const void *surface, const struct texture_sample *s, const double wi[3], const double wo[3],
                    double rgb[3])
{
    static const double luminance[3] = {0.2126, 0.7152, 0.0722};
    const struct texture_principled *p = surface;
    const struct texture_surface *t = p->open_pbr;
    double h[3] = {wi[0] + wo[0], wi[1] + wo[1], wi[2] + wo[2]};
    const double length = sqrt(dot(h, h)), cos_i = dot(wi, s->normal), cos_o = dot(wo, s->normal);
    rgb[0] = rgb[1] = rgb[2] = 0.0;
    if (cos_i <= 0.0 || cos_o <= 0.0 || length <= 0.0) return;
    for (int a = 0; a < 3; a++) h[a] /= length;
    const double roughness = fmin(p->roughness * fmin(fmax(t->roughness * s->root_spread, 0.05), 1.0), 1.0);
    const double half = dot(wi, h), retro = 2.0 * roughness * half * half;
    const double i = schlick(cos_i), o = schlick(cos_o);
    const double diffuse = (1.0 - 0.5 * i) * (1.0 - 0.5 * o) + retro * (o + i + o * i * (retro - 1.0));
    const double shine = M_PI * highlight(p, s, wi, wo, h, roughness), sheen = M_PI * p->sheen * schlick(half);
    const double bright = dot(p->base, luminance);
    for (int c = 0; c < 3; c++) {
        const double tint = bright > 0.0 ? p->base[c] / bright : 1.0;
        rgb[c] = shine + cos_i * (p->base[c] * diffuse + sheen * tint);
    }
}

status texture_principled_fit(struct texture_principled *p, const struct report *report, const struct pipeline_model *m,
                              struct error *err)
{
    double most[N_UNKNOWN];
    struct texture_model model = {N_UNKNOWN, N_START, lower, most, start, take, look, reflect};
    const struct texture_surface *t = p->open_pbr;
    struct texture_principled round = *p;
    memcpy(most, upper, sizeof most);
    status s = texture_fit_run(&model, p, t->maps, &t->means, report, m, p->rel_rms, err);
    most[ANISOTROPY] = 0.0;
    if (s == STATUS_OK) s = texture_fit_run(&model, &round, t->maps, &t->means, report, m, round.rel_rms, err);
    if (s == STATUS_OK && !(p->rel_rms[0] < least_gain * round.rel_rms[0])) *p = round;
    return s;
}
