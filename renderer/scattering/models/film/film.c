/* film.v1: a flat metal film, by facets on both sides (renderer/scattering/film_facets.h). v of the fiber frame is the
 * normal of the flat side.
 *
 *     S = f_r |wo.v| / cos th_o
 *
 * The film shows the width |w.v| / cos th, which is a factor of S in scenes that show sections (path_scatter.h):
 * then the light that leaves along wo is f_r |wi.v| Li dwi. S times the width of wi is the same when both directions
 * are exchanged. */
#include "renderer/scattering/film_facets.h"
#include "renderer/scattering/models/film/film_rows.def"
#include "renderer/scattering/scattering_state.h"

#include <stdlib.h>

enum { P_COLOR, P_ALPHA = 3, N_PARAM };

struct scattering_state {
    struct film_material material;
};

static status fill(struct scattering_state *s, const double *param, struct thread_pool *pool, struct error *err)
{
    (void)pool;
    (void)err;
    for (int c = 0; c < 3; c++) s->material.color[c] = (float)param[P_COLOR + c];
    s->material.roughness = (float)param[P_ALPHA];
    return STATUS_OK;
}

static status prepare(const double *param, struct scattering_state **state, struct error *err)
{
    return scattering_state_new(&scattering_film, param, fill, sizeof **state, NULL, state, err);
}

static void release(struct scattering_state *s) { free(s); }

/* The projected width over cos th, which never vanishes. */
static float shown(const float w[3])
{
    return fmaxf(fabsf(w[1]), FIBER_COS_MIN) / fmaxf(sqrtf(w[1] * w[1] + w[2] * w[2]), FIBER_COS_MIN);
}

static float eval_pdf(const struct scattering_state *s, const float wi[3], const float wo[3], const float *weight_rgb,
                      float s_rgb[3], float *score)
{
    (void)weight_rgb;
    float by_color[3], by_alpha;
    const float pdf = film_facets_eval(&s->material, wi, wo, s_rgb, score != NULL ? by_color : NULL,
                                       score != NULL ? &by_alpha : NULL);
    const float width = shown(wo);
    for (int c = 0; c < 3; c++) s_rgb[c] *= width;
    for (int i = 0; i < 3 * N_PARAM && score != NULL; i++) score[i] = 0;
    for (int c = 0; c < 3 && score != NULL; c++) {
        score[c * N_PARAM + P_COLOR + c] = by_color[c];
        score[c * N_PARAM + P_ALPHA] = by_alpha;
    }
    return pdf;
}

SCATTERING_EVAL_AND_PDF

static void sample(const struct scattering_state *s, const float wo[3], const float *weight_rgb, const float u[3],
                   float wi[3])
{
    (void)weight_rgb;
    film_facets_sample(&s->material, wo, u, wi);
}

/* Of a film alone: the factors in which it differs from the disc of equal area are the same for both directions. */
static float width(const struct scattering_state *s, const float w[3], float *score)
{
    (void)s;
    for (int p = 0; p < N_PARAM && score != NULL; p++) score[p] = 0;
    return shown(w);
}

const struct scattering_model scattering_film = {
    SURFACE_MODEL_ROW(film), .flat_section = true, .prepare = prepare,   .release = release, .eval = eval,
    .sample = sample,        .pdf = pdf,           .eval_pdf = eval_pdf, .width = width,
};
