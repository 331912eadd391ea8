/* Scattering by a fiber at a bounce of a path. Inside of path_steps.h. */
#ifndef SELVEDGE_RENDERER_PATH_SCATTER_H
#define SELVEDGE_RENDERER_PATH_SCATTER_H

#include "renderer/transport/surface/path_film.h"
#include "renderer/transport/surface/path_walk.h"

#include <string.h>

/* Width that a section shows to the light over that which it shows to wo: D(ph_i) / D(ph_o) of the fabric thesis,
 * equation 2.11. score: NULL, or [3 * n_param], to which the derivatives of its logarithm are added. */
float path_scatter_widths(const struct scattering_model *m, const struct scattering_state *state, const float wi[3],
                          const float wo[3], float *score);

/* To be called when the throughput at a bounce has changed. */
static inline void path_scatter_look(const struct walk *w, struct bounce *b)
{
    const struct scattering_model *m = w->s->model;
    if (path_walk_on_film(w)) return;
    if (PATH_PLAIN || m->view_of != NULL) m->view_of(w->state, b->wo, w->throughput, &b->view);
}

static inline void path_scatter_sample(const struct walk *w, const struct bounce *b, const float u[3], float wi[3])
{
    const struct scattering_model *m = w->s->model;
    if (path_walk_on_film(w) && b->glint.surface != NULL)
        film_glint_sample(w->film, &b->glint, b->wo, w->rng, wi);
    else if (path_walk_on_film(w))
        film_facets_sample(w->film, b->wo, u, wi);
    else if (PATH_PLAIN || m->view_of != NULL)
        m->sample_view(w->state, &b->view, u, wi);
    else
        m->sample(w->state, b->wo, w->throughput, u, wi);
}

/* S of the fiber at bounce b in rgb, with the widths of its section where the scene shows them. Returns the density of
 * the sample. score: NULL, or the derivatives of ln S, [c * n_param + p]. */
static inline float path_scatter(const struct walk *w, const struct bounce *b, const float wi[3], float s_rgb[3],
                                 float *score)
{
    const struct path_setting *s = w->s;
    const struct scattering_model *m = s->model;
    if (path_walk_on_film(w)) {
        if (score != NULL) memset(score, 0, 3 * m->n_param * sizeof *score);
        return path_glint_eval(w->film, &b->glint, wi, b->wo, s_rgb);
    }
    const float pdf = PATH_PLAIN || m->view_of != NULL ? m->eval_pdf_view(w->state, wi, &b->view, s_rgb, score)
                                                       : m->eval_pdf(w->state, wi, b->wo, w->throughput, s_rgb, score);
    if (PATH_PLAIN || !s->shows_width) return pdf;
    const float widths = path_scatter_widths(s->model, w->state, wi, b->wo, score);
    for (int c = 0; c < 3; c++) s_rgb[c] *= widths;
    return pdf;
}

/* The derivatives of ln S at bounce b to walk.score, if they are wanted. Connections ask for them when their light is
 * known to arrive: most are dropped before, and derivatives take a third of an evaluation. */
static inline void path_scatter_score(struct walk *w, const struct bounce *b, const float wi[3])
{
    const struct path_setting *s = w->s;
    float s_rgb[3];
    if (!s->want_jacobian) return;
    if (path_walk_on_film(w)) {
        memset(w->score, 0, 3 * s->model->n_param * sizeof *w->score);
        return;
    }
    s->model->eval(w->state, wi, b->wo, s_rgb, w->score);
    if (!PATH_PLAIN && s->shows_width) path_scatter_widths(s->model, w->state, wi, b->wo, w->score);
}

#endif
