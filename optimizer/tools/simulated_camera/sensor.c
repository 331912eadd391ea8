#include "optimizer/tools/simulated_camera/sensor.h"

#include "base/rng.h"
#include "optimizer/tools/simulated_camera/dng_file.h"

#include <math.h>
#include <stdlib.h>

struct sensor sensor_default(void)
{
    return (struct sensor){.matrix = {0.61, 0.22, 0.05, 0.11, 0.74, 0.09, 0.02, 0.18, 0.48},
                           .dn_per_s = 60000.0,
                           .read_sd = 4.0,
                           .dark_dn_per_s = 3.0,
                           .dark_var_dn = 0.5,
                           .shot_var = 0.5,
                           .iso = 200.0,
                           .aperture = 8.0,
                           .neutral = {0.9, 1.0, 0.4},
                           .black = 512,
                           .white = 16383};
}

status sensor_expose(const struct sensor *s, const size_t size[2], const float *rate, const double exposure_s[2],
                     uint64_t seed, uint32_t number, const char *path, struct error *err)
{
    const struct rng_key key = {.seed = seed, .iteration = 65533, .configuration = number};
    const struct dng_picture d = {.width = size[0],
                                  .height = size[1],
                                  .black = s->black,
                                  .white = s->white,
                                  .exposure_s = exposure_s[1],
                                  .iso = s->iso,
                                  .aperture = s->aperture,
                                  .neutral = {s->neutral[0], s->neutral[1], s->neutral[2]}};
    const size_t n = size[0] * size[1];
    uint16_t *sample = malloc(n * sizeof *sample);
    if (sample == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot simulate a camera: out of memory");
    for (size_t i = 0; i < n; i++) {
        double light = (double)rate[i] * exposure_s[0], dark = s->dark_dn_per_s * exposure_s[0], normal[2];
        double var = s->read_sd * s->read_sd + s->dark_var_dn * dark + s->shot_var * light;
        struct rng r;
        rng_start(&r, &key, (uint32_t)i, 0);
        rng_normal_pair(&r, normal);
        double value = rint((double)s->black + light + dark + sqrt(var) * normal[0]);
        sample[i] = (uint16_t)fmin(fmax(value, 0.0), (double)s->white);
    }
    status st = dng_file_write(path, &d, sample, err);
    free(sample);
    return st;
}
