#include "renderer/scattering/appearance.h"

void appearance_from_surface(const struct scattering_model *m, struct appearance *a)
{
    *a = (struct appearance){
        .kind = MODEL_SURFACE, .id = m->id, .title = m->title, .n_param = m->n_param, .param = m->param, .surface = m};
}

void appearance_from_volume(const struct phase_model *m, struct appearance *a)
{
    *a = (struct appearance){.kind = MODEL_VOLUME,
                             .id = m->id,
                             .title = m->title,
                             .n_param = m->n_param + 1, /* the density multiplier is last in the row's list */
                             .param = m->param,
                             .volume = m};
}

static bool from_row(const struct model_info *row, struct appearance *a)
{
    if (row == NULL) return false;
    if (row->kind == MODEL_SURFACE)
        appearance_from_surface(scattering_find(row->id), a);
    else
        appearance_from_volume(phase_find(row->id), a);
    return true;
}

bool appearance_at(size_t i, struct appearance *a) { return from_row(model_catalogue_at(i), a); }

bool appearance_find(const char *id, struct appearance *a) { return from_row(model_catalogue_find(id), a); }

int appearance_param_index(const struct appearance *a, const char *name)
{
    return param_index(a->param, a->n_param, name);
}
