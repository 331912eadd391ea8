/* OpenEXR as a photograph: linear already. */
#include "optimizer/photographs/reader/photograph_reader.h"
#include "renderer/image/image_exr.h"

#include "base/files/durable.h"

#include <math.h>
#include <string.h>

static bool recognise(const uint8_t first[PHOTOGRAPH_FIRST_BYTES]) { return memcmp(first, "\x76\x2f\x31\x01", 4) == 0; }

static status take_statements(const char *path, const struct exr_statements *said, struct photograph_info *info,
                              struct error *err)
{
    const double(*xy)[2] = said->primaries.xy;
    info->exposure_s = said->exposure_s;
    info->iso = said->iso;
    info->aperture = said->aperture;
    if (strcmp(said->channels, "B, G, R") != 0 && strcmp(said->channels, "Y") != 0)
        file_ledger_add(&info->ledger, "channels", "only R, G, B or Y are read", "%s", said->channels);
    if (said->n_part > 1) file_ledger_add(&info->ledger, "parts", "only the first one is read", "%d", said->n_part);
    if (fabs(said->pixel_aspect - 1.0) > 1e-3)
        file_ledger_add(&info->ledger, "pixel aspect", "a mean does not need it", "%g", said->pixel_aspect);
    if (said->has_other_window)
        file_ledger_add(&info->ledger, "display window", "the picture is the window of the data", "another one");
    if (said->attributes[0] != '\0')
        file_ledger_add(&info->ledger, "further attributes", "they say nothing about radiance", "%s", said->attributes);
    if (!said->has_primaries) return STATUS_OK;
    if (!color_primaries_matrix(&said->primaries, info->to_rec709))
        return error_set(err, STATUS_FORMAT, "cannot read photograph '%s': its chromaticities are no primaries",
                         path_file_name(path));
    file_ledger_add(&info->ledger, "chromaticities", NULL,
                    "red %.4g %.4g, green %.4g %.4g, blue %.4g %.4g, white %.4g %.4g", xy[0][0], xy[0][1], xy[1][0],
                    xy[1][1], xy[2][0], xy[2][1], xy[3][0], xy[3][1]);
    return STATUS_OK;
}

static status read_exr(const char *path, const struct photograph_request *q, struct image *im,
                       struct photograph_info *info, struct error *err)
{
    struct exr_statements said;
    status s = image_read_exr_stated(im, path, q->limit_pixel, &said, err);
    info->bits = 32;
    if (s != STATUS_OK) return s;
    s = take_statements(path, &said, info, err);
    if (s != STATUS_OK) image_release(im);
    if (s != STATUS_OK || isnan(q->black_level)) return s;
    info->black_level = q->black_level;
    for (size_t i = 0; i < im->width * im->height * im->n_channel; i++) im->pixel[i] -= (float)q->black_level;
    return s;
}

const photograph_reader exr_photograph_reader = {"exr.v1", "OpenEXR", " exr ", recognise, read_exr};
