#include "optimizer/report/geometry/weave_json.h"

#include "optimizer/job/document/json_number.h"

enum { MM_PER_CM = 10 };

json_t *weave_draft_json(const struct weave_draft *draft)
{
    json_t *list = json_array();
    for (size_t j = 0; j < draft->n_weft; j++) {
        char row[WEAVE_CELL_MAX + 1] = "";
        for (size_t i = 0; i < draft->n_warp; i++) row[i] = draft->warp_on_top[j * draft->n_warp + i] != 0 ? '1' : '0';
        json_array_append_new(list, json_string(row));
    }
    return list;
}

/* Yarns of one set: 0 warp, 1 weft. */
static json_t *yarns_json(const struct weave_guess *g, int set, double px_per_mm)
{
    json_t *j = json_pack("{s:o, s:o, s:o, s:o}", "spacing_px", json_number(g->spacing_px[set]), "direction_deg",
                          json_number(g->direction_deg[set]), "width_over_spacing", json_number(g->cover[set]),
                          "color_rgb", json_number_list(set == 0 ? g->warp.rgb : g->weft.rgb, 3, 1.0));
    if (px_per_mm > 0.0)
        json_object_set_new(j, "yarns_per_cm", json_number(MM_PER_CM * px_per_mm / g->spacing_px[set]));
    return j;
}

json_t *weave_guess_json(const struct weave_guess *guess, double px_per_mm)
{
    char name[32];
    weave_draft_name(&guess->draft, name, sizeof name);
    json_t *confidence = json_pack("{s:o, s:o, s:o, s:o}", "yarns", json_number(guess->yarns_confidence), "draft",
                                   json_number(guess->draft_confidence), "width_over_spacing",
                                   json_number(guess->cover_confidence), "color", json_number(guess->color_confidence));
    return json_pack("{s:s, s:o, s:o, s:o, s:o, s:o, s:o, s:o}", "weave", name, "draft",
                     weave_draft_json(&guess->draft), "warp", yarns_json(guess, 0, px_per_mm), "weft",
                     yarns_json(guess, 1, px_per_mm), "texture_period_px", json_number(guess->texture_period_px),
                     "contrast", json_number_list(guess->contrast, WEAVE_SCALES, 1.0), "middle_px",
                     json_number_list(guess->middle_px, 2, 1.0), "confidence", confidence);
}
