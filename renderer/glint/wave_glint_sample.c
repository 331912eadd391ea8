#include "renderer/glint/wave_glint_data.h"
#include "renderer/glint/wave_lanes.h"

#include <math.h>

/* The wavelength of the blur, the share of samples with the width of a kernel, and where their Gaussians end. */
#define SAMPLE_UM 0.55
#define WIDE_SHARE (1 / 6.0F)
#define SAMPLE_REACH 5
/* share of w^2 within 3 standard deviations of w */
#define WINDOW_SHARE (1 - exp(-9))

/* Blur of samples: diffraction by the part of the surface over which the phase is linear. The root mean square of the
 * second derivatives of H is taken from the slopes. */
void wave_glint_set_blur(struct wave_glint *g, const struct wave_height *h)
{
    const size_t n = h->n;
    const double texel = (double)h->texel_um;
    double square = 0;
    for (size_t j = 0; j < n; j++)
        for (size_t i = 0; i < n; i++) {
            const size_t at = j * n + i, right = j * n + (i + 1) % n, up = (j + 1) % n * n + i;
            square += pow((double)(h->slope_u[right] - h->slope_u[at]), 2) +
                      pow((double)(h->slope_v[up] - h->slope_v[at]), 2);
        }
    const double curve = 2 * M_PI * 2 / SAMPLE_UM * sqrt(square / (2.0 * (double)(n * n))) / texel;
    const double kernel = 0.5 * (double)g->tree.step_um,
                 size = fmin(fmax(1 / sqrt(fmax(curve, 1e-12)), kernel), g->coherence_um);
    /* of the direction psi it is lambda / (2 sqrt(2) pi size), and a slope is half of it */
    g->narrow = (float)(SAMPLE_UM / (4 * M_SQRT2 * M_PI * size));
    g->wide = (float)(SAMPLE_UM / (4 * M_SQRT2 * M_PI * kernel));
}

/* Models with a fixed phase have psi = -2 H' in the middle of a kernel, the others psi / (psi . n) = -H'. Then wo is
 * the reflection of wi about the normal of the slope. */
static bool has_fixed_phase(const struct wave_glint *g) { return g->model == WAVE_OHS || g->model == WAVE_R_OHS; }

static bool direction_of_slope(const struct wave_glint *g, const float wi[3], const float slope[2], float wo[3])
{
    if (has_fixed_phase(g)) {
        for (int k = 0; k < 2; k++) wo[k] = -2 * slope[k] - wi[k];
        const float z2 = 1 - wo[0] * wo[0] - wo[1] * wo[1];
        wo[2] = sqrtf(fmaxf(z2, 0));
        return z2 > 0;
    }
    const float scale = 1 / sqrtf(1 + slope[0] * slope[0] + slope[1] * slope[1]);
    const float h[3] = {-slope[0] * scale, -slope[1] * scale, scale};
    const float d = 2 * (h[0] * wi[0] + h[1] * wi[1] + h[2] * wi[2]);
    for (int k = 0; k < 3; k++) wo[k] = d * h[k] - wi[k];
    return wo[2] > 0 && d > 0;
}

/* Slope of a direction, and the density of directions for a density of slopes of 1; 0 where there is none. */
static float slope_of_direction(const struct wave_glint *g, const float wi[3], const float wo[3], float slope[2])
{
    const float psi[3] = {wi[0] + wo[0], wi[1] + wo[1], wi[2] + wo[2]};
    if (has_fixed_phase(g)) {
        for (int k = 0; k < 2; k++) slope[k] = -0.5F * psi[k];
        return wo[2] / 4; /* d wo_xy = 4 d slope, d wo = d wo_xy / cos_o */
    }
    for (int k = 0; k < 2; k++) slope[k] = -psi[k] / psi[2];
    /* d h = cos_h^3 d slope, d wo = 4 (wi . h) d h; |psi| = 2 wi . h and cos_h = psi . n / |psi| */
    const float length2 = psi[0] * psi[0] + psi[1] * psi[1] + psi[2] * psi[2];
    return length2 / (2 * psi[2] * psi[2] * psi[2]);
}

bool wave_glint_sample(const struct wave_glint *g, const double center_um[2], const float wi[3], const float u[5],
                       float wo[3])
{
    if (!(wi[2] > 0)) return false;
    /* w^2 is a Gaussian with the standard deviation sd / sqrt(2) */
    const double radius = g->coherence_um * sqrt(-log(1 - (double)u[0] * WINDOW_SHARE)), turn = 2 * M_PI * (double)u[1];
    const double place_um[2] = {center_um[0] + radius * cos(turn), center_um[1] + radius * sin(turn)};
    const float sd = u[4] < WIDE_SHARE ? g->wide : g->narrow;
    const float off = sd * sqrtf(-2 * logf(1 - u[2])), around = 2 * (float)M_PI * u[3];
    float slope[2];
    wave_tree_slope(&g->tree, place_um, slope);
    slope[0] += off * cosf(around);
    slope[1] += off * sinf(around);
    return direction_of_slope(g, wi, slope, wo);
}

float wave_glint_pdf(const struct wave_glint *g, const struct wave_glint_query *q)
{
    struct wave_gathered k;
    float slope[2];
    if (!(q->wi[2] > 0 && q->wo[2] > 0)) return 0;
    const float per_slope = slope_of_direction(g, q->wi, q->wo, slope);
    const struct wave_window window = {{q->center_um[0], q->center_um[1]}, g->coherence_um};
    const struct wave_direction d = {{-slope[0], -slope[1]}, 1, SAMPLE_REACH * SAMPLE_REACH * g->wide * g->wide, 0};
    wave_tree_gather(&g->tree, &window, &d, &k);
    const float narrow2 = g->narrow * g->narrow, wide2 = g->wide * g->wide;
    const float share[2] = {(1 - WIDE_SHARE) / (2 * (float)M_PI * narrow2), WIDE_SHARE / (2 * (float)M_PI * wide2)};
    lanes sum = {0};
    for (size_t i = 0; i < k.n; i++)
        sum += k.weight[i] * k.weight[i] *
               (share[0] * lanes_exp_negative(k.bend[i] * (-0.5F / narrow2)) +
                share[1] * lanes_exp_negative(k.bend[i] * (-0.5F / wide2)));
    return lanes_sum(sum) * g->tree.step_um * g->tree.step_um / g->area_um2 * per_slope;
}
