/* Inputs of estimates and renderings, made from a model and its parameter values. */
#ifndef SELVEDGE_TESTS_TRACE_INPUT_H
#define SELVEDGE_TESTS_TRACE_INPUT_H

#include "renderer/estimate/radiance_source.h"

/* Fills in model. model, scene and param must outlive the returned input. */
struct radiance_input trace_input_surface(const struct scene *scene, const struct scattering_model *m,
                                          const double *param, struct appearance *model);

/* A volume model. param holds the parameters of its phase function and then the density multiplier. */
struct trace_volume {
    struct appearance model;
    double param[SCATTERING_MAX_PARAM];
};
struct radiance_input trace_input_volume(const struct volume_scene *scene, const struct phase_model *m,
                                         const double *param, double multiplier_per_m, struct trace_volume *storage);

#endif
