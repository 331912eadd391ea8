#include "optimizer/report/textures/texture_surface.h"
#include "optimizer/report/textures/zeltner_sheen.h"
#include "renderer/scattering/fresnel.h"

#include <math.h>
#include <string.h>

/* OpenPBR's default coat: an index of 1.6, which reflects this share. */
static const double coat_ior = 1.6, coat_straight = 0.0532544, least_roughness = 0.05;
/* Least part of the reflected light that the base keeps: without it the maps of dark cloths would be black. */
#define LEAST_BASE 0.05
enum { N_THETA = 10, N_PHI = 12 };
enum {
    SPECULAR,
    SPECULAR_COLOR, /* three channels */
    ROUGHNESS = SPECULAR_COLOR + 3,
    ANISOTROPY,
    BASE, /* over the reflected share of even light; three channels, as of fuzz */
    FUZZ = BASE + 3,
    FUZZ_ROUGHNESS = FUZZ + 3,
    COAT,
    COAT_ROUGHNESS,
    NORMAL_SCALE,
    N_UNKNOWN,
    N_START = 3
};
static const double lower[N_UNKNOWN] = {1e-4,       0.0, 0.0, 0.0, 0.2, 0.0, LEAST_BASE, LEAST_BASE,
                                        LEAST_BASE, 0.0, 0.0, 0.0, 0.1, 0.0, 0.1,        0.3},
                    upper[N_UNKNOWN] = {0.25, 1.0, 1.0, 1.0, 1.0, 0.95, 1.5, 1.5,
                                        1.5,  1.0, 1.0, 1.0, 1.0, 1.0,  1.0, 2.5};
static const double start[N_START][TEXTURE_MAX_UNKNOWN] = {
    {0.04, 0.9, 0.9, 0.9, 0.6, 0.4, 0.6, 0.6, 0.6, 0.05, 0.05, 0.05, 0.5, 0.2, 0.5, 1.0},
    {0.02, 0.9, 0.9, 0.9, 0.7, 0.5, 0.8, 0.8, 0.8, 0.15, 0.15, 0.15, 0.9, 0.05, 0.4, 0.8},
    {0.06, 0.9, 0.9, 0.9, 0.5, 0.6, 0.2, 0.2, 0.2, 0.05, 0.05, 0.05, 0.55, 0.0, 0.5, 1.6}};

static double dot(const double a[3], const double b[3]) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

/* The width of the lobe, roughness squared, goes with the spread of the slopes. */
static double rough(const struct texture_surface *t, double root_spread)
{
    return fmin(fmax(t->roughness * root_spread, least_roughness), 1.0);
}

double texture_surface_roughness(const struct texture_surface *t, size_t i)
{
    return rough(t, sqrt((double)t->maps->spread[i]));
}

double texture_surface_anisotropy(const struct texture_surface *t, size_t i)
{
    return t->anisotropy * (double)t->maps->coherence[i];
}

static double index_of(double straight)
{
    const double root = sqrt(fmin(straight, 0.98));
    return (1.0 + root) / (1.0 - root);
}

double texture_fresnel(double cosine, double straight) { return fresnel_unpolarised(cosine, index_of(straight), NULL); }

double texture_smith(const struct texture_sample *s, const double w[3], double ax, double ay)
{
    double x = dot(w, s->tangent) * ax, y = dot(w, s->bitangent) * ay, z = dot(w, s->normal);
    return 0.5 * (sqrt(1.0 + (x * x + y * y) / (z * z)) - 1.0);
}

double texture_ggx(const struct texture_sample *s, const double h[3], double ax, double ay)
{
    double x = dot(h, s->tangent) / ax, y = dot(h, s->bitangent) / ay, z = dot(h, s->normal);
    return 1.0 / (M_PI * ax * ay * (x * x + y * y + z * z) * (x * x + y * y + z * z));
}

/* ---- microfacets ---- */

/* Both directions, and the half vector between them, above the surface. */
struct meeting {
    const double *wi, *wo;
    double half[3], cos_i, cos_o, cos_half; /* cos_half: between the half vector and either of them */
};

static bool meet(const struct texture_sample *s, const double wi[3], const double wo[3], struct meeting *m)
{
    *m = (struct meeting){.wi = wi, .wo = wo, .cos_i = dot(wi, s->normal), .cos_o = dot(wo, s->normal)};
    for (int a = 0; a < 3; a++) m->half[a] = wi[a] + wo[a];
    const double length = sqrt(dot(m->half, m->half));
    if (m->cos_i <= 0.0 || m->cos_o <= 0.0 || length <= 0.0) return false;
    for (int a = 0; a < 3; a++) m->half[a] /= length;
    m->cos_half = dot(wi, m->half);
    return true;
}

/* D G / (4 cos_o): of a white lobe, the cosine of the light included */
static double microfacets(const struct texture_sample *s, const struct meeting *m, double roughness, double anisotropy)
{
    const double narrow = 1.0 - anisotropy, ax = roughness * roughness * sqrt(2.0 / (1.0 + narrow * narrow)),
                 ay = fmax(narrow, 1e-3) * ax;
    const double g = 1.0 / (1.0 + texture_smith(s, m->wi, ax, ay) + texture_smith(s, m->wo, ax, ay));
    return texture_ggx(s, m->half, ax, ay) * g / (4.0 * m->cos_o);
}

/* Shares of the light from directions of all cosines that the microfacets of a flat surface reflect. */
static void set_albedo(double roughness, double straight, struct texture_lobe_albedo *out)
{
    static const struct texture_sample flat = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, 1.0, 0.0, {1, 1, 1}, 1.0};
    for (int j = 0; j < TEXTURE_N_COSINE; j++) {
        const double cosine = fmax((double)j / (TEXTURE_N_COSINE - 1), 0.02),
                     wo[3] = {sqrt(1.0 - cosine * cosine), 0.0, cosine};
        double lobe = 0.0, white = 0.0;
        for (int i = 0; i < N_THETA; i++)
            for (int k = 0; k < N_PHI; k++) { /* equal steps of sin^2, which have the same cos-weighted solid angle */
                const double sine = sqrt((i + 0.5) / N_THETA), phi = M_PI * (k + 0.5) / N_PHI;
                const double wi[3] = {sine * cos(phi), sine * sin(phi), sqrt(1.0 - sine * sine)};
                struct meeting m;
                if (!meet(&flat, wi, wo, &m)) continue;
                const double value = microfacets(&flat, &m, roughness, 0.0) * M_PI / (N_THETA * N_PHI * m.cos_i);
                lobe += value * texture_fresnel(m.cos_half, straight);
                white += value;
            }
        out->white[j] = fmin(fmax(white, 0.05), 1.0);
        out->lobe[j] = fmin(lobe, 0.99 * out->white[j]);
    }
}

static double at_cosine(const double *value, double cosine)
{
    const double place = fmin(fmax(cosine, 0.0), 1.0) * (TEXTURE_N_COSINE - 1);
    const size_t k = (size_t)fmin(floor(place), TEXTURE_N_COSINE - 2);
    return value[k] + (place - (double)k) * (value[k + 1] - value[k]);
}

/* Factor by which light that is reflected more than once makes a lobe of reflectance f brighter. */
static double compensation(const struct texture_lobe_albedo *a, double cosine, double f)
{
    const double white = at_cosine(a->white, cosine);
    return 1.0 + f * (1.0 - white) / white;
}

/* Share of the light that a lobe leaves to what is below. */
static double passed(const struct texture_lobe_albedo *a, double cosine)
{
    const double lobe = at_cosine(a->lobe, cosine), white = at_cosine(a->white, cosine);
    return fmax(1.0 - lobe * compensation(a, cosine, lobe / white), 0.0);
}

/* ---- layers ---- */

static double fuzz_weight(const struct texture_surface *t) { return fmax(fmax(t->fuzz[0], t->fuzz[1]), t->fuzz[2]); }

/* Roughness of the dielectric under the coat. */
static double coated(const struct texture_surface *t, double roughness)
{
    const double r = roughness * roughness, c = t->coat_roughness * t->coat_roughness;
    const double under = sqrt(sqrt(fmin(r * r + 2.0 * c * c, 1.0)));
    return roughness + t->coat_weight * (under - roughness);
}

static double below_fuzz(const struct texture_surface *t, double cosine)
{
    return 1.0 - fuzz_weight(t) * zeltner_sheen_albedo(cosine, t->fuzz_roughness);
}

double texture_surface_kept(const struct texture_surface *t)
{
    return below_fuzz(t, 1.0) * (1.0 - t->coat_weight * (1.0 - passed(&t->coat_albedo, 1.0))) *
           passed(&t->specular_albedo, 1.0);
}

void texture_surface_reflect(const void *surface, const struct texture_sample *s, const double wi[3],
                             const double wo[3], double rgb[3])
{
    const struct texture_surface *t = surface;
    struct meeting m;
    rgb[0] = rgb[1] = rgb[2] = 0.0;
    if (!meet(s, wi, wo, &m)) return;
    const double local_i[3] = {dot(wi, s->tangent), dot(wi, s->bitangent), m.cos_i},
                 local_o[3] = {dot(wo, s->tangent), dot(wo, s->bitangent), m.cos_o};
    const double of_coat = texture_fresnel(m.cos_half, coat_straight),
                 of_specular = texture_fresnel(m.cos_half, t->specular);
    const double coat = t->coat_weight * of_coat * compensation(&t->coat_albedo, m.cos_o, of_coat) *
                        microfacets(s, &m, t->coat_roughness, 0.0);
    const double shine = of_specular * compensation(&t->specular_albedo, m.cos_o, of_specular) *
                         microfacets(s, &m, coated(t, rough(t, s->root_spread)), t->anisotropy * s->coherence);
    const double under_fuzz = below_fuzz(t, m.cos_o),
                 under_coat = 1.0 - t->coat_weight * (1.0 - passed(&t->coat_albedo, m.cos_o)),
                 diffuse = m.cos_i / M_PI * passed(&t->specular_albedo, m.cos_o);
    const double fuzz =
        zeltner_sheen_albedo(m.cos_o, t->fuzz_roughness) * zeltner_sheen_density(local_i, local_o, t->fuzz_roughness);
    for (int c = 0; c < 3; c++)
        rgb[c] = M_PI * (t->fuzz[c] * fuzz + under_fuzz * (coat + under_coat * (shine * t->specular_color[c] +
                                                                                diffuse * t->base[c] * s->share[c])));
}

/* ---- fit ---- */

static void take(void *surface, const double *x)
{
    struct texture_surface *t = surface;
    t->specular = x[SPECULAR];
    for (int c = 0; c < 3; c++) t->specular_color[c] = x[SPECULAR_COLOR + c];
    t->roughness = x[ROUGHNESS];
    t->anisotropy = x[ANISOTROPY];
    for (int c = 0; c < 3; c++) {
        t->base[c] = fmin(x[BASE + c] * t->means.albedo[c], 1.0);
        t->fuzz[c] = x[FUZZ + c];
    }
    t->fuzz_roughness = x[FUZZ_ROUGHNESS];
    t->coat_weight = x[COAT];
    t->coat_roughness = x[COAT_ROUGHNESS];
    t->normal_scale = x[NORMAL_SCALE];
    set_albedo(coated(t, t->roughness), t->specular, &t->specular_albedo);
    set_albedo(t->coat_roughness, coat_straight, &t->coat_albedo);
}

static void look(void *surface, const double wo[3]) { (void)surface, (void)wo; }

static double normal_scale(const void *surface) { return ((const struct texture_surface *)surface)->normal_scale; }

status texture_surface_fit(struct texture_surface *t, struct texture_maps *maps, const struct texture_target *target,
                           struct error *err)
{
    const struct texture_model model = {N_UNKNOWN,   N_START, lower, upper, start, take, look, texture_surface_reflect,
                                        normal_scale};
    status s = texture_fit_run(&model, t, maps, &t->means, target, &t->error, err);
    if (s == STATUS_OK) texture_maps_scale_normals(maps, t->normal_scale);
    return s;
}

void texture_surface_release(struct texture_surface *t) { texture_error_release(&t->error); }

/* The coat lowers the contrast of indices: the dielectric is seen with mix(ior, ior / coat_ior, coat_weight). */
struct texture_open_pbr texture_surface_inputs(const struct texture_surface *t)
{
    const double lowers = 1.0 - t->coat_weight * (1.0 - 1.0 / coat_ior), ior = index_of(t->specular) / lowers,
                 least = t->coat_weight > 0.0 ? coat_ior : 1.0;
    struct texture_open_pbr in = {fmax(ior, least), 1.0, coat_ior, fuzz_weight(t)};
    if (ior < least) {
        const double seen = least * lowers, root = (seen - 1.0) / (seen + 1.0);
        in.specular_weight = t->specular / (root * root);
    }
    return in;
}

void texture_surface_list(const struct texture_surface *t, struct texture_input input[TEXTURE_N_INPUT])
{
    const struct texture_open_pbr in = texture_surface_inputs(t);
    const double *s = t->specular_color, unit = in.fuzz_weight > 0.0 ? in.fuzz_weight : 1.0;
    const struct texture_input all[TEXTURE_N_INPUT] = {
        {"specular_weight", 1, {in.specular_weight}},
        {"specular_ior", 1, {in.specular_ior}},
        {"specular_color", 3, {s[0], s[1], s[2]}},
        {"coat_weight", 1, {t->coat_weight}},
        {"coat_ior", 1, {in.coat_ior}},
        {"coat_roughness", 1, {t->coat_roughness}},
        {"coat_darkening", 1, {0.0}},
        {"fuzz_weight", 1, {in.fuzz_weight}},
        {"fuzz_color", 3, {t->fuzz[0] / unit, t->fuzz[1] / unit, t->fuzz[2] / unit}},
        {"fuzz_roughness", 1, {t->fuzz_roughness}},
    };
    memcpy(input, all, sizeof all);
}
