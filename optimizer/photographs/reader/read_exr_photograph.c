/* OpenEXR as a photograph: linear already. */
#include "optimizer/photographs/reader/photograph_reader.h"

#include <math.h>
#include <string.h>

static bool recognise(const uint8_t first[PHOTOGRAPH_FIRST_BYTES]) { return memcmp(first, "\x76\x2f\x31\x01", 4) == 0; }

static status read_exr(const char *path, const struct photograph_request *q, struct image *im,
                       struct photograph_info *info, struct error *err)
{
    status s = image_read_exr(im, path, q->limit_pixel, err);
    info->bits = 32;
    if (s != STATUS_OK || isnan(q->black_level)) return s;
    info->black_level = q->black_level;
    for (size_t i = 0; i < im->width * im->height * im->n_channel; i++) im->pixel[i] -= (float)q->black_level;
    return s;
}

const photograph_reader exr_photograph_reader = {"exr.v1", "OpenEXR", " exr ", recognise, read_exr};
