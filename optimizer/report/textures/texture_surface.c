#include "optimizer/report/textures/texture_surface.h"
#include "renderer/scattering/fresnel.h"

#include <math.h>

/* Index 1.5 reflects so much of the light that comes straight. */
static const double straight = 0.04, least_roughness = 0.05;
enum { N_UNKNOWN = 3, N_THETA = 12, N_PHI = 16, N_START = 3 };
static const double lower[N_UNKNOWN] = {0.0, 0.3, 0.0}, upper[N_UNKNOWN] = {12.0, 1.0, 0.95};
static const double start[N_START][TEXTURE_MAX_UNKNOWN] = {{1.0, 0.5, 0.3}, {4.0, 0.4, 0.8}, {0.3, 0.8, 0.5}};

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

double texture_fresnel(double cosine, double share)
{
    double root = sqrt(fmin(share, 0.98)), eta = (1.0 + root) / (1.0 - root);
    return fresnel_unpolarised(cosine, eta, NULL);
}

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

/* D G F / (4 cos cos) */
static double microfacets(const double wi[3], const double wo[3], const struct texture_sample *s, double roughness,
                          double anisotropy, double weight)
{
    double h[3] = {wi[0] + wo[0], wi[1] + wo[1], wi[2] + wo[2]}, length = sqrt(dot(h, h));
    double cos_i = dot(wi, s->normal), cos_o = dot(wo, s->normal), narrow = 1.0 - anisotropy;
    if (cos_i <= 0.0 || cos_o <= 0.0 || length <= 0.0) return 0.0;
    for (int a = 0; a < 3; a++) h[a] /= length;
    double ax = roughness * roughness * sqrt(2.0 / (1.0 + narrow * narrow)), ay = narrow * ax;
    double g = 1.0 / (1.0 + texture_smith(s, wi, ax, ay) + texture_smith(s, wo, ax, ay));
    return texture_ggx(s, h, ax, ay) * g * texture_fresnel(dot(wi, h), weight * straight) / (4.0 * cos_i * cos_o);
}

/* Share of the light from wo that the microfacets of a flat surface reflect. */
static double specular_albedo(const double wo[3], double roughness, double weight)
{
    static const struct texture_sample flat = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, 1.0, 0.0};
    double sum = 0.0;
    for (int i = 0; i < N_THETA; i++)
        for (int k = 0; k < N_PHI; k++) { /* equal steps of sin^2, which have the same cos-weighted solid angle */
            const double sine = sqrt((i + 0.5) / N_THETA), phi = 2.0 * M_PI * (k + 0.5) / N_PHI;
            const double wi[3] = {sine * cos(phi), sine * sin(phi), sqrt(1.0 - sine * sine)};
            sum += microfacets(wi, wo, &flat, roughness, 0.0, weight) * M_PI / (N_THETA * N_PHI);
        }
    return fmin(sum, 0.99);
}

double texture_surface_base(const struct texture_surface *t, size_t channel)
{
    return fmax(t->means.albedo[channel] - t->specular_albedo, 0.0) / (1.0 - t->specular_albedo);
}

static void take(void *surface, const double *x)
{
    static const double down[3] = {0.0, 0.0, 1.0};
    struct texture_surface *t = surface;
    t->weight = x[0];
    t->roughness = x[1];
    t->anisotropy = x[2];
    t->specular_albedo = specular_albedo(down, t->roughness, t->weight);
}

static void look(void *surface, const double wo[3])
{
    struct texture_surface *t = surface;
    t->kept = 1.0 - specular_albedo(wo, t->roughness, t->weight);
}

static void reflect(const void *surface, const struct texture_sample *s, const double wi[3], const double wo[3],
                    double rgb[3])
{
    const struct texture_surface *t = surface;
    const double cos_i = fmax(dot(wi, s->normal), 0.0);
    const double shine =
        M_PI * microfacets(wi, wo, s, rough(t, s->root_spread), t->anisotropy * s->coherence, t->weight);
    for (size_t c = 0; c < 3; c++) rgb[c] = cos_i * (t->kept * texture_surface_base(t, c) + shine);
}

status texture_surface_fit(struct texture_surface *t, const struct report *report, const struct pipeline_model *m,
                           struct error *err)
{
    const struct texture_model model = {N_UNKNOWN, N_START, lower, upper, start, take, look, reflect};
    return texture_fit_run(&model, t, t->maps, &t->means, report, m, t->rel_rms, err);
}
