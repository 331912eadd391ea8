#include "renderer/image/image_exr.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

static double positive(exr_const_context_t file, const char *name)
{
    float value = 0.0f;
    bool known = exr_attr_get_float(file, 0, name, &value) == EXR_ERR_SUCCESS && value > 0.0f && isfinite(value);
    return known ? (double)value : NAN;
}

static void append_name(char list[96], const char *name)
{
    size_t n = strlen(list);
    snprintf(list + n, 96 - n, "%s%s", n > 0 ? ", " : "", name);
}

static void take_primaries(exr_const_context_t file, struct exr_statements *said)
{
    exr_attr_chromaticities_t c;
    said->has_primaries = exr_attr_get_chromaticities(file, 0, "chromaticities", &c) == EXR_ERR_SUCCESS;
    if (!said->has_primaries) return;
    said->primaries = (struct color_primaries){{{(double)c.red_x, (double)c.red_y},
                                                {(double)c.green_x, (double)c.green_y},
                                                {(double)c.blue_x, (double)c.blue_y},
                                                {(double)c.white_x, (double)c.white_y}}};
}

/* The names that say nothing beside the samples, or are read into members of their own. */
static bool is_known(const char *name)
{
    static const char *const known[] = {"channels",
                                        "compression",
                                        "dataWindow",
                                        "displayWindow",
                                        "lineOrder",
                                        "pixelAspectRatio",
                                        "screenWindowCenter",
                                        "screenWindowWidth",
                                        "type",
                                        "name",
                                        "version",
                                        "chunkCount",
                                        "tiles",
                                        "chromaticities",
                                        "expTime",
                                        "isoSpeed",
                                        "aperture",
                                        "maxSamplesPerPixel"};
    for (size_t i = 0; i < sizeof known / sizeof *known; i++)
        if (strcmp(known[i], name) == 0) return true;
    return false;
}

static void take_names(exr_const_context_t file, struct exr_statements *said)
{
    const exr_attr_chlist_t *list = NULL;
    const exr_attribute_t *attribute = NULL;
    int32_t n = 0;
    if (exr_get_channels(file, 0, &list) == EXR_ERR_SUCCESS && list != NULL)
        for (int i = 0; i < list->num_channels; i++) append_name(said->channels, list->entries[i].name.str);
    if (exr_get_attribute_count(file, 0, &n) != EXR_ERR_SUCCESS) return;
    for (int32_t i = 0; i < n; i++)
        if (exr_get_attribute_by_index(file, 0, EXR_ATTR_LIST_FILE_ORDER, i, &attribute) == EXR_ERR_SUCCESS &&
            !is_known(attribute->name))
            append_name(said->attributes, attribute->name);
}

void exr_statements_read(exr_const_context_t file, struct exr_statements *said)
{
    exr_attr_box2i_t data, display;
    float aspect = 1.0f;
    memset(said, 0, sizeof *said);
    said->exposure_s = positive(file, "expTime");
    said->iso = positive(file, "isoSpeed");
    said->aperture = positive(file, "aperture");
    exr_get_pixel_aspect_ratio(file, 0, &aspect);
    said->pixel_aspect = (double)aspect;
    if (exr_get_count(file, &said->n_part) != EXR_ERR_SUCCESS) said->n_part = 1;
    said->has_other_window = exr_get_data_window(file, 0, &data) == EXR_ERR_SUCCESS &&
                             exr_get_display_window(file, 0, &display) == EXR_ERR_SUCCESS &&
                             memcmp(&data, &display, sizeof data) != 0;
    take_primaries(file, said);
    take_names(file, said);
}
