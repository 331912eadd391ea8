/* Measures the noise of a camera (noise_record.h) from dark frames (lens covered) and flat frames (an evenly lit white
 * surface, out of focus), all of one ISO value and without saturation.
 *
 * Dark frames: their mean is mu_r + mu_d t. Half of the variance of the difference of two frames of one exposure time
 * is s_r^2 + s_d^2 t, free of the fixed pattern of the sensor. Both lines are fitted by least squares over the exposure
 * times; with a single time the dark current is 0 and counts as read noise. Flat frames: in blocks of 16 x 16 pixels
 * half of the variance of the difference of two frames, minus the variance of a dark frame, over the mean, is s_s^2. A
 * slow change of the lamp between the frames cancels, because each block's mean difference is removed. */
#ifndef SELVEDGE_OPTIMIZER_NOISE_CALIBRATE_H
#define SELVEDGE_OPTIMIZER_NOISE_CALIBRATE_H

#include "base/warning.h"
#include "optimizer/job/document/picture_words.h"
#include "optimizer/photographs/camera/noise_record.h"

struct noise_frames {
    const char *const *dark, *const *flat; /* paths */
    size_t n_dark, n_flat;
    enum job_transfer transfer; /* of integer files; linear is allowed */
    double exposure_s;          /* of all frames that do not state one; NaN: not given */
};

/* STATUS_INVALID: fewer than two dark or flat frames of one exposure, an unknown exposure time, frames of different
 * sizes, cameras or ISO values, saturated flat frames, flat frames that are no brighter than dark ones. Otherwise the
 * errors of photograph_file_read. */
status noise_calibrate(const struct noise_frames *f, const struct warning_sink *warn, struct noise_record *r,
                       struct error *err);

#endif
