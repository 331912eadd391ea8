#include "optimizer/report/textures/gltf_surface.h"

#include <math.h>
#include <string.h>

enum { N_THETA = 16, N_PHI = 16, N_START = 2 };
/* F0 and BASE for three channels: F0 as shares of F90, BASE relative to the albedo. ANISOTROPY: square of its strength,
 * on which the width of the lobe depends; below 0 the lobe is wide along most fibers. SHEEN has the hue of the albedo
 * or none: no row shows it where it is brightest, so that a hue of its own could be any. */
enum {
    F0,
    F90 = F0 + 3,
    ROUGHNESS,
    ANISOTROPY,
    BASE,
    SHEEN = BASE + 3,
    SHEEN_TINT,
    SHEEN_ROUGHNESS,
    COAT,
    COAT_ROUGHNESS,
    NORMAL_SCALE,
    N_UNKNOWN
};
/* Below this roughness viewers show no highlight of a lamp without size. */
static const double least_roughness = 0.05, least_cosine = 1e-3;
static const double coat_straight = 0.04; /* share of light from straight that a clear coat of glTF reflects */
static const double lower[N_UNKNOWN] = {0.0, 0.0, 0.0, 1e-3, 0.2, -1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.3, 0.0, 0.1, 0.3},
                    upper[N_UNKNOWN] = {0.5, 0.5, 0.5, 1.0, 1.0, 1.0, 1.5, 1.5, 1.5, 1.0, 1.0, 1.0, 1.0, 1.0, 2.5};
static const double start[N_START][TEXTURE_MAX_UNKNOWN] = {
    {0.07, 0.07, 0.07, 0.9, 0.42, 0.63, 0.25, 0.25, 0.25, 0.05, 0.7, 0.5, 0.02, 0.5, 1.0},
    {0.02, 0.02, 0.02, 0.2, 0.9, -0.2, 0.5, 0.5, 0.5, 0.1, 0.7, 0.7, 0.6, 0.5, 1.0}};

static double dot(const double a[3], const double b[3]) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

static double largest(const double v[3]) { return fmax(fmax(v[0], v[1]), v[2]); }

/* ---- energy ---- */

/* Share of light that a GGX lobe without Fresnel sends back, from a view: a mean over half vectors by their density. */
static double lobe_albedo(double alpha, double cos_o)
{
    enum { N_RING = 48 };
    const double sin_o = sqrt(1.0 - cos_o * cos_o), a2 = alpha * alpha;
    double sum = 0.0;
    for (int i = 0; i < N_RING; i++)
        for (int k = 0; k < N_PHI; k++) {
            const double u = (i + 0.5) / N_RING, phi = M_PI * (k + 0.5) / N_PHI;
            const double cos_h = sqrt((1.0 - u) / (1.0 + (a2 - 1.0) * u)), sin_h = sqrt(1.0 - cos_h * cos_h);
            const double half = sin_o * sin_h * cos(phi) + cos_o * cos_h, cos_i = 2.0 * half * cos_h - cos_o;
            if (!(cos_i > 0.0 && half > 0.0)) continue;
            const double masked =
                cos_i * sqrt(a2 + (1.0 - a2) * cos_o * cos_o) + cos_o * sqrt(a2 + (1.0 - a2) * cos_i * cos_i);
            sum += 2.0 * cos_i * half / (masked * cos_h);
        }
    return fmin(sum / (N_RING * N_PHI), 1.0);
}

static void fill_lobe_albedo(struct gltf_surface *g)
{
    for (int r = 0; r < GLTF_N_COSINE; r++)
        for (int i = 0; i < GLTF_N_COSINE; i++) {
            const double step = 1.0 / (GLTF_N_COSINE - 1), roughness = fmax(r * step, least_roughness);
            g->lobe_albedo[r][i] = lobe_albedo(roughness * roughness, fmax(i * step, 0.02));
        }
}

static double lobe_albedo_at(const struct gltf_surface *g, double roughness, double cosine)
{
    const double at[2] = {roughness * (GLTF_N_COSINE - 1), fmin(cosine, 1.0) * (GLTF_N_COSINE - 1)};
    int low[2];
    double part[2];
    for (int a = 0; a < 2; a++) {
        low[a] = at[a] < GLTF_N_COSINE - 2 ? (int)at[a] : GLTF_N_COSINE - 2;
        part[a] = at[a] - low[a];
    }
    const double *r0 = g->lobe_albedo[low[0]] + low[1], *r1 = g->lobe_albedo[low[0] + 1] + low[1];
    return (1.0 - part[0]) * (r0[0] + part[1] * (r0[1] - r0[0])) + part[0] * (r1[0] + part[1] * (r1[1] - r1[0]));
}

static double rough(const struct gltf_surface *g, double root_spread)
{
    return fmin(fmax(g->roughness * root_spread, least_roughness), 1.0);
}

double gltf_surface_roughness(const struct gltf_surface *g, size_t i)
{
    return rough(g, sqrt((double)g->maps->spread[i]));
}

/* ---- sheen ---- */

/* Estevez and Kulla 2017, equation 2, times the visibility. */
static double sheen_of(double roughness, double cos_h, double cos_i, double cos_o)
{
    const double inverse = 1.0 / (roughness * roughness), sine2 = fmax(1.0 - cos_h * cos_h, 0.0);
    const double density = (2.0 + inverse) * pow(sine2, 0.5 * inverse) / (2.0 * M_PI);
    return density * fmin(0.25 / (cos_i + cos_o - cos_i * cos_o), 1.0);
}

/* Mean over equal steps of sin^2 of the angle, which have the same cosine-weighted solid angle. */
static double sheen_albedo(double roughness, double cos_o)
{
    double sum = 0.0;
    const double sin_o = sqrt(1.0 - cos_o * cos_o);
    for (int i = 0; i < N_THETA; i++)
        for (int k = 0; k < N_PHI; k++) {
            const double sine = sqrt((i + 0.5) / N_THETA), cosine = sqrt(1.0 - sine * sine),
                         phi = M_PI * (k + 0.5) / N_PHI;
            const double length2 = 2.0 + 2.0 * (sine * sin_o * cos(phi) + cosine * cos_o);
            const double cos_h = (cosine + cos_o) / sqrt(length2);
            sum += sheen_of(roughness, fmin(cos_h, 1.0), cosine, cos_o);
        }
    return fmin(M_PI * sum / (N_THETA * N_PHI), 1.0);
}

void gltf_surface_set_sheen(struct gltf_surface *g, double sheen_roughness)
{
    g->sheen_roughness = sheen_roughness;
    for (int i = 0; i < GLTF_N_COSINE; i++)
        g->sheen_albedo[i] = sheen_albedo(sheen_roughness, fmax((double)i / (GLTF_N_COSINE - 1), least_cosine));
}

static double albedo_at(const struct gltf_surface *g, double cosine)
{
    const double x = fmin(cosine, 1.0) * (GLTF_N_COSINE - 1);
    const int i = x < GLTF_N_COSINE - 2 ? (int)x : GLTF_N_COSINE - 2;
    return g->sheen_albedo[i] + (x - i) * (g->sheen_albedo[i + 1] - g->sheen_albedo[i]);
}

/* ---- microfacets ---- */

/* Density of the half vector times the visibility, for the widths at and ab of the lobe and parts along and beside the
 * direction of at, of the directions to lamp and camera and of the half vector. cosine: with the normal. */
static double lobe_of(double at, double ab, const double along[3], const double beside[3], const double cosine[3])
{
    const double q = pow(along[2] / at, 2.0) + pow(beside[2] / ab, 2.0) + cosine[2] * cosine[2];
    const double masked = cosine[0] * sqrt(pow(at * along[1], 2.0) + pow(ab * beside[1], 2.0) + cosine[1] * cosine[1]) +
                          cosine[1] * sqrt(pow(at * along[0], 2.0) + pow(ab * beside[0], 2.0) + cosine[0] * cosine[0]);
    return 0.5 / (M_PI * at * ab * q * q * masked);
}

/* A lobe with anisotropy has the frame of the mesh, turned, where only the normal is that of the map; one without has
 * the frame of the map. */
static double microfacets(const struct gltf_surface *g, const struct texture_sample *s, const double w[3][3],
                          const double cosine[3])
{
    const double roughness = rough(g, s->root_spread), ab = roughness * roughness,
                 at = ab + (1.0 - ab) * g->anisotropy * g->anisotropy;
    const double x = cos(g->rotation_rad), y = sin(g->rotation_rad);
    double along[3], beside[3];
    for (int k = 0; k < 3; k++) {
        along[k] = g->anisotropy > 0.0 ? x * w[k][0] + y * w[k][1] : dot(w[k], s->tangent);
        beside[k] = g->anisotropy > 0.0 ? x * w[k][1] - y * w[k][0] : dot(w[k], s->bitangent);
    }
    return lobe_of(at, ab, along, beside, cosine);
}

/* The coat alone, on the plane of the cloth. half: cosine between the half vector and a direction. */
static double coat_of(const struct gltf_surface *g, const double w[3][3], double half)
{
    const double alpha = g->coat_roughness * g->coat_roughness, a2 = alpha * alpha, i = w[0][2], o = w[1][2];
    const double fresnel = coat_straight + (1.0 - coat_straight) * pow(1.0 - half, 5.0);
    const double masked = i * sqrt(a2 + (1.0 - a2) * o * o) + o * sqrt(a2 + (1.0 - a2) * i * i);
    return fresnel * a2 / (M_PI * pow(w[2][2] * w[2][2] * (a2 - 1.0) + 1.0, 2.0)) * 0.5 / fmax(masked, 1e-9);
}

void gltf_surface_reflect(const void *surface, const struct texture_sample *s, const double wi[3], const double wo[3],
                          double rgb[3])
{
    const struct gltf_surface *g = surface;
    const double sum[3] = {wi[0] + wo[0], wi[1] + wo[1], wi[2] + wo[2]}, length = fmax(sqrt(dot(sum, sum)), 1e-9);
    const double w[3][3] = {
        {wi[0], wi[1], wi[2]}, {wo[0], wo[1], wo[2]}, {sum[0] / length, sum[1] / length, sum[2] / length}};
    const double cosine[3] = {fmax(dot(wi, s->normal), 0.0), fmax(dot(wo, s->normal), least_cosine),
                              fmin(fmax(dot(w[2], s->normal), 0.0), 1.0)};
    const double half = fmin(fmax(dot(wo, w[2]), 0.0), 1.0), grazing = pow(1.0 - half, 5.0);
    const double coat = M_PI * g->coat * coat_of(g, w, half) * wi[2],
                 uncoated = 1.0 - g->coat * (coat_straight + (1.0 - coat_straight) * pow(1.0 - wo[2], 5.0));
    const double lobe = cosine[0] > 0.0 ? microfacets(g, s, w, cosine) : 0.0;
    const double sheen = cosine[0] > 0.0 ? sheen_of(g->sheen_roughness, cosine[2], cosine[0], cosine[1]) : 0.0;
    const double below = 1.0 - largest(g->sheen) * fmax(albedo_at(g, cosine[0]), albedo_at(g, cosine[1]));
    const double lost = 1.0 / lobe_albedo_at(g, rough(g, s->root_spread), cosine[1]) - 1.0;
    for (int c = 0; c < 3; c++) {
        const double fresnel = g->f0[c] + (g->f90 - g->f0[c]) * grazing, base = g->base[c] * s->share[c];
        rgb[c] = below * (base * (1.0 - fresnel) + M_PI * fresnel * lobe * (1.0 + g->f0[c] * lost)) +
                 M_PI * g->sheen[c] * sheen;
        rgb[c] = coat + uncoated * cosine[0] * rgb[c];
    }
}

/* ---- fit ---- */

static void take(void *surface, const double *x)
{
    struct gltf_surface *g = surface;
    const double bright = fmax(largest(g->means.albedo), 1e-6);
    g->f90 = x[F90];
    g->roughness = x[ROUGHNESS];
    g->anisotropy = sqrt(fabs(x[ANISOTROPY]));
    g->rotation_rad = g->across_rad + (x[ANISOTROPY] < 0.0 ? M_PI_2 : 0.0);
    for (int c = 0; c < 3; c++) {
        g->f0[c] = x[F0 + c] * x[F90]; /* an extension has the factor f90 for both */
        g->base[c] = fmin(x[BASE + c] * g->means.albedo[c], 1.0);
        g->sheen[c] = x[SHEEN] * (1.0 - x[SHEEN_TINT] * (1.0 - g->means.albedo[c] / bright));
    }
    g->coat = x[COAT];
    g->coat_roughness = x[COAT_ROUGHNESS];
    g->normal_scale = x[NORMAL_SCALE];
    gltf_surface_set_sheen(g, x[SHEEN_ROUGHNESS]);
}

static void look(void *surface, const double wo[3]) { (void)surface, (void)wo; }

/* Direction across most fibers, as they are seen. */
static double most_across(const struct texture_maps *m)
{
    double twice[2] = {0.0, 0.0};
    for (size_t i = 0; i < m->width * m->height; i++) {
        twice[0] -= (double)m->coherence[i] * cos(2.0 * (double)m->direction_rad[i]);
        twice[1] -= (double)m->coherence[i] * sin(2.0 * (double)m->direction_rad[i]);
    }
    return 0.5 * atan2(twice[1], twice[0]);
}

static double normal_scale(const void *surface) { return ((const struct gltf_surface *)surface)->normal_scale; }

static double sum_of(const struct texture_error *e) { return e->row_rel_rms + e->afar_rel_rms + e->hemisphere_rel_rms; }

status gltf_surface_fit(struct gltf_surface *g, struct texture_maps *maps, const struct texture_target *target,
                        struct error *err)
{
    double least[N_UNKNOWN], most[N_UNKNOWN];
    const struct texture_model model = {N_UNKNOWN,    N_START, least, most, start, take, look, gltf_surface_reflect,
                                        normal_scale, true};
    memcpy(least, lower, sizeof least);
    memcpy(most, upper, sizeof most);
    g->across_rad = most_across(maps);
    fill_lobe_albedo(g);
    struct gltf_surface round = *g;
    status s = texture_fit_run(&model, g, maps, &g->means, target, &g->error, err);
    least[ANISOTROPY] = most[ANISOTROPY] = 0.0;
    if (s == STATUS_OK) s = texture_fit_run(&model, &round, maps, &g->means, target, &round.error, err);
    if (s == STATUS_OK && sum_of(&round.error) < sum_of(&g->error)) {
        struct texture_error worse = g->error;
        *g = round;
        round.error = worse;
    }
    texture_error_release(&round.error);
    if (s == STATUS_OK) texture_maps_scale_normals(maps, g->normal_scale);
    return s;
}

void gltf_surface_release(struct gltf_surface *g) { texture_error_release(&g->error); }
