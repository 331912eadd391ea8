#include "optimizer/photographs/reader/tiff_statements.h"

#include "optimizer/photographs/reader/exif.h"
#include "optimizer/photographs/reader/xmp.h"

#include <math.h>

static const char other_first[] = "another statement comes first";

static void take_exif(const char *path, struct photograph_info *info)
{
    FILE *file = fopen(path, "rbe");
    if (file == NULL) return;
    exif_read(file, info);
    fclose(file);
}

/* TransferFunction: a table for each channel, of 2^bits values. */
static status take_curve(TIFF *tiff, struct declared_color *color, struct photograph_info *info, struct error *err)
{
    uint16_t bits = 1, n_channel = 1, *table[3] = {NULL, NULL, NULL};
    TIFFGetFieldDefaulted(tiff, TIFFTAG_BITSPERSAMPLE, &bits);
    TIFFGetFieldDefaulted(tiff, TIFFTAG_SAMPLESPERPIXEL, &n_channel);
    if (bits > 16 || !TIFFGetField(tiff, TIFFTAG_TRANSFERFUNCTION, &table[0], &table[1], &table[2]) || table[0] == NULL)
        return STATUS_OK;
    const uint16_t *const of[3] = {table[0], n_channel >= 3 && table[1] != NULL ? table[1] : table[0],
                                   n_channel >= 3 && table[2] != NULL ? table[2] : table[0]};
    file_ledger_add(&info->ledger, "TransferFunction", color->curve[0] != NULL ? other_first : NULL,
                    "a table of %u values", 1u << bits);
    return declared_color_tables(color, "TransferFunction", 1u << bits, of, err);
}

static void take_primaries(TIFF *tiff, struct photograph_info *info)
{
    float *xy = NULL, *white = NULL;
    const bool has_white = TIFFGetField(tiff, TIFFTAG_WHITEPOINT, &white) && white != NULL;
    const bool has_primaries = TIFFGetField(tiff, TIFFTAG_PRIMARYCHROMATICITIES, &xy) && xy != NULL;
    if (has_white != has_primaries)
        file_ledger_add(&info->ledger, has_white ? "WhitePoint" : "PrimaryChromaticities", "the other one is missing",
                        "%.4g %.4g", (double)(has_white ? white : xy)[0], (double)(has_white ? white : xy)[1]);
    if (!has_white || !has_primaries) return;
    const struct color_primaries p = {{{(double)xy[0], (double)xy[1]},
                                       {(double)xy[2], (double)xy[3]},
                                       {(double)xy[4], (double)xy[5]},
                                       {(double)white[0], (double)white[1]}}};
    declared_color_primaries(info, "PrimaryChromaticities", &p);
}

status tiff_statements_read(TIFF *tiff, const char *path, struct declared_color *color, struct photograph_info *info,
                            struct error *err)
{
    uint32_t n_profile = 0;
    void *profile = NULL;
    uint16_t photometric = PHOTOMETRIC_RGB;
    status s = STATUS_OK;
    take_exif(path, info);
    if (TIFFGetField(tiff, TIFFTAG_XMLPACKET, &n_profile, &profile) && profile != NULL)
        xmp_read(profile, n_profile, info);
    TIFFGetField(tiff, TIFFTAG_PHOTOMETRIC, &photometric);
    if (photometric == PHOTOMETRIC_MINISWHITE)
        file_ledger_add(&info->ledger, "photometric sense", NULL, "white is zero");
    if (info->has_alpha) file_ledger_add(&info->ledger, "alpha", "it is opaque everywhere", "one channel");
    if (TIFFGetField(tiff, TIFFTAG_ICCPROFILE, &n_profile, &profile) && profile != NULL)
        s = declared_color_icc(color, path, profile, n_profile, photometric != PHOTOMETRIC_RGB, info, err);
    if (s == STATUS_OK) s = take_curve(tiff, color, info, err);
    if (s == STATUS_OK) take_primaries(tiff, info);
    return s == STATUS_OK ? declared_color_exif(color, info, err) : s;
}

unsigned tiff_largest_sample(TIFF *tiff, unsigned bits, struct photograph_info *info)
{
    const unsigned full = (1u << bits) - 1;
    uint16_t stated = 0;
    double real = 0.0;
    if (!TIFFGetField(tiff, TIFFTAG_MAXSAMPLEVALUE, &stated)) stated = 0;
    if (stated == 0 && TIFFGetField(tiff, TIFFTAG_SMAXSAMPLEVALUE, &real) && real > 0.0 && real <= full)
        stated = (uint16_t)lrint(real);
    if (stated == 0 || stated >= full) return full;
    unsigned narrow = stated, n_bit = 0;
    while (narrow % 2 == 0) narrow /= 2;
    for (; narrow % 2 == 1; narrow /= 2) n_bit++;
    const bool usable = narrow == 0 && n_bit >= 8;
    file_ledger_add(&info->ledger, "MaxSampleValue", usable ? NULL : "it may be this picture's alone", "%u", stated);
    return usable ? stated : full;
}
