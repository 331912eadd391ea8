/* The difference of a picture by tables from a path-traced one of the same view. */
#ifndef SELVEDGE_OPTIMIZER_SURFACE_DIFFERENCE_H
#define SELVEDGE_OPTIMIZER_SURFACE_DIFFERENCE_H

#include "renderer/image/image.h"

/* Numbers of the whole picture are relative to its mean brightness in the reference, numbers of fields to the mean
 * brightness of the lit fields. Fields are squares of 4 x 4 pixels; pixels that hang over at the edges belong to none.
 * NaN where the reference is black. */
struct surface_difference {
    double mean[3], mean_se[3]; /* of the whole picture in red, green and blue, and its standard error */
    double field_rms;           /* root mean square over lit fields and channels, less the noise of both pictures */
    double field_noise;         /* the noise that was subtracted */
};

/* Both pictures have the same size and six channels: radiance in rgb, and its variance. Variances that are not known
 * (NaN, as of a preview) count as 0: field_rms then holds the noise of that picture, too. */
void surface_difference_of(const struct image *picture, const struct image *reference, struct surface_difference *out);

#endif
