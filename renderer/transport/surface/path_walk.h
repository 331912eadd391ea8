/* The state of a path from bounce to bounce, for the headers of path_steps.h. */
#ifndef SELVEDGE_RENDERER_PATH_WALK_H
#define SELVEDGE_RENDERER_PATH_WALK_H

#include "renderer/scattering/film_glint.h"
#include "renderer/scene/fiber_frame.h"
#include "renderer/transport/surface/path_setting.h"

/* path_plain.c, which traces only paths with plain settings, sets it to 1 (path_steps.h). */
#ifndef PATH_PLAIN
#define PATH_PLAIN 0
#endif

static inline void unwrapped(const float local_mm[3], const double offset_mm[2], float out[3])
{
    out[0] = (float)((double)local_mm[0] + offset_mm[0]);
    out[1] = (float)((double)local_mm[1] + offset_mm[1]);
    out[2] = local_mm[2];
}

/* Where the path meets a fiber. */
struct bounce {
    struct scene_hit hit;
    double offset_mm[2];  /* of the ray that hit, in whole tiles */
    float position_mm[3]; /* of the hit, unwrapped */
    struct fiber_frame frame;
    float wo[3];                 /* towards where the path comes from, in the fiber frame */
    float normal[3];             /* of the cloth; only with a discrepancy or speckle */
    struct scattering_view view; /* of wo and the throughput; only if the model has views */
    struct film_glint glint;     /* only on a film; its surface is NULL where facets are not seen one by one */
    bool has_speckle;            /* this is the first bounce of a walk with speckle */
};

/* The state that a path carries. */
struct walk {
    const struct path_setting *s;
    struct rng *rng;
    const struct lamp *lamp;
    size_t n_lamp;
    struct path_result *out; /* of the lamp whose light is being added */
    struct path_result *first_out;
    size_t n_out;                         /* one result per lamp; one without lamps */
    struct path_step *step;               /* the step that is being recorded, or NULL */
    const struct scattering_state *state; /* of the fiber that was hit */
    size_t i_set;                         /* its parameter set */
    const struct film_material *film;     /* the fiber that was hit is a film; NULL: state is its scattering */
    bool last;                            /* the present bounce is the n_traced-th */
    float to_camera[3], cos_camera; /* direction to the camera from the first bounce, and its cosine to the cloth's
                                       normal there; only with a factor (path_factor.h), after the first bounce */
    /* The next three are set only with speckle, after the first bounce. */
    struct fiber_frame speckle_frame; /* the fiber frame of the first bounce */
    float speckle_wo[3];              /* direction to the camera in it */
    uint32_t i_fiber;                 /* the fiber of the first bounce */
    float normal[3];                  /* of the cloth at the present bounce; only with a factor (path_factor.h) */
    float throughput[3];
    bool has_strips;                        /* path_setting.has_strips, and the walk is not recorded */
    struct lamp_strip strip[PATH_MAX_LAMP]; /* of the lamps, from the present bounce; only with has_strips */
    float towards[PATH_MAX_LAMP][3]; /* directions from the present bounce to the lamps, which guide its guided paths */
    float p_guided;                  /* probability of a guided path there */
    float weight[PATH_MAX_LAMP];     /* multiple-importance weight of lamp connections at the present bounce: the guided
                                        paths of the bounce before have the rest */
    float score[3 * SCATTERING_MAX_PARAM]; /* of the present step, [c * n_param + p] */
    float *h; /* running sums of scores, laid out as the derivatives of path_result: h_walk, or a guided path's own */
    float h_walk[PATH_N_DERIVATIVE];
};

/* scene_sheet_hides, without a call. */
static inline bool path_walk_hides(const struct walk *w, const float direction[3])
{
    return w->s->hides_below && direction[2] <= 0;
}

/* Whether the present hit is on a film (path_film.h). */
static inline bool path_walk_on_film(const struct walk *w) { return !PATH_PLAIN && w->film != NULL; }

static inline bool path_walk_recorded(const struct walk *w) { return !PATH_PLAIN && w->step != NULL; }

/* Whether the lamp is found by direct connections alone: at the first hit of a path that always ends there. Films have
 * lobes that are too narrow for it. */
static inline bool path_walk_connects_all(const struct walk *w)
{
    const struct path_setting *s = w->s;
    return !PATH_PLAIN && w->last && w->film == NULL && s->n_traced == 1 && !s->lights.has_constant &&
           s->lights.image == NULL;
}

#endif
