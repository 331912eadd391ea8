/* A simulated Bayer sensor: light to numbers. A photosite (sample of the mosaic) that collects the rate y of numbers a
 * second has after t seconds
 *
 *   black + t (dark + y) + noise,   variance read_sd^2 + t dark_share dark + shot_var t y,
 *
 * rounded and cut at white: the model that noise_record.h describes, here of single samples. */
#ifndef SELVEDGE_OPTIMIZER_SENSOR_H
#define SELVEDGE_OPTIMIZER_SENSOR_H

#include "base/status.h"

#include <stddef.h>
#include <stdint.h>

struct sensor {
    double matrix[9]; /* from radiance to the colors of the sensor's filters */
    double dn_per_s;  /* for a filtered radiance of 1 in the middle of the picture: gain of the amplifier included */
    double read_sd, dark_dn_per_s, dark_var_dn, shot_var;
    double iso, aperture, neutral[3];
    unsigned black, white;
};

/* A camera whose colors are far from the colors of radiances, at ISO 200 and f/8, with a white balance that is wrong
 * for every lamp. */
struct sensor sensor_default(void);
/* Channel 0, 1, 2 of the filter over a photosite. */
static inline size_t sensor_channel(size_t x, size_t y) { return y % 2 == 0 ? x % 2 : 1 + x % 2; }
/* Writes one exposure as a DNG file. rate: height x width photosites, DN/s. exposure_s: the true time, and the time
 * that the file states. number: below 4096, of the exposure:
 * chooses its random numbers together with the seed. STATUS_IO, STATUS_NO_MEMORY. */
status sensor_expose(const struct sensor *s, const size_t size[2], const float *rate, const double exposure_s[2],
                     uint64_t seed, uint32_t number, const char *path, struct error *err);

#endif
