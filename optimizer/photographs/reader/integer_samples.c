#include "optimizer/photographs/reader/integer_samples.h"

#include "base/files/durable.h"

#include <math.h>
#include <stdlib.h>

/* A file and a document may differ by this, of full scale: gamma 2.2 and sRGB differ by 0.008. */
static const double allowed_difference = 0.02;

static const char *transfer_name(enum job_transfer transfer)
{
    return transfer == JOB_TRANSFER_SRGB ? "srgb" : "linear";
}

/* Compares the curve of the file with the document's. */
static status settle_curve(const char *path, const struct photograph_request *q, struct declared_color *color,
                           struct photograph_info *info, struct error *err)
{
    if (color->curve[0] == NULL) return STATUS_OK;
    info->curve_of_file = true;
    if (q->transfer == JOB_TRANSFER_UNDECLARED || q->transfer_assumed) return STATUS_OK;
    if (declared_color_difference(color, q->transfer) > allowed_difference)
        return error_set(err, STATUS_INVALID,
                         "cannot use photograph '%s': its %s says that its values are %s, and the document says "
                         "\"transfer\": \"%s\": leave 'transfer' out, or correct the file",
                         path_file_name(path), color->source, color->curve_name, transfer_name(q->transfer));
    if (!color->rounded || q->transfer != JOB_TRANSFER_SRGB) return STATUS_OK;
    file_ledger_settle(&info->ledger, "gAMA", "the document says srgb, for which it stands");
    declared_color_release(color);
    info->curve_of_file = false;
    return STATUS_OK;
}

status integer_samples_declare(const char *path, const struct photograph_request *q, unsigned bits,
                               struct declared_color *color, struct photograph_info *info, struct error *err)
{
    const char *name = path_file_name(path);
    double largest = (double)((1u << bits) - 1);
    info->bits = bits;
    info->encoded = true;
    info->black_level = isnan(q->black_level) ? 0.0 : q->black_level;
    info->full_scale = largest - info->black_level;
    status s = settle_curve(path, q, color, info, err);
    if (s != STATUS_OK) return s;
    const bool linear = info->curve_of_file ? declared_color_difference(color, JOB_TRANSFER_LINEAR) < 1e-3
                                            : q->transfer != JOB_TRANSFER_SRGB;
    info->curved = !linear;
    info->less_trustworthy = bits <= 8 || !linear;
    if (q->transfer == JOB_TRANSFER_UNDECLARED && !info->curve_of_file)
        return error_set(
            err, STATUS_INVALID,
            "cannot use photograph '%s': a %s of %u bits does not say how its values stand for light. Write "
            "\"transfer\": \"srgb\" if a camera or phone saved it, or \"transfer\": \"linear\" if it was "
            "developed without tone curve and gamma; better give the raw file or OpenEXR, which need "
            "neither",
            name, info->format, bits);
    if (info->black_level != 0.0 && !linear)
        return error_set(err, STATUS_INVALID,
                         "cannot use photograph '%s': a black level is a value of linear samples, and its transfer "
                         "is %s",
                         name, info->curve_of_file ? color->curve_name : "srgb");
    if (info->black_level < 0.0 || info->full_scale < 1.0)
        return error_set(err, STATUS_INVALID,
                         "cannot use photograph '%s': the black level %g is not among its values 0 to %g", name,
                         info->black_level, largest);
    return STATUS_OK;
}

float *integer_samples_curves(const struct photograph_request *q, const struct declared_color *color, unsigned largest,
                              struct photograph_info *info)
{
    const size_t n = (size_t)1 << info->bits;
    float *light = malloc(3 * n * sizeof *light);
    for (size_t i = 0; light != NULL && i < 3 * n; i++) {
        double v = ((double)(i % n) - info->black_level) / info->full_scale;
        if (color->curve[0] != NULL)
            v = v < 0.0 ? v : declared_color_light(color, i / n, v); /* below black: linear samples alone */
        else if (q->transfer == JOB_TRANSFER_SRGB)
            v = v <= 0.04045 ? v / 12.92 : pow((v + 0.055) / 1.055, 2.4);
        light[i] = (float)v;
    }
    if (light == NULL) return NULL;
    for (size_t c = 0; c < 3; c++) /* a step of few bits is no sign of clipping */
        info->saturation[c] = info->bits >= 8 ? (double)light[c * n + largest] : INFINITY;
    for (unsigned i = 0; info->bits == 16 && i < 3; i++) {
        const unsigned top = (1u << (10 + 2 * i)) - 1;
        info->narrow_scale[i] = light[top];
        info->narrow_scale[3 + i] = light[top << (6 - 2 * i)];
    }
    return light;
}

unsigned integer_samples_significant(const unsigned bits[3], unsigned depth, struct photograph_info *info)
{
    unsigned least = depth;
    if (bits[0] == 0) return (1u << depth) - 1;
    for (int c = 0; c < 3; c++)
        if (bits[c] > 0 && bits[c] < least) least = bits[c];
    file_ledger_add(&info->ledger, "significant bits", NULL, "%u %u %u of %u", bits[0], bits[1], bits[2], depth);
    return ((1u << least) - 1) << (depth - least);
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
