#include "tests/support/tracer/environment/uniform_environment.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

void uniform_environment_set(struct path_setting *s)
{
    s->lights.has_lamp = false;
    s->lights.has_constant = true;
    for (int k = 0; k < 3; k++) s->lights.constant[k] = 1;
}

void uniform_environment_trace(const struct path_setting *s, const struct camera *camera, uint32_t seed, uint32_t i,
                               struct path_result *path)
{
    struct rng r;
    struct scene_ray ray;
    rng_start(&r, &(struct rng_key){seed, 0, 0, 0}, i, 0);
    const double x = rng_double(&r), xy[2] = {x, rng_double(&r)};
    assert_true(camera_ray(camera, s->scene, xy, &ray));
    path_trace(s, &ray, &r, path, NULL);
}
