#include "optimizer/job/option_key.h"
#include "base/option_id.h"

#include <stdio.h>
#include <string.h>

static const struct {
    const char *id, *key;
} option_key[] = {
    {OPTION_SCAN_FILES, "volume.files"},
    {OPTION_RAW, "volume.raw"},
    {OPTION_RAW_SHAPE, "volume.raw.shape"},
    {OPTION_RAW_TYPE, "volume.raw.type"},
    {OPTION_RAW_HEADER, "volume.raw.header_bytes"},
    {OPTION_VOXEL_SIZE, "volume.voxel_size_um"},
    {OPTION_AXES, "volume.axes"},
    {OPTION_MATRIX, "volume.matrix"},
    {OPTION_CROP_BOX, "volume.crop_voxel"},
    {OPTION_ALIGN, "volume.align"},
    {OPTION_CROP, "volume.crop"},
    {OPTION_DENSITY_LOW, "volume.density_low"},
    {OPTION_DENSITY_HIGH, "volume.density_high"},
    {OPTION_FILTER_S, "volume.filter.s"},
    {OPTION_FILTER_T, "volume.filter.t"},
    {OPTION_FILTER_LENGTH, "volume.filter.h"},
    {OPTION_FILTER_DENSITY, "volume.filter.eps_d"},
    {OPTION_FILTER_ANSWER, "volume.filter.eps_J"},
    {OPTION_LINK_REACH, "volume.link_sigma_voxel"},
    {OPTION_LEAST_VERTICES, "volume.min_vertices"},
    {OPTION_FIBER_FILE, "fibers.file"},
    {OPTION_TILE, "fibers.tile_mm"},
    {OPTION_DENSITY_VOXEL, "fibers.voxel_um"},
    {OPTION_MEASUREMENT_FILE, "measurements.file"},
    {OPTION_PHOTOGRAPHS, "photographs"},
    {OPTION_PHOTOGRAPH_FILE, "photographs[].file"},
    {OPTION_MODEL, "fit.model"},
    {OPTION_METHOD, "fit.method"},
    {OPTION_PATH_BUDGET, "fit.path_budget"},
    {OPTION_START, "fit.start"},
    {OPTION_STARTS, "fit.starts"},
    {OPTION_PRIORS, "fit.priors"},
    {OPTION_NUISANCE, "fit.nuisance"},
    {OPTION_TEXTURE_BLOCK, "fit.texture.block_mm"},
    {OPTION_FIT_RADIUS, "fit.fit_radius"},
    {OPTION_FIT_RADIUS_UPPER, "fit.fit_radius.upper_um"},
};

const char *job_option_key(const char *id)
{
    for (size_t i = 0; i < sizeof option_key / sizeof option_key[0]; i++)
        if (strcmp(option_key[i].id, id) == 0) return option_key[i].key;
    return NULL;
}

void job_option_resolve(const char *field, char *key, size_t n_bytes)
{
    char id[64];
    size_t n_id = strcspn(field, "[");
    snprintf(id, sizeof id, "%.*s", (int)n_id, field);
    const char *pattern = job_option_key(id);
    const char *place = pattern == NULL ? NULL : strstr(pattern, "[]");
    if (pattern == NULL)
        snprintf(key, n_bytes, "%s", field);
    else if (place == NULL)
        snprintf(key, n_bytes, "%s", pattern);
    else
        snprintf(key, n_bytes, "%.*s%s%s", (int)(place - pattern), pattern, field + n_id, place + 2);
}

status job_option_name_field(status code, struct error *err)
{
    if (code == STATUS_OK || err == NULL) return code;
    char key[sizeof err->field];
    job_option_resolve(err->field, key, sizeof key);
    memcpy(err->field, key, sizeof key);
    return code;
}
