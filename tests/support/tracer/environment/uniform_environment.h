/* Paths from a camera through a cloth in a uniform environment of radiance 1: furnaces of whole cloths. */
#ifndef SELVEDGE_TESTS_UNIFORM_ENVIRONMENT_H
#define SELVEDGE_TESTS_UNIFORM_ENVIRONMENT_H

#include "renderer/transport/camera.h"
#include "renderer/transport/surface/path_tracer.h"

/* Puts the environment in the place of the lamp. */
void uniform_environment_set(struct path_setting *s);
/* Path i, from a random place of the crop, which must have a ray into the cloth; seed: of all paths. */
void uniform_environment_trace(const struct path_setting *s, const struct camera *camera, uint32_t seed, uint32_t i,
                               struct path_result *path);

#endif
