#include "optimizer/fit/baseline/plain_brdf.h"
#include "optimizer/fit/baseline/plain_brdf_terms.h"

#include "optimizer/fit/objective/objective.h"

#include <math.h>

/* Below this cosine the denominators of the microfacet terms are held, so that grazing rows stay finite. */
static const double least_cosine = 1e-4;

static void direction(double theta_rad, double phi_rad, double w[3])
{
    w[0] = sin(theta_rad) * cos(phi_rad);
    w[1] = sin(theta_rad) * sin(phi_rad);
    w[2] = cos(theta_rad);
}

static double burley_diffuse(double cos_i, double cos_o, double cos_d, double retro)
{
    double grazing = 2.0 * retro * cos_d * cos_d - 0.5; /* f_d90 - 1 */
    return (1.0 + grazing * pow(1.0 - cos_i, 5.0)) * (1.0 + grazing * pow(1.0 - cos_o, 5.0)) / M_PI;
}

/* Smith's Lambda of GGX. */
static double ggx_lambda(double cosine, double alpha)
{
    double c2 = cosine * cosine;
    return 0.5 * (sqrt(1.0 + alpha * alpha * (1.0 - c2) / c2) - 1.0);
}

static double ggx_without_fresnel(double cos_i, double cos_o, double cos_h, const struct plain_shape *s)
{
    double a2 = s->roughness * s->roughness, t = cos_h * cos_h * (a2 - 1.0) + 1.0;
    double distribution = a2 / (M_PI * t * t);
    double li = ggx_lambda(cos_i, s->roughness), lo = ggx_lambda(cos_o, s->roughness);
    double masking = s->separable_masking ? 1.0 / ((1.0 + li) * (1.0 + lo)) : 1.0 / (1.0 + li + lo);
    return distribution * masking / (4.0 * cos_i * cos_o);
}

/* Lambda of the sheen's masking: the fit of table 1 of Estevez and Kulla, between roughness 0 and 1. */
static double sheen_log_lambda(double cosine, double roughness)
{
    static const double sharp[5] = {25.3245, 3.32435, 0.16801, -1.27393, -4.85967};
    static const double rough[5] = {21.5473, 3.82987, 0.19823, -1.97760, -4.32054};
    double k = (1.0 - roughness) * (1.0 - roughness), p[5];
    for (size_t i = 0; i < 5; i++) p[i] = k * sharp[i] + (1.0 - k) * rough[i];
    return p[0] / (1.0 + p[1] * pow(cosine, p[2])) + p[3] * cosine + p[4];
}

static double sheen_lambda(double cosine, double roughness)
{
    if (cosine < 0.5) return exp(sheen_log_lambda(cosine, roughness));
    return exp(2.0 * sheen_log_lambda(0.5, roughness) - sheen_log_lambda(1.0 - cosine, roughness));
}

static double sheen(double cos_i, double cos_o, double cos_h, double roughness)
{
    double sine = sqrt(fmax(1.0 - cos_h * cos_h, 0.0));
    double distribution = (2.0 + 1.0 / roughness) * pow(sine, 1.0 / roughness) / (2.0 * M_PI);
    double masking = 1.0 / (1.0 + sheen_lambda(cos_i, roughness) + sheen_lambda(cos_o, roughness));
    return distribution * masking / (4.0 * cos_i * cos_o);
}

void plain_terms(const struct plain_shape *s, const struct configuration *c, struct plain_term *t)
{
    double wi[3], wo[3], h[3], length = 0.0, cos_d = 0.0;
    *t = (struct plain_term){0};
    direction(c->light_theta_rad, c->light_phi_rad, wi);
    direction(c->camera_theta_rad, c->camera_phi_rad, wo);
    if (wi[2] < 0.0) {
        t->behind = true;
        t->factor[0] = -wi[2];
        return;
    }
    for (size_t a = 0; a < 3; a++) h[a] = wi[a] + wo[a];
    for (size_t a = 0; a < 3; a++) length += h[a] * h[a];
    length = sqrt(length);
    for (size_t a = 0; a < 3; a++) cos_d += wi[a] * h[a] / length;
    double cos_i = fmax(wi[2], least_cosine), cos_o = fmax(wo[2], least_cosine), cos_h = h[2] / length;
    double scale = M_PI * cos_i, schlick = pow(1.0 - cos_d, 5.0);
    double specular = scale * ggx_without_fresnel(cos_i, cos_o, cos_h, s);
    t->factor[PLAIN_DIFFUSE] = scale * burley_diffuse(cos_i, cos_o, cos_d, s->retro);
    t->factor[PLAIN_F0] = specular * (1.0 - schlick);
    t->factor[PLAIN_SHEEN] = scale * sheen(cos_i, cos_o, cos_h, s->sheen_roughness);
    t->constant = specular * schlick;
}

bool plain_brdf_applies(const struct configuration *c)
{
    bool dark = c->environment_rgb[0] == 0.0 && c->environment_rgb[1] == 0.0 && c->environment_rgb[2] == 0.0;
    return dark && c->environment == NULL && c->light != LIGHT_NO_LAMP;
}

void plain_brdf_radiance(const struct plain_brdf *b, const struct configuration *c, double rgb[3])
{
    struct plain_term t;
    const struct plain_shape shape = {b->retro, b->roughness, b->sheen_roughness, b->separable_masking};
    plain_terms(&shape, c, &t);
    for (size_t ch = 0; ch < 3; ch++) {
        rgb[ch] = t.constant;
        if (t.behind)
            rgb[ch] = t.factor[0] * b->transmission_rgb[ch];
        else
            rgb[ch] += t.factor[PLAIN_DIFFUSE] * b->diffuse_rgb[ch] + t.factor[PLAIN_F0] * b->f0_rgb[ch] +
                       t.factor[PLAIN_SHEEN] * b->sheen_rgb[ch];
    }
}

double plain_brdf_rel_rms(const struct plain_brdf *b, const struct observation_set *rows, enum job_set set)
{
    double sum = 0.0, rgb[3];
    size_t n = 0;
    for (size_t i = 0; i < rows->n; i++) {
        const struct observation *o = &rows->item[i];
        if (o->set != set || o->weight == 0.0 || observation_is_contrast(o)) continue;
        plain_brdf_radiance(b, &o->configuration, rgb);
        sum += objective_relative_weight(o) * objective_image_difference(rgb, o->mean_rgb);
        n++;
    }
    return n > 0 ? sqrt(sum / (3.0 * (double)n)) : NAN;
}
