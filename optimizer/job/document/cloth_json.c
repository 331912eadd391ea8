#include "optimizer/job/document/cloth_json.h"

#include <math.h>
#include <stdio.h>

json_t *cloth_draft_json(const struct cloth_description *d)
{
    json_t *list = json_array();
    for (size_t i = d->n_weft; i-- > 0;) {
        char row[CLOTH_MAX_DRAFT + 1] = "";
        for (size_t j = 0; j < d->n_warp; j++) row[j] = d->warp_over[i][j] ? '1' : '0';
        json_array_append_new(list, json_string(row));
    }
    return list;
}

static json_t *order_json(const struct cloth_description *d, enum cloth_direction direction)
{
    json_t *list = json_array();
    for (size_t i = 0; i < d->n_order[direction]; i++)
        json_array_append_new(list, json_integer(d->order[direction][i]));
    return list;
}

static void put_numbers(json_t *section, const struct cloth_description *d, const double *number, int kind)
{
    for (size_t i = 0; i < d->n_number; i++)
        if (d->number[i].kind == kind)
            json_object_set_new(section, d->number[i].info->name,
                                json_real(number != NULL ? number[i] : d->number[i].value));
}

static void put_material(json_t *to, const char *prefix, const struct film_material *m)
{
    char key[32];
    json_t *color = json_array();
    for (int c = 0; c < 3; c++) json_array_append_new(color, json_real(round(1e4 * (double)m->color[c]) / 1e4));
    snprintf(key, sizeof key, "%scolor", prefix);
    json_object_set_new(to, key, color);
    snprintf(key, sizeof key, "%sroughness", prefix);
    json_object_set_new(to, key, json_real(round(1e4 * (double)m->roughness) / 1e4));
    snprintf(key, sizeof key, "%ssurface", prefix);
    json_object_set_new(to, key, json_string(film_surface_names[m->surface]));
    snprintf(key, sizeof key, "%soptics", prefix);
    json_object_set_new(to, key, json_string(film_optics_names[m->optics]));
    if (m->surface == FILM_SMOOTH) return;
    snprintf(key, sizeof key, "%sgrain_um", prefix);
    json_object_set_new(to, key, json_real(round(1e4 * (double)m->grain_um) / 1e4));
}

static void put_film(json_t *yarn, const struct cloth_film *f)
{
    if (!(f->width_um > 0.0)) return;
    json_object_set_new(yarn, "film_width_um", json_real(f->width_um));
    json_object_set_new(yarn, "film_thickness_um", json_real(f->thickness_um));
    json_object_set_new(yarn, "film_wraps_per_m", json_real(f->wraps_per_m));
    put_material(yarn, "film_", &f->material);
}

static void put_sequins(json_t *section, const struct cloth_sequins *q)
{
    if (!(q->diameter_um > 0.0)) return;
    json_object_set_new(section, "sequin_diameter_um", json_real(q->diameter_um));
    json_object_set_new(section, "sequin_thickness_um", json_real(q->thickness_um));
    json_object_set_new(section, "sequin_spacing_um", json_real(q->spacing_um));
    json_object_set_new(section, "sequin_row_spacing_um", json_real(q->row_spacing_um));
    json_object_set_new(section, "sequin_tilt_deg", json_real(q->tilt_deg));
    json_object_set_new(section, "sequin_tilt_spread_deg", json_real(q->tilt_spread_deg));
    put_material(section, "sequin_", &q->material);
}

static json_t *yarn_json(const struct cloth_description *d, const double *number, size_t k)
{
    json_t *yarn =
        json_pack("{s:I, s:I}", "fibers", (json_int_t)d->kind[k].n_fiber, "plies", (json_int_t)d->kind[k].n_ply);
    if (d->kind[k].name[0] != '\0') json_object_set_new(yarn, "name", json_string(d->kind[k].name));
    if (d->kind[k].n_fiber == 0) json_object_del(yarn, "fibers");
    put_film(yarn, &d->kind[k].film);
    if (d->kind[k].melange_with >= 0) json_object_set_new(yarn, "melange_with", json_integer(d->kind[k].melange_with));
    put_numbers(yarn, d, number, (int)k);
    return yarn;
}

json_t *cloth_section_json(const struct cloth_description *d, const double *number)
{
    json_t *section = json_object(), *yarns = json_array();
    if (d->weave[0] != '\0')
        json_object_set_new(section, "weave", json_string(d->weave));
    else
        json_object_set_new(section, "draft", cloth_draft_json(d));
    if (d->structure != CLOTH_FELT) {
        if (d->structure != CLOTH_KNIT) json_object_set_new(section, "warp", order_json(d, CLOTH_WARP));
        json_object_set_new(section, "weft", order_json(d, CLOTH_WEFT));
        json_object_set_new(section, "tile_warps", json_integer((json_int_t)d->n_yarn[CLOTH_WARP]));
        json_object_set_new(section, "tile_wefts", json_integer((json_int_t)d->n_yarn[CLOTH_WEFT]));
    }
    if (d->threads_per_cm[CLOTH_WARP] > 0.0)
        json_object_set_new(section, "warp_per_cm", json_real(d->threads_per_cm[CLOTH_WARP]));
    if (d->threads_per_cm[CLOTH_WEFT] > 0.0)
        json_object_set_new(section, "weft_per_cm", json_real(d->threads_per_cm[CLOTH_WEFT]));
    json_object_set_new(section, "seed", json_integer((json_int_t)d->seed));
    put_numbers(section, d, number, -1);
    put_sequins(section, &d->sequins);
    for (size_t k = 0; k < d->n_kind; k++) json_array_append_new(yarns, yarn_json(d, number, k));
    json_object_set_new(section, "yarns", yarns);
    return section;
}
