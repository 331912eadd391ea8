/* Scattering models of fibers: a folder of models/ each, with their rows of the catalogue
 * (base/catalogue/models.def), found by id.
 *
 * Frame: fiber frame u, v, w with u along the fiber; w = (sin th, cos th cos ph, cos th sin ph), th in [-pi/2, pi/2]
 * from the normal plane (fabric thesis, section 5.4). Directions point away from the fiber. S(wi, wo) is the BCSDF; the
 * light leaving along wo is the integral of S Li cos(th_i) dwi. Energy: integral of S cos(th_o) dwo <= 1 for every wi.
 *
 * The catalogue describes the parameters (param_info.h): they are numbered flat, in internal units.
 */
#ifndef SELVEDGE_RENDERER_SCATTERING_H
#define SELVEDGE_RENDERER_SCATTERING_H

#include "base/catalogue/model_catalogue.h"
#include "base/status.h"
#include "base/thread_pool.h"
#include "renderer/scattering/fiber_direction.h"

#include <stdbool.h>
#include <stddef.h>

enum {
    SCATTERING_MAX_PARAM = MODEL_MAX_PARAM, /* of one model */
    SCATTERING_MAX_SET = MODEL_MAX_SET,     /* parameter sets, one for each group of fibers (fiber_set.h) */
    SCATTERING_MAX_FLAT = MODEL_MAX_FLAT    /* parameters of all sets together */
};

/* A model with its parameters fixed and its tables made (G, d ln G / d beta, normalisers). Immutable: shared by
 * threads. */
struct scattering_state;
struct speckle_table;

/* State of a model at a bounce that depends on wo and the weights of the channels alone. */
struct scattering_view {
    struct fiber_direction out; /* wo */
    float part[8];              /* the model's own */
};

struct scattering_model {
    const char *id, *title; /* these four: SURFACE_MODEL_ROW of the catalogue */
    size_t n_param;
    const struct param_info *param;

    /* False: light leaves a fiber where the camera's ray meets it (fabric thesis 5.5.1). True: it enters at a random
     * place of the fiber's width, as a BCSDF is a mean over the width of both the incident and the exitant light
     * (Marschner et al. 2003, "Light Scattering from Human Hair Fibers", section 3). The two differ where neighbours
     * shade a part of the width; the latter keeps light transport through dense cloth reciprocal. */
    bool across_width;

    /* Whether the model distinguishes directions by their azimuth about the fiber: then v of the fiber frame must be
     * the normal of the flat section (fiber_frame_flat). */
    bool flat_section;

    /* Whether the light depends on where across its width the fiber is seen: then v of the fiber frame must be the
     * normal of the surface at the hit, and the offset from the axis, in radii, is the sine of the azimuth of wo. */
    bool near_field;

    /* Table from which the speckle of pictures is made (renderer/scattering/speckle.h); NULL: the model has none. */
    const struct speckle_table *speckle;

    /* STATUS_INVALID, field = parameter name, for a value that is NaN or outside [lower, upper]. */
    status (*prepare)(const double *param, struct scattering_state **state, struct error *err);
    /* The same with the threads of a pool, and with the same bits. NULL: there is nothing to share among threads. */
    status (*prepare_shared)(const double *param, struct thread_pool *pool, struct scattering_state **state,
                             struct error *err);
    void (*release)(struct scattering_state *state);

    /* S in rgb, and if score != NULL the derivative of ln S_c by each flat parameter: score[c * n_param + p] (zero
     * where a colour parameter does not touch channel c). wi, wo: unit vectors in the fiber frame, any sign of the
     * components. */
    void (*eval)(const struct scattering_state *state, const float wi[3], const float wo[3], float s_rgb[3],
                 float *score);
    /* Draw wi for a given wo with u in [0,1)^3. weight_rgb: weight of each channel, such as the throughput of a
     * path; NULL: equal weights. One lobe may be bright in red where another is bright in blue. wi is drawn with the
     * density per steradian that pdf() returns for the same weights, which is > 0 there. */
    void (*sample)(const struct scattering_state *state, const float wo[3], const float *weight_rgb, const float u[3],
                   float wi[3]);
    float (*pdf)(const struct scattering_state *state, const float wi[3], const float wo[3], const float *weight_rgb);
    /* eval, and pdf as the result, in one pass for the inner loop: they share most of their work. Exactly the same
     * values. */
    float (*eval_pdf)(const struct scattering_state *state, const float wi[3], const float wo[3],
                      const float *weight_rgb, float s_rgb[3], float *score);
    /* eval_pdf and sample in two steps, for the several wi of a bounce: view_of once, the others for each wi. Exactly
     * the same values. NULL, all three: the model has them in one step only. */
    void (*view_of)(const struct scattering_state *state, const float wo[3], const float *weight_rgb,
                    struct scattering_view *view);
    float (*eval_pdf_view)(const struct scattering_state *state, const float wi[3], const struct scattering_view *view,
                           float s_rgb[3], float *score);
    void (*sample_view)(const struct scattering_state *state, const struct scattering_view *view, const float u[3],
                        float wi[3]);
    /* The width that the section shows towards a direction, over the diameter of a round fiber of the same area; score:
     * the derivatives of its logarithm by each parameter, NULL when not wanted. NULL: 1, the section is round or turned
     * at random. */
    float (*width)(const struct scattering_state *state, const float w[3], float *score);
    /* The modes whose light a state can have alone, such as "R" and "TRT", NULL-terminated; NULL: none. keep_mode takes
     * all other modes out of a state that no thread uses yet: eval is then the light of mode[k], as it is measured
     * where modes are apart along the fiber, while sample and pdf stay as they were. */
    const char *const *mode;
    void (*keep_mode)(struct scattering_state *state, size_t k);
    /* The standard deviation in th_i of the narrowest lobe about th_i = -th_o, by which lamps are sampled. NULL: the
     * model has none. */
    float (*lobe_rad)(const struct scattering_state *state);
    /* The integral of S cos th_i exp(sharpness (wi . axis - 1)) over wi, in closed form: an approximation for a
     * sharpness of at least 100. NULL: the model has none. */
    void (*gaussian)(const struct scattering_state *state, const float axis[3], float sharpness, const float wo[3],
                     float rgb[3]);
};

/* Prepares a model with the threads of a pool where it can share them; NULL: in the caller alone. Not to be called by a
 * task of the pool. */
status scattering_prepare(const struct scattering_model *m, const double *param, struct thread_pool *pool,
                          struct scattering_state **state, struct error *err);

/* Why v of the fiber frame matters to a model, for error texts: "its fibers are flat". NULL when it does not: then
 * renderers may take any v. */
const char *scattering_frame_reason(const struct scattering_model *m);

/* The azimuth of the k-th of n views that have the same weight in a mean over all views of the fiber: equal steps of
 * the turn for a section, of the width for a near field. 0 for all other models, for which one view is enough. */
double scattering_view_azimuth_rad(const struct scattering_model *m, int k, int n);

/* All models, NULL-terminated, in the order of the catalogue; and by id (NULL when unknown). */
const struct scattering_model *const *scattering_registry(void);
const struct scattering_model *scattering_find(const char *id);
/* Index of a flat parameter by name, or -1. */
int scattering_param_index(const struct scattering_model *m, const char *name);

#endif
