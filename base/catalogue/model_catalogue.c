#include "base/catalogue/model_catalogue.h"

#include <string.h>

/* The last parameter of every volume model. 10 to 100,000 per cm are mean free paths of 0.1 um to 1 mm in solid
 * material; the thesis holds it at 4000. */
#define DENSITY                                                                                                        \
    {                                                                                                                  \
        .name = MODEL_DENSITY_MULTIPLIER, .symbol = MODEL_DENSITY_MULTIPLIER, .kind = PARAM_DENSITY,                   \
        .unit = PARAM_UNIT_PER_CM, .channel = -1, .lower = 1e3, .upper = 1e7, .start = 4e5, .coordinate = PARAM_LOG,   \
        .meaning = "Extinction of full density across the fibers."                                                     \
    }

#define TEXTS(row, id, title) const char row##_id[] = id, row##_title[] = title;
#define SURFACE_MODEL(name, id, title, ...)                                                                            \
    TEXTS(surface_##name, id, title)                                                                                   \
    const struct param_info surface_##name##_param[] = {__VA_ARGS__};
#define VOLUME_MODEL(name, id, title, ...)                                                                             \
    TEXTS(volume_##name, id, title)                                                                                    \
    const struct param_info volume_##name##_param[] = {__VA_ARGS__, DENSITY};
#include "base/catalogue/models.def"

static const struct model_info catalogue[] = {
#define SURFACE_MODEL(name, ...)                                                                                       \
    {surface_##name##_id, surface_##name##_title, MODEL_SURFACE, surface_##name##_n_param, surface_##name##_param},
#define VOLUME_MODEL(name, ...)                                                                                        \
    {volume_##name##_id, volume_##name##_title, MODEL_VOLUME, volume_##name##_n_param + 1, volume_##name##_param},
#include "base/catalogue/models.def"
};

static const struct model_nesting nesting[] = {
#define SURFACE_MODEL(...)
#define VOLUME_MODEL(...)
#define MODEL_CONTAINS(outer, inner, symbol, ...) {surface_##outer##_id, surface_##inner##_id, symbol, {__VA_ARGS__}},
#include "base/catalogue/models.def"
};

static const struct {
    const char *near, *far;
} far_field[] = {
#define SURFACE_MODEL(...)
#define VOLUME_MODEL(...)
#define MODEL_HAS_FAR_FIELD(near, far) {surface_##near##_id, surface_##far##_id},
#include "base/catalogue/models.def"
};

static const char *const with_speckle[] = {
#define SURFACE_MODEL(...)
#define VOLUME_MODEL(...)
#define MODEL_HAS_SPECKLE(name) surface_##name##_id,
#include "base/catalogue/models.def"
};

const struct model_info *model_catalogue_at(size_t i)
{
    return i < sizeof catalogue / sizeof *catalogue ? &catalogue[i] : NULL;
}

const struct model_info *model_catalogue_find(const char *id)
{
    for (size_t i = 0; i < sizeof catalogue / sizeof *catalogue; i++)
        if (strcmp(catalogue[i].id, id) == 0) return &catalogue[i];
    return NULL;
}

const char *model_catalogue_with_speckle(size_t i)
{
    return i < sizeof with_speckle / sizeof *with_speckle ? with_speckle[i] : NULL;
}

bool model_catalogue_has_speckle(const char *id)
{
    for (size_t i = 0; i < sizeof with_speckle / sizeof *with_speckle; i++)
        if (strcmp(with_speckle[i], id) == 0) return true;
    return false;
}

const char *model_catalogue_near_field(size_t i)
{
    return i < sizeof far_field / sizeof *far_field ? far_field[i].near : NULL;
}

const char *model_catalogue_far_field(const char *id)
{
    for (size_t i = 0; i < sizeof far_field / sizeof *far_field; i++)
        if (strcmp(far_field[i].near, id) == 0) return far_field[i].far;
    return NULL;
}

const struct model_nesting *model_catalogue_nesting(size_t i)
{
    return i < sizeof nesting / sizeof *nesting ? &nesting[i] : NULL;
}
