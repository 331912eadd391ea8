/* "texture" of the section "fit": the contrast of photographs at a stated scale. */
#include "base/catalogue/method_catalogue.h"
#include "optimizer/job/job_document_parts.h"

#include <math.h>
#include <string.h>

size_t job_texture_cells(const struct job_document *doc)
{
    return (size_t)lround(10.0 * doc->crop_cm / doc->texture_block_mm);
}

double job_texture_cell_mm(const struct job_document *doc)
{
    return 10.0 * doc->crop_cm / (double)job_texture_cells(doc);
}

static status check_use(const struct job_document *doc, struct error *err)
{
    const char *const field = "fit.texture";
    if (doc->measurement_file[0] != '\0')
        return error_set_field(err, STATUS_INVALID, field, "'%s' needs photographs: a table of means has no texture",
                               field);
    if (doc->texture_weight > 0.0 && (method_catalogue_find(doc->method)->takes & METHOD_TAKES_TEXTURE) == 0)
        return error_set_field(err, STATUS_INVALID, field,
                               "'%s' with a weight needs the method '%s': '%s' has no such terms", field,
                               method_catalogue_taking(METHOD_TAKES_TEXTURE)->id, doc->method);
    if (doc->model[0].option.stray_light)
        return error_set_field(err, STATUS_INVALID, field,
                               "'%s' cannot be used with 'fit.nuisance.stray_light': a contrast that is lowered by "
                               "stray light is not modelled",
                               field);
    return STATUS_OK;
}

status job_parse_texture(const struct json_field *fit, struct job_document *doc, struct error *err)
{
    static const char *const key[] = {"block_mm", "weight", NULL};
    struct json_field f;
    bool present;
    status s = json_field_object(fit, "texture", &f, &present, err);
    if (s != STATUS_OK || !present) return s;
    double crop_mm = 10.0 * doc->crop_cm, block_mm = 0.0;
    doc->texture_weight = 1.0;
    s = json_field_check_keys(&f, key, err);
    if (s == STATUS_OK) s = json_field_required_number(&f, "block_mm", 1e-3, 1e3, &block_mm, err);
    if (s == STATUS_OK) s = json_field_number(&f, "weight", 0.0, 1e3, &doc->texture_weight, err);
    if (s != STATUS_OK) return s;
    if (block_mm > crop_mm / 2.0 || lround(crop_mm / block_mm) > JOB_MAX_TEXTURE_CELLS)
        return error_set_field(err, STATUS_INVALID, "fit.texture.block_mm",
                               "'fit.texture.block_mm' is %g: it must divide the crop of %g mm into 2 to %d blocks a "
                               "side, which is %g to %g mm",
                               block_mm, crop_mm, JOB_MAX_TEXTURE_CELLS, crop_mm / JOB_MAX_TEXTURE_CELLS,
                               crop_mm / 2.0);
    doc->texture_block_mm = block_mm;
    return check_use(doc, err);
}
