/* Common parts of models: `prepare` of those with tables, and two functions that follow from eval_pdf. */
#ifndef SELVEDGE_RENDERER_SCATTERING_STATE_H
#define SELVEDGE_RENDERER_SCATTERING_STATE_H

#include "renderer/scattering/scattering.h"

/* Makes the tables of a state for parameters in their ranges. The pool may be NULL. */
typedef status (*scattering_fill)(struct scattering_state *state, const double *param, struct thread_pool *pool,
                                  struct error *err);
/* Serves as `prepare` of a model whose state is one piece of memory: checks the parameters, allocates `bytes` of zeros,
 * and calls `fill`. Without an error *state is to be released by free. */
status scattering_state_new(const struct scattering_model *m, const double *param, scattering_fill fill, size_t bytes,
                            struct thread_pool *pool, struct scattering_state **state, struct error *err);

/* Defines `eval` and `pdf` of a model whose cheapest form of both is its static function eval_pdf. */
#define SCATTERING_EVAL_AND_PDF                                                                                        \
    static void eval(const struct scattering_state *s, const float wi[3], const float wo[3], float s_rgb[3],           \
                     float *score)                                                                                     \
    {                                                                                                                  \
        eval_pdf(s, wi, wo, NULL, s_rgb, score);                                                                       \
    }                                                                                                                  \
    static float pdf(const struct scattering_state *s, const float wi[3], const float wo[3], const float *weight_rgb)  \
    {                                                                                                                  \
        float s_rgb[3];                                                                                                \
        return eval_pdf(s, wi, wo, weight_rgb, s_rgb, NULL);                                                           \
    }

#endif
