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

#define ROW_DATA(row, id, title, ...)                                                                                  \
    const char row##_id[] = id, row##_title[] = title;                                                                 \
    const struct param_info row##_param[] = {__VA_ARGS__};
#define SURFACE_MODEL(name, id, title, ...) ROW_DATA(surface_##name, id, title, __VA_ARGS__)
#define VOLUME_MODEL(name, id, title, ...) ROW_DATA(volume_##name, id, title, __VA_ARGS__, DENSITY)
#include "base/catalogue/models.def"
#undef SURFACE_MODEL
#undef VOLUME_MODEL

#define INFO(row, kind) {row##_id, row##_title, kind, sizeof row##_param / sizeof *row##_param, row##_param},
static const struct model_info catalogue[] = {
#define SURFACE_MODEL(name, ...) INFO(surface_##name, MODEL_SURFACE)
#define VOLUME_MODEL(...)
#include "base/catalogue/models.def"
#undef SURFACE_MODEL
#undef VOLUME_MODEL
#define SURFACE_MODEL(...)
#define VOLUME_MODEL(name, ...) INFO(volume_##name, MODEL_VOLUME)
#include "base/catalogue/models.def"
#undef VOLUME_MODEL
};

#define VOLUME_MODEL(...)
#undef MODEL_CONTAINS
#define MODEL_CONTAINS(outer, inner, symbol, ...) {surface_##outer##_id, surface_##inner##_id, symbol, {__VA_ARGS__}},
static const struct model_nesting nesting[] = {
#include "base/catalogue/models.def"
};
#undef MODEL_CONTAINS
#define MODEL_CONTAINS(...)

static const struct {
    const char *near, *far;
} far_field[] = {
#undef MODEL_HAS_FAR_FIELD
#define MODEL_HAS_FAR_FIELD(near, far) {surface_##near##_id, surface_##far##_id},
#include "base/catalogue/models.def"
};
#undef MODEL_HAS_FAR_FIELD
#define MODEL_HAS_FAR_FIELD(...)

static const char *const with_speckle[] = {
#undef MODEL_HAS_SPECKLE
#define MODEL_HAS_SPECKLE(name) surface_##name##_id,
#include "base/catalogue/models.def"
};
#undef MODEL_HAS_SPECKLE
#define MODEL_HAS_SPECKLE(...)

static const char *const with_modes[] = {
#undef MODEL_HAS_MODES
#define MODEL_HAS_MODES(name) surface_##name##_id,
#include "base/catalogue/models.def"
};
#undef MODEL_HAS_MODES
#define MODEL_HAS_MODES(...)

static const char *const with_flat_section[] = {
#undef MODEL_HAS_FLAT_SECTION
#define MODEL_HAS_FLAT_SECTION(name) surface_##name##_id,
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

/* The i-th of n ids, NULL behind the last. */
static const char *id_at(const char *const *id, size_t n, size_t i) { return i < n ? id[i] : NULL; }

static bool is_among(const char *const *id, size_t n, const char *wanted)
{
    for (size_t i = 0; i < n; i++)
        if (strcmp(id[i], wanted) == 0) return true;
    return false;
}

const char *model_catalogue_with_speckle(size_t i)
{
    return id_at(with_speckle, sizeof with_speckle / sizeof *with_speckle, i);
}

bool model_catalogue_has_speckle(const char *id)
{
    return is_among(with_speckle, sizeof with_speckle / sizeof *with_speckle, id);
}

const char *model_catalogue_with_modes(size_t i)
{
    return id_at(with_modes, sizeof with_modes / sizeof *with_modes, i);
}

bool model_catalogue_has_modes(const char *id)
{
    return is_among(with_modes, sizeof with_modes / sizeof *with_modes, id);
}

const char *model_catalogue_with_flat_section(size_t i)
{
    return id_at(with_flat_section, sizeof with_flat_section / sizeof *with_flat_section, i);
}

bool model_catalogue_has_flat_section(const char *id)
{
    return is_among(with_flat_section, sizeof with_flat_section / sizeof *with_flat_section, id);
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
