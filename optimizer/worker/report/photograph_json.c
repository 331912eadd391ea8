#include "optimizer/worker/report/photograph_json.h"
#include "optimizer/worker/report/json_number.h"

json_t *photograph_record_json(const struct photograph_record *r)
{
    const struct photograph_info *i = &r->info;
    if (i->format == NULL) return NULL;
    return json_pack("{s:s, s:i, s:b, s:s?, s:[i,i], s:o, s:o, s:o, s:o, s:o, s:b}", "format", i->format, "bits",
                     (int)i->bits, "less_trustworthy", (int)i->less_trustworthy, "camera",
                     i->camera[0] != '\0' ? i->camera : NULL, "size_px", (int)r->width, (int)r->height, "exposure_s",
                     json_number(i->exposure_s), "iso", json_number(i->iso), "aperture", json_number(i->aperture),
                     "black_level", json_number(i->black_level), "saturated_share", json_number(r->saturated_share),
                     "resampled", (int)r->resampled);
}
