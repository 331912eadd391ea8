/* Several exposures of one view merged into one rate by the maximum-likelihood estimator of the camera's noise
 * (fiber-scattering thesis, A.4):
 *
 *   y = [sum (y_i - mu_r - t_i mu_d) t_i / V_i] / [sum t_i^2 / V_i],   standard error (sum t_i^2 / V_i)^(-1/2)
 *
 * Differs from the thesis in the variances: V_i = s_r^2 + s_d^2 t_i + s_s^2 y_i with the noisy y_i is used for a first
 * estimate alone, because it biases dark pixels (by -34 % at 0.02 DN/s). The second one uses V_i = s_r^2 + s_d^2 t_i +
 * s_s^2 t_i max(y, 0), and so does a third. Saturated samples are left out. In pictures, so are samples for which the
 * shorter exposures of the surrounding pixels predict a value near saturation: within four standard deviations of the
 * full scale, or within 5 % of it where the noise is not known. The estimate is never clamped. */
#ifndef SELVEDGE_OPTIMIZER_EXPOSURE_MERGE_H
#define SELVEDGE_OPTIMIZER_EXPOSURE_MERGE_H

#include "optimizer/photographs/camera/noise_record.h"
#include "renderer/image/image.h"

#include <stdbool.h>

enum { EXPOSURE_MAX = 16 };

struct merged_sample {
    double value, se; /* DN/s; with n_used 0 the value is NaN */
    size_t n_used;
};

/* t_s: exposure times; y_dn: samples above black; NaN marks a sample that is left out. n_reweight: 0 for the estimate
 * of the thesis, 1 for a second one. Without noise (all variances 0) the samples count as with shot noise alone, which
 * gives sum y / sum t and no standard error (NaN). */
struct merged_sample exposure_merge(const struct noise_channel *k, size_t n, const double *t_s, const double *y_dn,
                                    size_t n_reweight);

/* Exposures of one view show the same light: another lamp, a moved camera or a wrong exposure time would leave an
 * average of different things. STATUS_INVALID, with the name of the exposure at fault, where the light of one is more
 * than 1.25 times the prediction of the others and the exposure times for the same samples, or less than the prediction
 * over 1.25; shutters keep their times to a few percent. Samples that come near saturation are left out, and so is a
 * dark exposure. */
status exposure_check_agreement(const struct noise_record *noise, size_t n, const double *t_s, const double *full_scale,
                                struct image *const *exposure, const char *const *name, struct error *err);

/* Merges n pictures of equal size. pixel of exposure[i]: 1 is saturation, full_scale[i] DN. noise NULL: no record. The
 * result replaces exposure[0]: values per second in the same unit, not DN. Where all samples of a pixel are saturated
 * it takes the sample of the shortest exposure. variance: initialised with the size of the pictures, becomes the
 * variance of each value by the camera's noise; NULL: not wanted, as without a record. *saturated_share: of the pixels
 * with a channel that is saturated in every exposure. The other exposures lose the samples that are left out.
 * STATUS_NO_MEMORY. */
status exposure_merge_images(const struct noise_record *noise, size_t n, const double *t_s, const double *full_scale,
                             struct image *const *exposure, struct image *variance, double *saturated_share,
                             struct error *err);

#endif
