/* The catalogue of models: their ids and parameters. It is pure data (models.def), so that a program can check a job
 * document without linking the renderer. A new model is a folder of renderer/scattering/models and a line of
 * models.def; the registries of the renderer follow from the same rows.
 */
#ifndef SELVEDGE_BASE_MODEL_CATALOGUE_H
#define SELVEDGE_BASE_MODEL_CATALOGUE_H

#include "base/catalogue/param_info.h"

#include <stdbool.h>

/* Parameters of one model, parameter sets of one model in a cloth of several groups of fibers, and parameters of all
 * sets together. */
enum { MODEL_MAX_PARAM = 16, MODEL_MAX_SET = 8, MODEL_MAX_FLAT = 64 };

#define MODEL_DENSITY_MULTIPLIER "density_multiplier"

/* The geometry that a model scatters at: the surfaces of fibers, or the cloth as a volume. */
enum model_kind { MODEL_SURFACE, MODEL_VOLUME };

struct model_info {
    const char *id;    /* "two_lobe.v1": no other model has it, whatever its kind */
    const char *title; /* one line for people, with the source */
    enum model_kind kind;
    size_t n_param;                 /* at most MODEL_MAX_PARAM */
    const struct param_info *param; /* of a volume model: the phase function's, then the density multiplier */
};

/* The models of surfaces first: the i-th, NULL behind the last. */
const struct model_info *model_catalogue_at(size_t i);
/* NULL when no model has that id. */
const struct model_info *model_catalogue_find(const char *id);

/* A model that contains another: where its parameter `symbol` goes to 0. */
enum { MODEL_N_NESTED_START = 2 };
struct model_nesting {
    const char *outer, *inner;          /* ids */
    const char *symbol;                 /* the parameter that outer has and inner has not */
    double start[MODEL_N_NESTED_START]; /* its values, internal units, for fits that start from a result of inner */
};

/* The i-th, NULL behind the last. */
const struct model_nesting *model_catalogue_nesting(size_t i);
/* The id of the i-th model with speckle (renderer/scattering/speckle.h), NULL behind the last, and whether a model has
 * it. */
const char *model_catalogue_with_speckle(size_t i);
bool model_catalogue_has_speckle(const char *id);
/* The same of models that can have the light of one mode alone (renderer/scattering/scattering.h). */
const char *model_catalogue_with_modes(size_t i);
bool model_catalogue_has_modes(const char *id);
/* The same of models whose light changes with the turn of the fiber's section. */
const char *model_catalogue_with_flat_section(size_t i);
bool model_catalogue_has_flat_section(const char *id);
/* The id of the i-th near field that has a far field, NULL behind the last, and the id of a model's far field: the mean
 * over the width of the fiber with the same parameters (model_row.h). NULL: the model has none. */
const char *model_catalogue_near_field(size_t i);
const char *model_catalogue_far_field(const char *id);

#endif
