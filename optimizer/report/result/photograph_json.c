#include "optimizer/report/result/photograph_json.h"
#include "optimizer/job/document/job_setup.h"
#include "optimizer/job/document/json_number.h"
#include "optimizer/photographs/camera/color_matrix.h"

#include <math.h>

json_t *photograph_record_json(const struct photograph_record *r)
{
    const struct photograph_info *i = &r->info;
    if (i->format == NULL) return NULL;
    json_t *json = json_pack("{s:s, s:i, s:b, s:s?, s:[i,i], s:o, s:o, s:o, s:o, s:o, s:b}", "format", i->format,
                             "bits", (int)i->bits, "less_trustworthy", (int)i->less_trustworthy, "camera",
                             i->camera[0] != '\0' ? i->camera : NULL, "size_px", (int)r->width, (int)r->height,
                             "exposure_s", json_number(i->exposure_s), "iso", json_number(i->iso), "aperture",
                             json_number(i->aperture), "black_level", json_number(i->black_level), "saturated_share",
                             json_number(r->saturated_share), "resampled", (int)r->resampled);
    json_object_set_new(json, "n_exposure", json_count(r->n_exposure));
    double color_se[3];
    for (size_t c = 0; c < 3; c++) color_se[c] = photograph_color_se(r, c);
    json_object_set_new(json, "color_se", json_number_list(color_se, 3, 1.0));
    json_object_set_new(json, "fitted_exposure_s",
                        r->n_exposure > 1 ? json_number_list(r->fitted_s, r->n_exposure, 1.0) : json_null());
    json_object_set_new(json, "exposure_se", json_number_list(r->exposure_se_rgb, 3, 1.0));
    json_object_set_new(json, "noise_se", r->merged ? json_number_list(r->noise_se_rgb, 3, 1.0) : json_null());
    return json;
}

json_t *photograph_column_json(const char *file, const struct job_column *k)
{
    if (k->number == 0) return NULL;
    return json_pack("{s:s, s:o, s:o, s:o, s:o}", "file", file, "number", json_count(k->number), "n", json_count(k->n),
                     "angle_deg", json_number(k->angle_deg), "angle_se_deg", json_number(k->angle_se_deg));
}

static json_t *patch_json(const struct color_chart *k, size_t i)
{
    double rgb[3];
    color_matrix_apply(k->fit.matrix, k->measured_rgb[i], rgb);
    for (size_t c = 0; c < 3; c++) rgb[c] /= k->light[i];
    return json_pack("{s:s, s:o, s:o, s:o, s:o, s:o, s:o, s:o, s:b}", "name", color_chart_patch_name(i), "camera",
                     json_number_list(k->measured_rgb[i], 3, 1.0), "measured", json_number_list(rgb, 3, 1.0),
                     "reference", json_number_list(k->wanted_rgb[i], 3, 1.0), "delta_e_before",
                     json_number(k->delta_e_before[i]), "delta_e_after", json_number(k->delta_e_after[i]),
                     "delta_e_left_out", json_number(k->delta_e_left_out[i]), "light", json_number(k->light[i]),
                     "saturated", (int)k->saturated[i]);
}

static json_t *mean_and_largest(const double *v)
{
    double mean = 0.0, largest = 0.0;
    for (size_t i = 0; i < COLOR_CHART_PATCHES; i++) {
        mean += v[i] / COLOR_CHART_PATCHES;
        largest = fmax(largest, v[i]);
    }
    return json_pack("{s:f, s:f}", "mean", mean, "largest", largest);
}

json_t *photograph_color_json(const struct photograph_process *k, const struct job_setup *setup)
{
    if (!k->has_color) return json_null();
    json_t *json = json_pack("{s:s, s:s, s:o}", "kind", setup->has_chart ? "chart" : "white", "file",
                             setup->has_chart ? setup->chart.file : setup->white.file, "matrix",
                             json_number_list(k->matrix, 9, 1.0));
    if (!setup->has_chart) return json;
    json_t *patches = json_array();
    for (size_t i = 0; i < COLOR_CHART_PATCHES; i++) json_array_append_new(patches, patch_json(&k->chart, i));
    json_object_set_new(json, "edition", json_string(setup->chart_from_2014 ? "from_2014" : "before_2014"));
    json_object_set_new(json, "found_automatically", json_boolean(k->chart.found_automatically));
    json_object_set_new(json, "corners_px", json_number_list(k->chart.corner_px, 8, 1.0));
    json_object_set_new(json, "delta_e_2000_before", mean_and_largest(k->chart.delta_e_before));
    json_object_set_new(json, "delta_e_2000_after", mean_and_largest(k->chart.delta_e_after));
    json_object_set_new(json, "delta_e_2000_left_out", mean_and_largest(k->chart.delta_e_left_out));
    json_object_set_new(json, "worst_patch", json_string(color_chart_patch_name(k->chart.worst)));
    json_object_set_new(json, "matrix_used", json_boolean(k->chart.matrix_used));
    json_object_set_new(json, "light_range", json_number(k->chart.light_range));
    json_object_set_new(json, "scale_at", json_string(isnan(k->chart.scale_at_px[0]) ? "middle" : "cloth_px"));
    json_object_set_new(json, "patches", patches);
    json_object_set_new(json, "picture", json_string("pictures/color-chart.png"));
    return json;
}
