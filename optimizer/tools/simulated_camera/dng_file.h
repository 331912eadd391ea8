/* Writes the raw mosaic of a Bayer sensor as an uncompressed DNG file (Adobe, Digital Negative 1.3). The file has only
 * the tags that the simulated camera and the tests of the DNG reader need. */
#ifndef SELVEDGE_OPTIMIZER_DNG_FILE_H
#define SELVEDGE_OPTIMIZER_DNG_FILE_H

#include "base/status.h"

#include <stddef.h>
#include <stdint.h>

struct dng_picture {
    size_t width, height; /* of the mosaic; even */
    unsigned black, white;
    double exposure_s, iso, aperture; /* exposure_s 0: the file states none of the three */
    double neutral[3];                /* camera rgb that the camera takes for white, 0: 0.5, 1, 0.7 */
};

/* sample: width x height, of 16 bits, in cells RG over GB. STATUS_IO. */
status dng_file_write(const char *path, const struct dng_picture *d, const uint16_t *sample, struct error *err);

#endif
