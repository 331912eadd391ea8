#include "renderer/glint/wave_glint_data.h"
#include "renderer/glint/wave_lanes.h"
#include "renderer/image/observer_weights.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define FIRST_UM 0.36
#define LAST_UM 0.83
#define REACH 3 /* of kernels, in standard deviations of their direction */
/* Of wave_height_rest, in radians^2. */
#define MOST_REST 0.05
struct wave_glint_option wave_glint_option_usual(void)
{
    return (struct wave_glint_option){wave_height_option_usual(), .coherence_um = 10, .model = WAVE_R_GHS};
}

void wave_glint_colors(float wavelength_um[WAVE_N_COLOR], float weight_rgb[WAVE_N_COLOR][3])
{
    enum { N_STEP = 64 };
    const double bin = (LAST_UM - FIRST_UM) / WAVE_N_COLOR;
    double sum[3] = {0}, weight[WAVE_N_COLOR][3] = {{0}};
    for (int i = 0; i < WAVE_N_COLOR; i++) {
        wavelength_um[i] = (float)(FIRST_UM + (i + 0.5) * bin);
        for (int k = 0; k < N_STEP; k++)
            for (size_t c = 0; c < 3; c++) {
                const double w = observer_weight(1e3 * (FIRST_UM + (i + (k + 0.5) / N_STEP) * bin), c);
                weight[i][c] += w;
                sum[c] += w;
            }
    }
    for (int i = 0; i < WAVE_N_COLOR; i++)
        for (int c = 0; c < 3; c++) weight_rgb[i][c] = (float)(weight[i][c] / sum[c]);
}

static status check(const struct wave_glint_option *o, struct error *err)
{
    if (!(o->coherence_um >= 2 * o->height.texel_um && o->coherence_um <= WAVE_MOST_RADIUS / 3 * o->height.texel_um))
        return error_set(err, STATUS_INVALID, "light that is coherent over %g um: not 2 to %d texels", o->coherence_um,
                         WAVE_MOST_RADIUS / 3);
    if ((unsigned)o->model >= WAVE_N_MODEL) return error_set(err, STATUS_INVALID, "there is no such diffraction model");
    return STATUS_OK;
}

/* Distance of kernels in texels: the largest one at which phases of kernels agree with the surface. */
static size_t stride_of(const struct wave_height *h, double coherence_um)
{
    const double texel = (double)h->texel_um;
    size_t stride = 1;
    while (stride * 32 <= h->n && 4.0 * (double)stride * texel <= coherence_um &&
           wave_height_rest(h, (double)stride * texel) <= MOST_REST)
        stride *= 2;
    return stride;
}

status wave_glint_new(const struct wave_glint_option *o, struct wave_glint **out, struct error *err)
{
    struct wave_height h = {0};
    *out = NULL;
    status s = check(o, err);
    if (s != STATUS_OK) return s;
    struct wave_glint *g = calloc(1, sizeof *g);
    if (g == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot make a surface of glints: out of memory");
    s = wave_height_init(&h, &o->height, err);
    if (s == STATUS_OK && !o->is_published) s = wave_height_curve(&h, err);
    const size_t stride = s == STATUS_OK && !o->is_published ? stride_of(&h, o->coherence_um) : 1;
    const double sigma_um = 0.5 * (double)stride * o->height.texel_um;
    if (s == STATUS_OK) s = wave_tree_init(&g->tree, &h, stride, err);
    if (s != STATUS_OK) goto out;
    g->model = o->model;
    g->coherence_um = o->coherence_um;
    /* kernels blur the window that they are multiplied by */
    g->window_um = o->is_published ? o->coherence_um : sqrt(o->coherence_um * o->coherence_um - sigma_um * sigma_um);
    g->area_um2 = (float)(M_PI * o->coherence_um * o->coherence_um * (1 - exp(-9)));
    wave_glint_set_blur(g, &h);
    wave_glint_colors(g->wavelength_um, g->weight_rgb);
    for (int m = 0; m < METAL_N; m++)
        for (int i = 0; i < WAVE_N_COLOR; i++)
            metal_index((enum metal)m, 1e3 * (double)g->wavelength_um[i], g->index[m][i]);
    *out = g;
out:
    wave_height_release(&h);
    if (s != STATUS_OK) wave_glint_free(g);
    return s;
}

void wave_glint_free(struct wave_glint *g)
{
    if (g == NULL) return;
    wave_tree_release(&g->tree);
    free(g);
}

double wave_glint_side_um(const struct wave_glint *g) { return (double)g->tree.n * (double)g->tree.step_um; }

/* |sum over kernels|^2 / l^4 of one wavelength, of flat kernels. */
static float flat_intensity(const struct wave_gathered *k, float wavelength_um, float step_um)
{
    const float per_wave = 1 / wavelength_um, l = step_um * per_wave;
    const float damping = -0.5F * (float)(M_PI * M_PI) * l * l; /* -2 pi^2 sigma^2 / lambda^2 */
    lanes re = {0}, im = {0};
    for (size_t i = 0; i < k->n; i++) {
        lanes c, s;
        const lanes size = k->weight[i] * lanes_exp_negative(damping * k->bend[i]);
        lanes_turn(k->path_um[i] * per_wave, &c, &s);
        re += size * c;
        im += size * s;
    }
    const float r = lanes_sum(re), i = lanes_sum(im);
    return r * r + i * i;
}

/* The same of curved ones. With k = 2 pi / lambda, t = k sigma^2 and D = det(1 + i t K), a kernel is
 * exp(-k^2 sigma^2 (|b|^2 + i t across) / (2 D)) / sqrt(D) (wave_tree.h); sqrt(D) has a real part above 0, because the
 * angle of D is below pi. The term of the third order of the phase cancels between neighbours but for half of its
 * variance, by which the sum is too small; the fourth power of a cubic form of normal deviates is some 46 times the
 * square of its variance, hence the last factor. */
static float curved_intensity(const struct wave_gathered *k, float wavelength_um, float step_um)
{
    const float per_wave = 1 / wavelength_um, sigma2 = 0.25F * step_um * step_um,
                t = 2 * (float)M_PI * per_wave * sigma2, pi2 = (float)(M_PI * M_PI);
    const float damping = -2 * pi2 * per_wave * per_wave * sigma2, turning = -damping / (2 * (float)M_PI),
                k2 = 4 * pi2 * per_wave * per_wave;
    lanes re = {0}, im = {0};
    for (size_t i = 0; i < k->n; i++) {
        const lanes d_re = 1 - t * t * k->det[i], d_im = t * k->trace[i], size2 = d_re * d_re + d_im * d_im;
        const lanes per2 = 1 / size2, size = lanes_sqrt(size2), across = t * k->across[i];
        const lanes e_re = (k->bend[i] * d_re + across * d_im) * per2,
                    e_im = (across * d_re - k->bend[i] * d_im) * per2;
        const lanes half = 0.5F * (size + d_re),
                    u = lanes_sqrt(lanes_choose((lane_mask)(half > 1e-6F), half, (lanes){0} + 1e-6F)),
                    v = 0.5F * d_im / u;
        const lanes rest = k2 * k->third2[i], gain = 1 + 0.5F * rest / (1 + 4 * rest);
        const lanes amount = k->weight[i] * lanes_exp_negative(damping * e_re) * size * per2 * gain;
        lanes c, s;
        lanes_turn(k->path_um[i] * per_wave + turning * e_im, &c, &s);
        re += amount * (c * u - s * v);
        im += amount * (s * u + c * v);
    }
    const float r = lanes_sum(re), i = lanes_sum(im);
    return r * r + i * i;
}

size_t wave_glint_value(const struct wave_glint *g, const struct wave_glint_query *q, const float *wavelength_um,
                        size_t n, bool is_pruned, float *f)
{
    struct wave_factors factor;
    struct wave_gathered k;
    float longest_um = 0;
    memset(f, 0, n * sizeof *f);
    if (!wave_factors_of(g->model, q->wi, q->wo, &factor)) return 0;
    for (size_t i = 0; i < n; i++) longest_um = fmaxf(longest_um, wavelength_um[i]);
    const struct wave_window window = {{q->center_um[0], q->center_um[1]}, g->window_um};
    /* the standard deviation of a kernel is lambda / (2 pi sigma) = lambda / (pi l) */
    const float reach = is_pruned ? REACH * longest_um / ((float)M_PI * g->tree.step_um) : INFINITY;
    /* t of the largest curvature, which widens a kernel by the factor sqrt(1 + (t K)^2) */
    const float bent =
        is_pruned ? reach * factor.xi_3 * 0.5F * (float)M_PI / longest_um * g->tree.step_um * g->tree.step_um : 0;
    const struct wave_direction d = {{factor.psi[0], factor.psi[1]}, factor.xi_3, reach * reach, bent * bent};
    wave_tree_gather(&g->tree, &window, &d, &k);
    if (factor.per_psi_n > 0)
        for (size_t i = 0; i < k.n; i++) k.weight[i] *= 1 - k.tilt[i] * factor.per_psi_n;
    const float step2 = g->tree.step_um * g->tree.step_um;
    const float wider = (float)pow(g->coherence_um / g->window_um, 4); /* the blur leaves the integral of w as it is */
    for (size_t i = 0; i < n; i++)
        f[i] = wider * factor.xi_1 / (wavelength_um[i] * wavelength_um[i] * g->area_um2) * step2 * step2 *
               (g->tree.is_curved ? curved_intensity : flat_intensity)(&k, wavelength_um[i], g->tree.step_um);
    return k.n * LANES;
}

void wave_glint_rgb(const struct wave_glint *g, const struct wave_glint_query *q, enum metal metal, float rgb[3])
{
    float f[WAVE_N_COLOR], half2 = 0;
    memset(rgb, 0, 3 * sizeof *rgb);
    if (wave_glint_value(g, q, g->wavelength_um, WAVE_N_COLOR, true, f) == 0) return;
    for (int k = 0; k < 3; k++) half2 += (q->wi[k] + q->wo[k]) * (q->wi[k] + q->wo[k]);
    const double cos_half = fmin(0.5 * sqrt((double)half2), 1); /* of wi and the half vector */
    for (int i = 0; i < WAVE_N_COLOR; i++) {
        if (metal != METAL_N) f[i] *= (float)conductor_reflectance(g->index[metal][i], cos_half);
        for (int c = 0; c < 3; c++) rgb[c] += g->weight_rgb[i][c] * f[i];
    }
}
