/* results/thumbnail.png: a small picture by which lists show a job. A later one replaces an earlier one. */
#ifndef SELVEDGE_OPTIMIZER_RESULT_THUMBNAIL_H
#define SELVEDGE_OPTIMIZER_RESULT_THUMBNAIL_H

#include "optimizer/report/findings/report.h"

/* Writes the thumbnail of a linear picture, with an exposure by its 98th percentile. */
status result_thumbnail_of_image(const struct report *report, const struct image *im, struct error *err);
/* Writes the thumbnail of a picture with 3 bytes a pixel in sRGB, row 0 at the top. */
status result_thumbnail_of_bytes(const struct report *report, const uint8_t *rgb, size_t width, size_t height,
                                 struct error *err);

#endif
