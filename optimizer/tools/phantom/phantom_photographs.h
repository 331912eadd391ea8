/* Photographs of a phantom: one rendering per row of a table of configurations, with known scattering parameters. */
#ifndef SELVEDGE_OPTIMIZER_PHANTOM_PHOTOGRAPHS_H
#define SELVEDGE_OPTIMIZER_PHANTOM_PHOTOGRAPHS_H

#include "base/catalogue/model_sets.h"
#include "base/thread_pool.h"
#include "renderer/scattering/scattering.h"

#include <stdbool.h>
#include <stdint.h>

struct phantom_photograph_option {
    const char *fiber_file; /* .hair, or text "x y z radius" with tile_mm */
    double tile_mm[2];      /* 0: as the file states */
    const char *table_file; /* CSV (phantom_view_table.h); NULL: the built-in 16 + 24 configurations */
    const char *folder;     /* created when it does not exist */
    const struct scattering_model *model;
    struct model_sets sets;            /* the parameters of the model: one set, or one for each group of fibers */
    double param[SCATTERING_MAX_FLAT]; /* of sets, internal units */
    uint64_t n_path;                   /* per photograph */
    size_t px;                         /* edge of the square picture */
    double noise;                      /* relative standard deviation of an error per photograph and channel */
    uint64_t seed;
    double lamp_side_cm, lamp_distance_cm, camera_distance_cm, crop_cm, camera_blur_mm;
    double environment_rgb[3];               /* radiance of light from all around, besides the lamp */
    bool lamp_directional, camera_far_field; /* as lamp.kind and camera.far_field of a job */
    bool black_sheet;
};

void phantom_photograph_option_default(struct phantom_photograph_option *o);

/* Sets model, sets and param: the start values of the scattering model for n_group groups of fibers; 0 or 1: one set
 * for all fibers. STATUS_INVALID. */
status phantom_photograph_model(struct phantom_photograph_option *o, const char *model_id,
                                const char (*group)[MODEL_SET_NAME_BYTES], size_t n_group, struct error *err);

/* Reads the value of --param, "NAME=v" or "NAME=r,g,b" in file units. NAME is a parameter, or a colour with three
 * channels; with the name of a group before it ("warp.C_R"), or without for all groups. Returns STATUS_INVALID with a
 * text that names the allowed values. */
status phantom_param_parse(const struct model_info *model, const char *text, double *param, struct error *err);

/* Writes FOLDER/fit-00.exr .. held-out-23.exr, FOLDER/photographs.json (the array "photographs" of a job document)
 * and FOLDER/truth.json (parameters in file units, set-up, counts, and for each photograph the mean rgb without noise
 * and its standard error). */
status phantom_photographs_make(const struct phantom_photograph_option *o, struct thread_pool *pool,
                                const struct progress *progress, struct error *err);

#endif
