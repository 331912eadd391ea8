#include "optimizer/report/textures/gltf_surface.h"

#include <math.h>

enum { N_THETA = 16, N_PHI = 16, N_START = 4 };
enum { F0, F90, ROUGHNESS, ANISOTROPY, BRIGHTNESS, GREY, SHEEN, SHEEN_ROUGHNESS, SHEEN_TINT, NORMAL_SCALE, N_UNKNOWN };
/* Below this roughness viewers show no highlight of a lamp without size. */
static const double least_roughness = 0.05, least_cosine = 1e-3;
/* BRIGHTNESS of the base relative to the albedo, from which the share GREY of its grey is taken for the highlight. */
static const double lower[N_UNKNOWN] = {0.0, 0.0, 0.2, 0.0, 0.0, 0.0, 0.0, 0.1, 0.0, 0.3},
                    upper[N_UNKNOWN] = {0.9, 1.0, 1.0, 1.0, 2.5, 1.0, 1.0, 1.0, 1.0, 2.5};
static const double start[N_START][TEXTURE_MAX_UNKNOWN] = {{0.04, 0.5, 0.6, 0.2, 0.9, 0.3, 0.1, 0.5, 0.5, 1.0},
                                                           {0.2, 0.9, 0.4, 0.5, 0.7, 0.5, 0.05, 0.3, 0.2, 1.0},
                                                           {0.01, 0.1, 0.9, 0.1, 0.9, 0.1, 0.3, 0.8, 0.8, 1.0},
                                                           {0.05, 0.3, 0.5, 0.7, 0.6, 0.2, 0.3, 0.4, 0.8, 1.5}};

static double dot(const double a[3], const double b[3]) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

static double largest(const double v[3]) { return fmax(fmax(v[0], v[1]), v[2]); }

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

/* Density of the half vector times the visibility. The frame is the mesh's, with the normal of the map. */
static double microfacets(const struct gltf_surface *g, const struct texture_sample *s, const double w[3][3],
                          const double cosine[3])
{
    const double *n = s->normal, *t = s->tangent, strength = fmin(g->anisotropy * s->coherence, 1.0);
    const double roughness = rough(g, s->root_spread), ab = roughness * roughness,
                 at = ab + (1.0 - ab) * strength * strength;
    /* the direction in the plane of the cloth whose part along the surface is the sample's tangent */
    const double x = t[0] * n[2] - n[0] * t[2], y = t[1] * n[2] - n[1] * t[2], inverse = 1.0 / hypot(x, y);
    double along[3], beside[3];
    for (int k = 0; k < 3; k++) {
        along[k] = inverse * (x * w[k][0] + y * w[k][1]);
        beside[k] = inverse * (x * w[k][1] - y * w[k][0]);
    }
    const double q = pow(along[2] / at, 2.0) + pow(beside[2] / ab, 2.0) + cosine[2] * cosine[2];
    const double masked = cosine[0] * sqrt(pow(at * along[1], 2.0) + pow(ab * beside[1], 2.0) + cosine[1] * cosine[1]) +
                          cosine[1] * sqrt(pow(at * along[0], 2.0) + pow(ab * beside[0], 2.0) + cosine[0] * cosine[0]);
    return 0.5 / (M_PI * at * ab * q * q * masked);
}

void gltf_surface_reflect(const void *surface, const struct texture_sample *s, const double wi[3], const double wo[3],
                          double rgb[3])
{
    const struct gltf_surface *g = surface;
    const double sum[3] = {wi[0] + wo[0], wi[1] + wo[1], wi[2] + wo[2]}, length = fmax(sqrt(dot(sum, sum)), 1e-9);
    const double w[3][3] = {
        {wi[0], wi[1], wi[2]}, {wo[0], wo[1], wo[2]}, {sum[0] / length, sum[1] / length, sum[2] / length}};
    rgb[0] = rgb[1] = rgb[2] = 0.0;
    const double cosine[3] = {dot(wi, s->normal), fmax(dot(wo, s->normal), least_cosine),
                              fmin(fmax(dot(w[2], s->normal), 0.0), 1.0)};
    if (cosine[0] <= 0.0) return;
    const double half = fmin(fmax(dot(wo, w[2]), 0.0), 1.0);
    const double fresnel = g->f0 + (g->f90 - g->f0) * pow(1.0 - half, 5.0);
    const double shine = fresnel * microfacets(g, s, w, cosine);
    const double sheen = sheen_of(g->sheen_roughness, cosine[2], cosine[0], cosine[1]);
    const double below = 1.0 - largest(g->sheen) * fmax(albedo_at(g, cosine[0]), albedo_at(g, cosine[1]));
    for (int c = 0; c < 3; c++)
        rgb[c] = cosine[0] *
                 (below * (g->base[c] * s->share[c] * (1.0 - fresnel) + M_PI * shine) + M_PI * g->sheen[c] * sheen);
}

/* ---- fit ---- */

static void take(void *surface, const double *x)
{
    struct gltf_surface *g = surface;
    const double *albedo = g->means.albedo, grey = fmin(fmin(albedo[0], albedo[1]), albedo[2]),
                 bright = fmax(largest(albedo), 1e-6);
    g->f90 = x[F90];
    g->f0 = fmin(x[F0], x[F90]); /* an extension has the factor f90 for both */
    g->roughness = x[ROUGHNESS];
    g->anisotropy = x[ANISOTROPY];
    for (int c = 0; c < 3; c++) {
        g->base[c] = fmin(x[BRIGHTNESS] * (albedo[c] - x[GREY] * grey), 1.0);
        g->sheen[c] = x[SHEEN] * (1.0 - x[SHEEN_TINT] * (1.0 - albedo[c] / bright));
    }
    g->normal_scale = x[NORMAL_SCALE];
    gltf_surface_set_sheen(g, x[SHEEN_ROUGHNESS]);
}

static void look(void *surface, const double wo[3]) { (void)surface, (void)wo; }

static double normal_scale(const void *surface) { return ((const struct gltf_surface *)surface)->normal_scale; }

status gltf_surface_fit(struct gltf_surface *g, struct texture_maps *maps, const struct texture_target *target,
                        struct error *err)
{
    const struct texture_model model = {N_UNKNOWN,   N_START, lower, upper, start, take, look, gltf_surface_reflect,
                                        normal_scale};
    status s = texture_fit_run(&model, g, maps, &g->means, target, &g->error, err);
    if (s == STATUS_OK) texture_maps_scale_normals(maps, g->normal_scale);
    return s;
}

void gltf_surface_release(struct gltf_surface *g) { texture_error_release(&g->error); }
