#include "optimizer/worker/report/export/texture_surface.h"

#include "optimizer/worker/report/result_json.h"

#include <math.h>
#include <nlopt.h>
#include <string.h>

/* Index 1.5 reflects so much of the light that comes straight. */
static const double straight = 0.04, least_roughness = 0.05;
enum { N_UNKNOWN = 3, N_EVALUATION = 250, N_GRID = 16, N_THETA = 12, N_PHI = 16, N_START = 3 };
static const double lower[N_UNKNOWN] = {0.0, 0.3, 0.0}, upper[N_UNKNOWN] = {12.0, 1.0, 0.95};

struct surface_fit {
    struct texture_surface *t;
    const struct observation_set *rows;
    const struct pipeline_model *model;
};

struct frame {
    double tangent[3], bitangent[3], normal[3]; /* tangent: across the fibers, where the surface is rougher */
};

static double dot(const double a[3], const double b[3]) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

static void polar(double theta, double phi, double out[3])
{
    out[0] = sin(theta) * cos(phi);
    out[1] = sin(theta) * sin(phi);
    out[2] = cos(theta);
}

double texture_surface_roughness(const struct texture_surface *t, size_t i)
{
    /* the width of the lobe, roughness squared, goes with the spread of the slopes */
    return fmin(fmax(t->roughness * sqrt((double)t->maps->spread[i]), least_roughness), 1.0);
}

double texture_surface_anisotropy(const struct texture_surface *t, size_t i)
{
    return t->anisotropy * (double)t->maps->coherence[i];
}

/* Of a dielectric whose share of straight light is weight * 0.04. */
static double fresnel(double cosine, double weight)
{
    double root = sqrt(fmin(weight * straight, 0.98)), eta = (1.0 + root) / (1.0 - root);
    double cos_t = sqrt(fmax(1.0 - (1.0 - cosine * cosine) / (eta * eta), 0.0));
    double p = (eta * cosine - cos_t) / (eta * cosine + cos_t), s = (cosine - eta * cos_t) / (cosine + eta * cos_t);
    return 0.5 * (p * p + s * s);
}

static double lambda(const double w[3], const struct frame *f, double ax, double ay)
{
    double x = dot(w, f->tangent) * ax, y = dot(w, f->bitangent) * ay, z = dot(w, f->normal);
    return 0.5 * (sqrt(1.0 + (x * x + y * y) / (z * z)) - 1.0);
}

/* D G F / (4 cos cos) */
static double microfacets(const double wi[3], const double wo[3], const struct frame *f, double roughness,
                          double anisotropy, double weight)
{
    double h[3] = {wi[0] + wo[0], wi[1] + wo[1], wi[2] + wo[2]}, length = sqrt(dot(h, h));
    double cos_i = dot(wi, f->normal), cos_o = dot(wo, f->normal), narrow = 1.0 - anisotropy;
    if (cos_i <= 0.0 || cos_o <= 0.0 || length <= 0.0) return 0.0;
    for (int a = 0; a < 3; a++) h[a] /= length;
    double ax = roughness * roughness * sqrt(2.0 / (1.0 + narrow * narrow)), ay = narrow * ax;
    double x = dot(h, f->tangent) / ax, y = dot(h, f->bitangent) / ay, z = dot(h, f->normal);
    double d = 1.0 / (M_PI * ax * ay * (x * x + y * y + z * z) * (x * x + y * y + z * z));
    double g = 1.0 / (1.0 + lambda(wi, f, ax, ay) + lambda(wo, f, ax, ay));
    return d * g * fresnel(dot(wi, h), weight) / (4.0 * cos_i * cos_o);
}

/* Share of the light from theta_o that the microfacets of a flat surface reflect. */
static double specular_albedo(double theta_o, double roughness, double weight)
{
    static const struct frame flat = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    double wo[3], wi[3], sum = 0.0;
    polar(theta_o, 0.0, wo);
    for (int i = 0; i < N_THETA; i++)
        for (int k = 0; k < N_PHI; k++) { /* equal steps of sin^2, which have the same cos-weighted solid angle */
            polar(asin(sqrt((i + 0.5) / N_THETA)), 2.0 * M_PI * (k + 0.5) / N_PHI, wi);
            sum += microfacets(wi, wo, &flat, roughness, 0.0, weight) * M_PI / (N_THETA * N_PHI);
        }
    return fmin(sum, 0.99);
}

static void frame_of(const struct texture_maps *m, size_t i, struct frame *f)
{
    double phi = (double)m->direction_rad[i] + M_PI_2, along = 0.0, length;
    for (int a = 0; a < 3; a++) f->normal[a] = (double)m->normal[3 * i + (size_t)a];
    const double across[3] = {cos(phi), sin(phi), 0.0};
    along = dot(across, f->normal);
    for (int a = 0; a < 3; a++) f->tangent[a] = across[a] - along * f->normal[a];
    length = sqrt(dot(f->tangent, f->tangent));
    for (int a = 0; a < 3; a++) f->tangent[a] /= length;
    for (int a = 0; a < 3; a++)
        f->bitangent[a] =
            f->normal[(a + 1) % 3] * f->tangent[(a + 2) % 3] - f->normal[(a + 2) % 3] * f->tangent[(a + 1) % 3];
}

/* Mean over a grid of pixels, for a lamp of irradiance pi. */
static void reflected(const struct texture_surface *t, const double wi[3], const double wo[3], double rgb[3])
{
    const struct texture_maps *m = t->maps;
    double base = 0.0, shine = 0.0, kept = 1.0 - specular_albedo(acos(wo[2]), t->roughness, t->weight);
    for (size_t k = 0; k < N_GRID * N_GRID; k++) {
        size_t i = (k / N_GRID * m->height / N_GRID) * m->width + k % N_GRID * m->width / N_GRID;
        struct frame f;
        frame_of(m, i, &f);
        double cos_i = fmax(dot(wi, f.normal), 0.0) / (N_GRID * N_GRID);
        base += cos_i;
        shine += cos_i * M_PI *
                 microfacets(wi, wo, &f, texture_surface_roughness(t, i), texture_surface_anisotropy(t, i), t->weight);
    }
    for (int c = 0; c < 3; c++) {
        double color = fmax(t->albedo[c] - t->specular_albedo, 0.0) / (1.0 - t->specular_albedo);
        rgb[c] = base * kept * color + shine;
    }
}

static void add_rotation(const struct texture_surface *t, const struct configuration *k, double turned, double rgb[3])
{
    double wi[3], wo[3], one[3];
    polar(k->light_theta_rad, k->light_phi_rad - turned, wi);
    polar(k->camera_theta_rad, k->camera_phi_rad - turned, wo);
    if (wi[2] > 0.0) reflected(t, wi, wo, one);
    for (int c = 0; c < 3; c++) rgb[c] += wi[2] > 0.0 ? one[c] : -wi[2] * t->transmission[c];
}

static void radiance_of(const struct texture_surface *t, const struct configuration *k, double rgb[3])
{
    const uint32_t n = k->n_rotation > 1 ? k->n_rotation : 1;
    rgb[0] = rgb[1] = rgb[2] = 0.0;
    for (uint32_t r = 0; r < n && k->light != LIGHT_NO_LAMP; r++)
        add_rotation(t, k, k->cloth_rotation_rad + 2.0 * M_PI * r / n, rgb);
    for (int c = 0; c < 3; c++) rgb[c] = rgb[c] / n + k->environment_rgb[c] * t->albedo[c];
}

/* Relative RMS error over the rows of a set, in the measure of fits; NaN without rows. */
static double rel_rms(const struct surface_fit *f, bool fitted)
{
    double square = 0.0, n = 0.0;
    for (size_t i = 0; i < f->rows->n; i++) {
        double ours[3], se[3], theirs[3];
        if ((f->rows->item[i].set == JOB_SET_FIT) != fitted) continue;
        result_rendered_mean(f->model, i, ours, se);
        radiance_of(f->t, &f->rows->item[i].configuration, theirs);
        double brightest = fmax(fmax(ours[0], ours[1]), fmax(ours[2], 1e-12));
        for (int c = 0; c < 3; c++) square += pow((theirs[c] - ours[c]) / brightest, 2.0) / 3.0;
        n += 1.0;
    }
    return n > 0.0 ? sqrt(square / n) : NAN;
}

static void take(struct texture_surface *t, const double x[N_UNKNOWN])
{
    t->weight = x[0];
    t->roughness = x[1];
    t->anisotropy = x[2];
    t->specular_albedo = specular_albedo(0.0, t->roughness, t->weight);
}

static double objective(unsigned n, const double *x, double *gradient, void *data)
{
    (void)n, (void)gradient;
    struct surface_fit *f = data;
    take(f->t, x);
    return rel_rms(f, true);
}

status texture_surface_fit(struct texture_surface *t, const struct pipeline_context *c, const struct pipeline_model *m,
                           struct error *err)
{
    static const double start[N_START][N_UNKNOWN] = {{1.0, 0.5, 0.3}, {4.0, 0.4, 0.8}, {0.3, 0.8, 0.5}};
    struct surface_fit f = {t, &c->observation, m};
    double best[N_UNKNOWN] = {1.0, 0.5, 0.0}, lowest = INFINITY;
    for (int k = 0; k < N_START; k++) {
        nlopt_opt opt = nlopt_create(NLOPT_LN_SBPLX, N_UNKNOWN);
        if (opt == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot fit textures: out of memory");
        double x[N_UNKNOWN], value = INFINITY;
        memcpy(x, start[k], sizeof x);
        nlopt_set_lower_bounds(opt, lower);
        nlopt_set_upper_bounds(opt, upper);
        nlopt_set_min_objective(opt, objective, &f);
        nlopt_set_maxeval(opt, N_EVALUATION);
        nlopt_set_ftol_rel(opt, 1e-4);
        nlopt_optimize(opt, x, &value); /* also when the evaluations are used up, x is the best point so far */
        nlopt_destroy(opt);
        if (!(value < lowest)) continue;
        lowest = value;
        memcpy(best, x, sizeof best);
    }
    take(t, best);
    t->fit_rel_rms = rel_rms(&f, true);
    t->heldout_rel_rms = rel_rms(&f, false);
    return STATUS_OK;
}
