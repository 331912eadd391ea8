#include "optimizer/report/findings/verdict_json.h"
#include "optimizer/job/document/json_number.h"

#include <math.h>

json_t *verdict_json(const struct verdict *v)
{
    if (v->code == VERDICT_NONE) return json_null();
    const char *rows = isfinite(v->error) || isfinite(v->allowed) ? verdict_rows_id(v->rows) : NULL;
    json_t *list = json_array();
    for (size_t i = 0; i < v->n_reservation; i++)
        json_array_append_new(list,
                              json_pack("{s:s, s:s}", "code", v->reservation[i].code, "text", v->reservation[i].text));
    return json_pack("{s:s, s:s, s:s, s:s?, s:o, s:o, s:o, s:o, s:o, s:o}", "code", verdict_code_id(v->code), "words",
                     verdict_code_words(v->code), "text", v->text, "judged_by", rows, "rel_rms", json_number(v->error),
                     "rel_rms_se", json_number(v->error_se), "allowed_rel_rms", json_number(v->allowed),
                     "one_color_rel_rms", json_number(v->one_color_error), "plain_brdf_rel_rms",
                     json_number(v->plain_brdf_error), "reservations", list);
}
