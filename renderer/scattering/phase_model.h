/* Scattering models of a volume of fibers: phase function with albedo, and how extinction depends on direction. One
 * file per model, one row in the catalogue, found by id. The volume tracer's twin of scattering.h.
 *
 * Frame: fiber frame u, v, w with u along the fiber; directions point away from the scattering point. A model stands
 * for sigma_t(w) = d rho(x) s(w)              s a function of the sine of the angle between w and the fiber source
 * along wo = sigma_t(wo) * integral of f(wi, wo) Li(wi) dwi,   f = alpha f_p,   integral of f_p dwi = 1 per colour
 * channel (f_p is normalised over wi for each wo, so a white volume in a uniform environment has the same radiance
 * everywhere). d is the density multiplier in 1 / m: extinction of full density across the fibers. (The thesis' 4000
 * makes sense per cm: 4e5 1/m.) Parameters are described as in scattering.h; d is not among them: it belongs to the
 * volume.
 */
#ifndef SELVEDGE_RENDERER_PHASE_MODEL_H
#define SELVEDGE_RENDERER_PHASE_MODEL_H

#include "renderer/scattering/scattering.h"

enum { PHASE_N_EXTINCTION = 2048, PHASE_MAX_PARAM = SCATTERING_MAX_PARAM - 1 };

/* s over the sine of the angle to the fiber, linear between 2,049 entries, and its derivative by the one parameter that
 * it depends on. */
struct phase_extinction {
    float value[PHASE_N_EXTINCTION + 1];
    float d_value[PHASE_N_EXTINCTION + 1];
    float largest;
    int i_param; /* -1: depends on none, d_value is zero */
};

/* A model with its parameters fixed and its tables made. Immutable: shared by threads. */
struct phase_state;

struct phase_model {
    const char *id, *title;         /* these four: VOLUME_MODEL_ROW of the catalogue */
    size_t n_param;                 /* at most PHASE_MAX_PARAM */
    const struct param_info *param; /* n_param, and then the density multiplier */

    /* STATUS_INVALID, field = parameter name, for a value that is NaN or outside [lower, upper]. */
    status (*prepare)(const double *param, struct phase_state **state, struct error *err);
    void (*release)(struct phase_state *state);
    const struct phase_extinction *(*extinction)(const struct phase_state *state);

    /* Draw wi for a given wo with u in [0, 1)^3; weight_rgb as in scattering.h. */
    void (*sample)(const struct phase_state *state, const float wo[3], const float *weight_rgb, const float u[3],
                   float wi[3]);
    /* f = alpha f_p in rgb; the density per steradian of sample() as the result; and if score != NULL the derivative
     * of ln f_c by each flat parameter: score[c * n_param + p]. */
    float (*eval_pdf)(const struct phase_state *state, const float wi[3], const float wo[3], const float *weight_rgb,
                      float f_rgb[3], float *score);
};

/* All models, NULL-terminated, in the order of the catalogue; and by id (NULL when unknown). */
const struct phase_model *const *phase_registry(void);
const struct phase_model *phase_find(const char *id);

static inline float phase_extinction_at(const struct phase_extinction *e, float sine, float *d_value)
{
    float x = sine * PHASE_N_EXTINCTION;
    int i = x < PHASE_N_EXTINCTION - 1 ? (int)x : PHASE_N_EXTINCTION - 1;
    float t = x - (float)i;
    *d_value = e->i_param < 0 ? 0 : e->d_value[i] + t * (e->d_value[i + 1] - e->d_value[i]); /* spare the cache */
    return e->value[i] + t * (e->value[i + 1] - e->value[i]);
}

#endif
