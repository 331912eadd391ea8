/* DNG of floating point samples, which LibRaw 0.20 does not read, through libtiff: linear rgb of 32 bits. */
#ifndef SELVEDGE_OPTIMIZER_FLOAT_DNG_H
#define SELVEDGE_OPTIMIZER_FLOAT_DNG_H

#include "optimizer/photographs/reader/photograph_info.h"
#include "renderer/image/image.h"

/* Reads the picture of floats that the file holds: values are (sample - black) / (white - black), and white is
 * saturation. STATUS_NOT_FOUND without an error where it holds none; STATUS_UNSUPPORTED for mosaics and for floats of
 * 16 and 24 bits; STATUS_FORMAT, STATUS_TOO_LARGE, STATUS_INVALID, STATUS_NO_MEMORY. */
status float_dng_read(const char *path, const struct photograph_request *q, struct image *im,
                      struct photograph_info *info, struct error *err);

#endif
