/* results/thumbnail.png: a small picture by which lists show a job. A later one replaces an earlier one. */
#ifndef SELVEDGE_OPTIMIZER_RESULT_THUMBNAIL_H
#define SELVEDGE_OPTIMIZER_RESULT_THUMBNAIL_H

#include "optimizer/worker/pipeline_context.h"

/* Of a linear picture, as bright as its 98th percentile asks. */
status result_thumbnail_of_image(const struct pipeline_context *c, const struct image *im, struct error *err);
/* Of 3 bytes a pixel in sRGB, row 0 at the top. */
status result_thumbnail_of_bytes(const struct pipeline_context *c, const uint8_t *rgb, size_t width, size_t height,
                                 struct error *err);

#endif
