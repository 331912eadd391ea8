#include "renderer/transport/surface/path_setting.h"
#include "renderer/transport/path_value.h"

#include <string.h>

void path_setting_init(struct path_setting *s, const struct scene *scene, const struct scattering_model *model,
                       const struct scattering_state *state, const struct configuration *c, bool want_jacobian)
{
    memset(s, 0, sizeof *s);
    s->scene = scene;
    s->model = model;
    s->state[0] = state;
    s->n_set = 1;
    lights_init(&s->lights, c);
    s->guided_paths = s->lights.has_lamp;
    s->hides_below = scene_sheet_hides(scene, (const float[3]){0, 0, -1});
    s->shows_width = model->width != NULL && scene_shows_sections(scene);
    s->has_films = scene_has_films(scene);
    s->roulette_below = PATH_SURFACE_ROULETTE_BELOW;
    if (s->guided_paths) light_guide_energy_of(model, state, &s->energy[0]);
    s->has_strips = s->lights.has_lamp && model->lobe_rad != NULL;
    if (s->has_strips) s->lobe_rad[0] = model->lobe_rad(state);
    s->want_jacobian = want_jacobian;
}

void path_setting_init_sets(struct path_setting *s, const struct scene *scene, const struct parameter_sets *sets,
                            const struct configuration *c, bool want_jacobian)
{
    path_setting_init(s, scene, sets->model, sets->state[0], c, want_jacobian);
    s->n_set = sets->n;
    for (size_t i = 0; i < sets->n; i++) {
        s->state[i] = sets->state[i];
        if (s->guided_paths && i > 0) light_guide_energy_of(s->model, s->state[i], &s->energy[i]);
        if (s->has_strips) s->lobe_rad[i] = s->model->lobe_rad(s->state[i]);
    }
}

void path_setting_choose(struct path_setting *s)
{
    const struct scattering_model *m = s->model;
    const bool simple_model = m->view_of != NULL && !m->flat_section && !m->near_field && !m->across_width;
    s->plain = simple_model && !s->has_films && !s->shows_width && s->n_set == 1 && s->discrepancy == NULL &&
               s->speckle.table == NULL && s->lights.image == NULL && s->n_traced == 0 && s->begin == NULL;
}
