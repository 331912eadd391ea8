#include "renderer/scattering/appearance.h"

#include <string.h>

/* 10 .. 100,000 per cm: mean free paths of 0.1 um to 1 mm in solid material. */
static const struct param_info density_multiplier = {.name = APPEARANCE_DENSITY_MULTIPLIER,
                                                     .symbol = APPEARANCE_DENSITY_MULTIPLIER,
                                                     .unit = "1/cm",
                                                     .channel = -1,
                                                     .lower = 1e3,
                                                     .upper = 1e7,
                                                     .start = 4e5};

void appearance_from_surface(const struct scattering_model *m, struct appearance *a)
{
    memset(a, 0, sizeof *a);
    a->kind = APPEARANCE_SURFACE;
    a->id = m->id;
    a->title = m->title;
    a->n_param = m->n_param;
    memcpy(a->param, m->param, m->n_param * sizeof *m->param);
    a->surface = m;
}

void appearance_from_volume(const struct phase_model *m, struct appearance *a)
{
    memset(a, 0, sizeof *a);
    a->kind = APPEARANCE_VOLUME;
    a->id = m->id;
    a->title = m->title;
    a->n_param = m->n_param + 1;
    memcpy(a->param, m->param, m->n_param * sizeof *m->param);
    a->param[m->n_param] = density_multiplier;
    a->volume = m;
}

bool appearance_at(size_t i, struct appearance *a)
{
    const struct scattering_model *const *surface = scattering_registry();
    const struct phase_model *const *volume = phase_registry();
    for (; *surface != NULL; surface++)
        if (i-- == 0) {
            appearance_from_surface(*surface, a);
            return true;
        }
    for (; *volume != NULL; volume++)
        if (i-- == 0) {
            appearance_from_volume(*volume, a);
            return true;
        }
    return false;
}

bool appearance_find(const char *id, struct appearance *a)
{
    for (size_t i = 0; appearance_at(i, a); i++)
        if (strcmp(a->id, id) == 0) return true;
    return false;
}

int appearance_param_index(const struct appearance *a, const char *name)
{
    for (size_t p = 0; p < a->n_param; p++)
        if (strcmp(a->param[p].name, name) == 0) return (int)p;
    return -1;
}
