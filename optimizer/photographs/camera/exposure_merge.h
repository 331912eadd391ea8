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

/* Exposures of one view, of equal size. pixel of image[i]: 1 is saturation; full_scale[i]: in DN, 1 for float samples,
 * which do not saturate. */
struct exposure_set {
    const struct noise_record *noise; /* NULL: no record */
    size_t n, width, height;
    const double *t_s, *full_scale;
    struct image *const *image;
    const char *const *name;
    bool srgb; /* the files hold values of the sRGB curve */
};

/* The part of each exposure in a merged picture: light[i][c] is the mean over the pixels of `region` (x0, y0, x1, y1)
 * of the merged value times the weight of exposure i, so its derivative by -ln t_s[i]. */
struct exposure_light {
    size_t region[4];
    double light[EXPOSURE_MAX][3];
};

/* Sample p of exposure i in DN, NaN where it is saturated. */
double exposure_sample_dn(const struct exposure_set *e, size_t i, size_t p);
/* Noise of channel c; all variances are 0 without a record. */
const struct noise_channel *exposure_noise(const struct exposure_set *e, size_t c);

/* Merges the pictures. The result replaces image[0]: values per second in the same unit, not DN. Where all samples of a
 * pixel are saturated it takes the sample of the shortest exposure. variance: initialised with the size of the
 * pictures, becomes the variance of each value by the camera's noise; NULL: not wanted, as without a record.
 * *saturated_share: of the pixels with a channel that is saturated in every exposure. light: NULL where not wanted. The
 * other exposures lose the samples that are left out. STATUS_NO_MEMORY. */
status exposure_merge_images(const struct exposure_set *e, struct image *variance, struct exposure_light *light,
                             double *saturated_share, struct error *err);

#endif
