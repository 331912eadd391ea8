/* The noise of a camera, and the file that `selvedge calibrate-camera` writes of it.
 *
 * Model (fiber-scattering thesis, A.4): a sample after t seconds is Y = t y + N_r + N_d + N_s with
 *   N_r read noise, mean mu_r and variance s_r^2; N_d dark current, mean mu_d t and variance s_d^2 t;
 *   N_s shot noise, mean 0 and variance s_s^2 t y.
 * Units: DN, the file's values above black, for each channel of the image that a reader gives (the green of a Bayer
 * sensor is a mean of two samples, so its variances are half as large).
 *
 * The file is JSON: {"selvedge_camera_noise": 1, "camera": TEXT or null, "iso": NUMBER or null, "read_mean_dn": [r, g,
 * b], "read_var_dn2": [..], "dark_mean_dn_per_s": [..], "dark_var_dn2_per_s": [..], "shot_var_dn": [..], "n_dark": N,
 * "n_flat": N}. */
#ifndef SELVEDGE_OPTIMIZER_NOISE_RECORD_H
#define SELVEDGE_OPTIMIZER_NOISE_RECORD_H

#include "base/status.h"

#include <stddef.h>

struct noise_channel {
    double read_mean, read_var; /* mu_r DN, s_r^2 DN^2 */
    double dark_mean, dark_var; /* mu_d DN/s, s_d^2 DN^2/s */
    double shot_var;            /* s_s^2 DN: variance of the shot noise over its mean */
};

struct noise_record {
    struct noise_channel channel[3];
    double iso;            /* NaN: not known */
    char camera[96];       /* "": not known */
    size_t n_dark, n_flat; /* frames that it was made from */
};

/* STATUS_FORMAT / STATUS_INVALID with a text that names file and key; otherwise the errors of file_read_all. */
status noise_record_read(const char *path, struct noise_record *r, struct error *err);
/* Writes the file durably. STATUS_IO, STATUS_DISK_FULL, STATUS_NO_MEMORY. */
status noise_record_write(const struct noise_record *r, const char *path, struct error *err);

#endif
