/* The contrast of a photograph's texture at a stated scale: the counterpart of contrast_blocks.h for renderings.
 *
 *   C = 1/(K - 1) sum_k (m_k - m)^2 / m^2,    m_k: mean of part k of K = n_cell^2 equal parts of the crop
 *
 * each channel on its own; pixels on the edge of a part are shared by area, so that all parts are equal. Noise of the
 * pixels adds its relative variance over the number of pixels of a part (5 % in 10 x 10 pixels: 0.000025, a scatter of
 * 0.5 %). It is not subtracted, because a single picture cannot tell noise from threads and fibers. (Comparing
 * complementary halves of the pixels halved the contrast where pixels are as large as the distance of fibers.)
 *
 * The standard error states how much C differs between pieces of the cloth. It follows from the scatter of the parts'
 * contributions, which count as independent, and is too large for a pattern that repeats within the crop. */
#ifndef SELVEDGE_OPTIMIZER_PHOTOGRAPH_CONTRAST_H
#define SELVEDGE_OPTIMIZER_PHOTOGRAPH_CONTRAST_H

#include "renderer/image/image.h"

/* Measures a crop; name: the name of its file. STATUS_INVALID: fewer than 2 x 2 pixels in a part. STATUS_NO_MEMORY. */
status photograph_contrast(const struct image *im, const char *name, size_t n_cell, double contrast_rgb[3],
                           double se_rgb[3], struct error *err);
/* Measures one channel of a picture with at least 2 x 2 pixels in a part; contrast 0 where the mean is not positive. */
status image_contrast(const struct image *im, size_t channel, size_t n_cell, double *contrast, double *se,
                      struct error *err);

#endif
