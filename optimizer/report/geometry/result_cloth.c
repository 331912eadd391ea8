#include "optimizer/report/geometry/result_cloth.h"

#include "base/angle.h"
#include "optimizer/job/document/cloth_json.h"
#include "optimizer/job/document/json_number.h"

static json_t *numbers_json(const struct cloth_description *d, const double *number)
{
    json_t *list = json_array();
    for (size_t i = 0; i < d->n_number; i++) {
        const struct cloth_number *n = &d->number[i];
        json_array_append_new(list, json_pack("{s:s, s:o, s:s, s:b, s:o, s:o}", "name", n->name, "value",
                                              json_number(number != NULL ? number[i] : n->value), "unit", n->info->unit,
                                              "fitted", (int)n->fitted, "lower", json_number(n->lower), "upper",
                                              json_number(n->upper)));
    }
    return list;
}

static json_t *kinds_json(const struct cloth_description *d, const struct cloth_report *r)
{
    json_t *list = json_array();
    for (size_t k = 0; k < d->n_kind; k++)
        json_array_append_new(
            list, json_pack("{s:o, s:o, s:o, s:o, s:o, s:o, s:o}", "fibers_in_section", json_count(d->kind[k].n_fiber),
                            "plies", json_count(d->kind[k].n_ply), "width_um", json_number(1e6 * r->yarn_width_m[k]),
                            "height_um", json_number(1e6 * r->yarn_height_m[k]), "surface_angle_deg",
                            json_number(DEG_PER_RAD * r->surface_angle_rad[k]), "n_fiber", json_count(r->n_fiber[k]),
                            "length_mm", json_number(1e3 * r->length_m[k])));
    return list;
}

json_t *result_cloth_json(const struct cloth_description *d, const double *number, const struct cloth_report *r)
{
    json_t *made =
        json_pack("{s:o, s:o, s:o, s:o, s:o, s:o, s:o, s:o, s:o, s:o}", "tile_yarns", json_count_list(r->n_yarn, 2),
                  "yarn_spacing_um", json_number_list(r->yarn_spacing_m, 2, 1e6), "thickness_um",
                  json_number(1e6 * r->thickness_m), "thickness_without_hairs_um",
                  json_number(1e6 * r->body_thickness_m), "cover", json_number(r->cover), "volume_fraction",
                  json_number(r->volume_fraction), "overlap_mean", json_number(r->overlap_mean), "overlap_max",
                  json_number(r->overlap_max), "strain_p95", json_number(r->strain_p95), "yarns", kinds_json(d, r));
    json_t *json = json_pack("{s:s, s:I, s:o, s:o}", "weave", d->weave[0] != '\0' ? d->weave : "draft", "seed",
                             (json_int_t)d->seed, "numbers", numbers_json(d, number), "made", made);
    if (d->n_weft > 0) json_object_set_new(json, "draft", cloth_draft_json(d));
    json_object_set_new(json, "description", cloth_section_json(d, number));
    return json;
}
