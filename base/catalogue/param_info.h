/* The description of one parameter of a model: its name, unit, range, start, the scale on which a fit moves it, its
 * kind of quantity and its meaning. Pure data: everyone who handles parameters (renderer, fit, job document, reports)
 * reads it from here and infers nothing from names, units or ranges.
 *
 * Parameters are numbered flat: a colour takes three consecutive slots r, g, b. Values are in internal units (radians,
 * 1/m); files and users see the unit that `unit` names. */
#ifndef SELVEDGE_BASE_PARAM_INFO_H
#define SELVEDGE_BASE_PARAM_INFO_H

#include "base/status.h"

#include <stdbool.h>
#include <stddef.h>

/* The unit of a parameter in files. Inside: dimensionless, radians, 1/m. */
enum param_unit { PARAM_UNIT_NONE, PARAM_UNIT_DEG, PARAM_UNIT_PER_CM, PARAM_N_UNIT };

/* The scale on which a fit moves a parameter (optimizer/fit/objective/coordinate.h): p, ln p, or ln(p / (1 - p)). */
enum param_coordinate { PARAM_LINEAR, PARAM_LOG, PARAM_LOGIT, PARAM_N_COORDINATE };

enum param_kind {
    PARAM_COLOUR,     /* share of light, one value for each channel */
    PARAM_LOBE_WIDTH, /* angular width of a scattering lobe */
    PARAM_SHAPE,      /* any other quantity of a model */
    PARAM_DENSITY,    /* the density multiplier of a cloth that is seen as a volume */
    PARAM_NUISANCE,   /* of the photographs (gain, stray light), not of the cloth */
    PARAM_N_KIND
};

/* One flat parameter slot. */
struct param_info {
    const char *name;   /* "C_R.r", "beta_TT": unique in the model */
    const char *symbol; /* group name: "C_R" */
    enum param_kind kind;
    enum param_unit unit;       /* of files */
    int channel;                /* 0 r, 1 g, 2 b; -1 acts on all channels */
    double lower, upper, start; /* internal unit */
    enum param_coordinate coordinate;
    const char *meaning; /* one sentence */
    const char *set;     /* name of the parameter set that it belongs to; NULL: the cloth has one set (model_sets.h) */
};

/* "", "deg" or "1/cm"; "linear", "log" or "logit"; "colour", "lobe_width", "shape", "density" or "nuisance". */
const char *param_unit_name(enum param_unit unit);
const char *param_coordinate_name(enum param_coordinate coordinate);
const char *param_kind_name(enum param_kind kind);

/* A value in the unit of files -> internal unit, and back. */
double param_from_file_unit(const struct param_info *p, double value);
double param_to_file_unit(const struct param_info *p, double value);

/* Returns the name without the prefix of the set: "C_R.r" for "warp.C_R.r". */
const char *param_own_name(const struct param_info *p);
const char *param_own_symbol(const struct param_info *p);
/* True when key names the parameter: its name ("warp.C_R.r"), its symbol ("warp.C_R"), or one of them without the set
 * ("C_R.r", "C_R"), which names the parameter in every set. */
bool param_is_named(const struct param_info *p, const char *key);

/* Index of a flat parameter by name, or -1. */
int param_index(const struct param_info *info, size_t n_param, const char *name);

/* Checks param[n_param] of the scattering model model_id against its bounds, widened by 1e-9 of their distance so that
 * a bound that went through a file is still inside. STATUS_INVALID with the parameter's name in err->field for a value
 * outside or NaN. */
status param_check(const struct param_info *info, size_t n_param, const char *model_id, const double *param,
                   struct error *err);

#endif
