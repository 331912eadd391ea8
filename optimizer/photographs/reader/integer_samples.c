#include "optimizer/photographs/reader/integer_samples.h"

#include "base/files/durable.h"

#include <math.h>
#include <stdlib.h>

status integer_samples_declare(const char *path, const struct photograph_request *q, unsigned bits,
                               struct photograph_info *info, struct error *err)
{
    const char *name = path_file_name(path);
    double largest = (double)((1u << bits) - 1);
    info->bits = bits;
    info->encoded = true;
    info->black_level = isnan(q->black_level) ? 0.0 : q->black_level;
    info->full_scale = largest - info->black_level;
    info->less_trustworthy = bits <= 8 || q->transfer == JOB_TRANSFER_SRGB;
    if (q->transfer == JOB_TRANSFER_UNDECLARED)
        return error_set(
            err, STATUS_INVALID,
            "cannot use photograph '%s': a %s of %u bits does not say how its values stand for light. Write "
            "\"transfer\": \"srgb\" if a camera or phone saved it, or \"transfer\": \"linear\" if it was "
            "developed without tone curve and gamma; better give the raw file or OpenEXR, which need "
            "neither",
            name, info->format, bits);
    if (info->black_level != 0.0 && q->transfer == JOB_TRANSFER_SRGB)
        return error_set(err, STATUS_INVALID,
                         "cannot use photograph '%s': a black level is a value of linear samples, and its transfer "
                         "is srgb",
                         name);
    if (info->black_level < 0.0 || info->full_scale < 1.0)
        return error_set(err, STATUS_INVALID,
                         "cannot use photograph '%s': the black level %g is not among its values 0 to %g", name,
                         info->black_level, largest);
    return STATUS_OK;
}

float *integer_samples_curve(const struct photograph_request *q, const struct photograph_info *info)
{
    size_t n = (size_t)1 << info->bits;
    float *light = malloc(n * sizeof *light);
    for (size_t i = 0; light != NULL && i < n; i++) {
        double v = ((double)i - info->black_level) / info->full_scale;
        if (q->transfer == JOB_TRANSFER_SRGB) v = v <= 0.04045 ? v / 12.92 : pow((v + 0.055) / 1.055, 2.4);
        light[i] = (float)v;
    }
    return light;
}

status integer_samples_transparent(const char *path, struct error *err)
{
    return error_set(err, STATUS_UNSUPPORTED,
                     "cannot use photograph '%s': it is transparent in places (alpha channel), as no photograph is: "
                     "save it without alpha, from the original",
                     path_file_name(path));
}

status integer_samples_palette(const char *path, struct error *err)
{
    return error_set(err, STATUS_UNSUPPORTED,
                     "cannot use photograph '%s': it has a palette of at most 256 colors, so its values are not those "
                     "of a camera: save the original as rgb",
                     path_file_name(path));
}
