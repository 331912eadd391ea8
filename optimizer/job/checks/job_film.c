#include "optimizer/job/checks/job_film.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

void job_film_take_material(const struct job_film *from, struct film_material *m)
{
    film_metal_color(from->metal, m->color);
    for (int c = 0; c < 3 && !isnan(from->color[0]); c++) m->color[c] = (float)from->color[c];
    m->roughness = (float)from->roughness;
    m->grain_um = (float)from->grain_um;
    for (uint32_t k = 0; film_surface_names[k] != NULL; k++)
        if (strcmp(film_surface_names[k], from->surface) == 0) m->surface = k;
    for (uint32_t k = 0; film_optics_names[k] != NULL; k++)
        if (strcmp(film_optics_names[k], from->optics) == 0) m->optics = k;
}

/* Refuses all keys of a film that has no size. */
static status check_size(const struct json_field *f, const char *prefix, const char *size_key, struct error *err)
{
    char path[JSON_PATH_BYTES];
    const char *name;
    json_t *value;
    if (json_object_get(f->object, size_key) != NULL) return STATUS_OK;
    json_object_foreach((json_t *)f->object, name, value)
    {
        if (strncmp(name, prefix, strlen(prefix)) != 0) continue;
        json_field_path(f, name, path);
        return error_set_field(err, STATUS_INVALID, path, "'%s' changes nothing without '%s'", path, size_key);
    }
    return STATUS_OK;
}

status job_film_check_keys(const struct json_field *f, const char *prefix, const char *size_key,
                           const struct job_film *film, struct error *err)
{
    char path[JSON_PATH_BYTES], key[32];
    status s = check_size(f, prefix, size_key, err);
    if (s != STATUS_OK || json_object_get(f->object, size_key) == NULL) return s;
    struct film_material m = {.optics = FILM_RAYS};
    job_film_take_material(film, &m);
    struct film_waves w;
    film_waves_of(&m, &w);
    const bool smooth = m.surface == FILM_SMOOTH, waves = m.optics != FILM_RAYS;
    const struct {
        const char *key;
        bool only_given, wrong; /* only_given: the key's standard value is not wrong */
        const char *text;
    } row[] = {
        {"metal", true, !isnan(film->color[0]), "the color beside it replaces the color of the metal"},
        {"grain_um", true, smooth, "the surface is smooth"},
        {"optics", false, waves && !film_has_waves(&m), "the surface is not rendered by waves"},
        {"grain_um", false,
         film_has_waves(&m) &&
             !(film->grain_um >= FILM_LEAST_WAVE_GRAIN_UM && film->grain_um <= FILM_MOST_WAVE_GRAIN_UM),
         "surfaces that are rendered by waves have grains of 4 to 128 um"},
        {"roughness", false, film_has_waves(&m) && !film_waves_are_low(&w),
         "with these grains the surface would be higher than 10 um, too rough for waves"},
        {"roughness", false, !smooth && film->roughness > FILM_MOST_SLOPE,
         "facets that are seen one by one have a roughness of at most 0.5"},
    };
    for (size_t k = 0; k < sizeof row / sizeof *row; k++) {
        snprintf(key, sizeof key, "%s%s", prefix, row[k].key);
        if (!row[k].wrong || (row[k].only_given && json_object_get(f->object, key) == NULL)) continue;
        json_field_path(f, key, path);
        return error_set_field(err, STATUS_INVALID, path, "'%s' is refused: %s", path, row[k].text);
    }
    return STATUS_OK;
}

static bool has_films(const struct job_cloth *cloth)
{
    bool has = !isnan(cloth->sequins.width_um);
    for (size_t k = 0; k < cloth->n_yarn; k++) has |= !isnan(cloth->yarn[k].film.width_um);
    return has;
}

status job_film_check_picture(const struct job_cloth *cloth, const struct job_surface_picture *p, size_t i,
                              struct error *err)
{
    char field[64];
    const bool by_cells = p->visibility_by_tables || p->deep_by_cells;
    if (p->method == JOB_PICTURE_PATH || p->method == JOB_PICTURE_SHEARED ||
        (p->method == JOB_PICTURE_FAST && !by_cells) || !has_films(cloth))
        return STATUS_OK;
    const char *key = p->method != JOB_PICTURE_FAST ? "method" : p->deep_by_cells ? "deep_light" : "visibility";
    snprintf(field, sizeof field, "pictures[%zu].%s", i, key);
    return error_set_field(err, STATUS_INVALID, field,
                           "'%s': such a picture cannot show the films or sequins of the cloth; take the method "
                           "\"path\", or \"fast\" without light from cells",
                           field);
}
