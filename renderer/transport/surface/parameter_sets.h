/* One prepared scattering state per material group of a cloth, all of one model. Flat parameters are those of set 0,
 * then of set 1, ... */
#ifndef SELVEDGE_RENDERER_PARAMETER_SETS_H
#define SELVEDGE_RENDERER_PARAMETER_SETS_H

#include "renderer/scattering/scattering.h"
#include "renderer/scene/scene.h"

struct parameter_sets {
    const struct scattering_model *model;
    size_t n; /* at least 1 */
    struct scattering_state *state[SCATTERING_MAX_SET];
    struct film_groups films; /* of the scene, which need no set */
};

/* The film that a group is; NULL: it is a group of fibers. */
static inline const struct film_material *parameter_sets_film(const struct parameter_sets *s, size_t i_group)
{
    return film_of_group(&s->films, i_group);
}

/* param: max(n_set, 1) * model->n_param. One set serves all groups of the scene; otherwise every group needs one.
 * STATUS_INVALID for too few sets for the scene's groups or more parameters than SCATTERING_MAX_FLAT, and the errors
 * of the model's prepare. Release in any case. */
status parameter_sets_init(struct parameter_sets *sets, const struct scene *scene, const struct scattering_model *model,
                           const double *param, size_t n_set, struct error *err);
void parameter_sets_release(struct parameter_sets *sets);

#endif
