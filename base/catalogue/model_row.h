/* How the row of a scattering model is written. Rows are data in renderer/scattering/models, which programs without the
 * renderer know, too, so that they can check a job document.
 *
 *   SURFACE_MODEL(name, id, title, parameters...)   light scattering of a fiber's surface: the model's source defines
 *                                                   scattering_<name>, a struct scattering_model
 *   VOLUME_MODEL(name, id, title, parameters...)    phase function of a cloth as a volume: the model's source defines
 *                                                   phase_<name>, a struct phase_model. Every volume model has the
 *                                                   density multiplier as its last parameter, without naming it.
 *   MODEL_CONTAINS(outer, inner, symbol, value, value)   surface model `outer` becomes `inner` where its parameter
 *                                                   `symbol` goes to 0, and has no other parameter more. When a job
 *                                                   fits both, the fit of outer also starts from the result of inner,
 *                                                   with each of the two values.
 *   MODEL_HAS_SPECKLE(name)                         surface model `name` has speckle, for pictures.
 *   MODEL_HAS_MODES(name)                           surface model `name` can have the light of one mode alone
 *                                                   (scattering_model.mode), for profiles.
 *   MODEL_HAS_FLAT_SECTION(name)                    the light of surface model `name` changes with the turn of the
 *                                                   section (scattering_model.flat_section), which profiles can state.
 *   MODEL_HAS_FAR_FIELD(near, far)                  surface model `far` is the mean of the near field `near` over the
 *                                                   width of the fiber, with the same parameters. A pixel that is
 *                                                   wider than the fiber sees it (Yan et al. 2017, section 5.2).
 *
 * An id carries a version and is never used again for changed physics. Ranges and starts are in the units of files.
 *   COLOUR(symbol, coordinate, lower, upper, start, meaning)   three slots r, g, b
 *   LOBE_WIDTH(symbol, lower, upper, start, meaning)           degrees, fitted in its logarithm
 *   SHAPE(symbol, lower, upper, start, meaning)                dimensionless and positive, fitted in its logarithm
 *   SHARE(symbol, lower, upper, start, meaning)                between 0 and 1, fitted in its logit
 *   ALBEDO                                                     the albedo of a phase function, a COLOUR
 *
 * A source of a model includes the rows of its folder and nothing more. They then declare the constants that
 * SURFACE_MODEL_ROW and VOLUME_MODEL_ROW take: surface_<name>_id, _title, _param and the count _n_param. */
#ifndef SELVEDGE_BASE_MODEL_ROW_H
#define SELVEDGE_BASE_MODEL_ROW_H

#include "base/angle.h"
#include "base/catalogue/param_info.h"

#define SLOT(name, symbol, kind, unit, channel, scale, lower, upper, start, coordinate, meaning)                       \
    {                                                                                                                  \
        name, symbol, kind, unit, channel, lower *scale, upper *scale, start *scale, coordinate, meaning, NULL         \
    }
#define COLOUR(symbol, coordinate, lower, upper, start, meaning)                                                       \
    SLOT(symbol ".r", symbol, PARAM_COLOUR, PARAM_UNIT_NONE, 0, 1, lower, upper, start, coordinate, meaning),          \
        SLOT(symbol ".g", symbol, PARAM_COLOUR, PARAM_UNIT_NONE, 1, 1, lower, upper, start, coordinate, meaning),      \
        SLOT(symbol ".b", symbol, PARAM_COLOUR, PARAM_UNIT_NONE, 2, 1, lower, upper, start, coordinate, meaning)
#define LOBE_WIDTH(symbol, lower, upper, start, meaning)                                                               \
    SLOT(symbol, symbol, PARAM_LOBE_WIDTH, PARAM_UNIT_DEG, -1, RAD_PER_DEG, lower, upper, start, PARAM_LOG, meaning)
#define SHAPE(symbol, lower, upper, start, meaning)                                                                    \
    SLOT(symbol, symbol, PARAM_SHAPE, PARAM_UNIT_NONE, -1, 1, lower, upper, start, PARAM_LOG, meaning)
/* A share of light that is the same in all channels. */
#define SHARE(symbol, lower, upper, start, meaning)                                                                    \
    SLOT(symbol, symbol, PARAM_SHAPE, PARAM_UNIT_NONE, -1, 1, lower, upper, start, PARAM_LOGIT, meaning)
/* At an albedo of 1 paths end only where they leave the cloth, and long ones are cut off. */
#define ALBEDO                                                                                                         \
    COLOUR("alpha", PARAM_LOGIT, 0.001, 0.999, 0.85, "Albedo: share of the light that is scattered, not absorbed.")

/* The first members of a scattering_model or a phase_model. n_param of a volume model's row does not count the density
 * multiplier, which belongs to the volume and not to the phase function. */
#define SURFACE_MODEL_ROW(name) MODEL_ROW_FIELDS(surface_##name)
#define VOLUME_MODEL_ROW(name) MODEL_ROW_FIELDS(volume_##name)
#define MODEL_ROW_FIELDS(row) .id = row##_id, .title = row##_title, .n_param = row##_n_param, .param = row##_param

#define MODEL_ROW_CONSTANTS(row, ...)                                                                                  \
    extern const char row##_id[], row##_title[];                                                                       \
    extern const struct param_info row##_param[];                                                                      \
    enum { row##_n_param = sizeof((const struct param_info[]){__VA_ARGS__}) / sizeof(struct param_info) };

#ifndef SURFACE_MODEL
#define SURFACE_MODEL(name, id, title, ...)                                                                            \
    MODEL_ROW_CONSTANTS(surface_##name, __VA_ARGS__)                                                                   \
    extern const struct scattering_model scattering_##name;
#define VOLUME_MODEL(name, id, title, ...)                                                                             \
    MODEL_ROW_CONSTANTS(volume_##name, __VA_ARGS__)                                                                    \
    extern const struct phase_model phase_##name;
#endif
#ifndef MODEL_CONTAINS
#define MODEL_CONTAINS(outer, inner, symbol, ...)
#endif
#ifndef MODEL_HAS_SPECKLE
#define MODEL_HAS_SPECKLE(name)
#endif
#ifndef MODEL_HAS_MODES
#define MODEL_HAS_MODES(name)
#endif
#ifndef MODEL_HAS_FLAT_SECTION
#define MODEL_HAS_FLAT_SECTION(name)
#endif
#ifndef MODEL_HAS_FAR_FIELD
#define MODEL_HAS_FAR_FIELD(near, far)
#endif

#endif
