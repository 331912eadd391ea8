#include "optimizer/tools/simulated_camera/dng_file.h"

#include <stdbool.h>
#include <tiffio.h>

enum { PHOTOMETRIC_MOSAIC = 32803, DAYLIGHT = 21 };

/* Writes the Exif data into a folder of their own; the picture's folder must have been written. */
static int write_exif(TIFF *tiff, const struct dng_picture *d)
{
    uint16_t iso = (uint16_t)d->iso;
    uint64_t at = 0;
    if (TIFFCreateEXIFDirectory(tiff) != 0) return 0;
    TIFFSetField(tiff, EXIFTAG_EXPOSURETIME, d->exposure_s);
    TIFFSetField(tiff, EXIFTAG_FNUMBER, d->aperture);
    TIFFSetField(tiff, EXIFTAG_ISOSPEEDRATINGS, 1, &iso);
    if (TIFFWriteCustomDirectory(tiff, &at) != 1 || TIFFSetDirectory(tiff, 0) != 1) return 0;
    TIFFSetField(tiff, TIFFTAG_EXIFIFD, at);
    return TIFFRewriteDirectory(tiff);
}

static void set_tags(TIFF *tiff, const struct dng_picture *d)
{
    static const float matrix[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
    const bool has_neutral = d->neutral[0] > 0.0;
    const float neutral[3] = {has_neutral ? (float)d->neutral[0] : 0.5f, has_neutral ? (float)d->neutral[1] : 1.0f,
                              has_neutral ? (float)d->neutral[2] : 0.7f};
    const float black = (float)d->black;
    const uint16_t repeat[2] = {2, 2};
    const uint32_t white = d->white;
    TIFFSetField(tiff, TIFFTAG_SUBFILETYPE, 0);
    TIFFSetField(tiff, TIFFTAG_IMAGEWIDTH, (uint32_t)d->width);
    TIFFSetField(tiff, TIFFTAG_IMAGELENGTH, (uint32_t)d->height);
    TIFFSetField(tiff, TIFFTAG_BITSPERSAMPLE, 16);
    TIFFSetField(tiff, TIFFTAG_SAMPLESPERPIXEL, 1);
    TIFFSetField(tiff, TIFFTAG_COMPRESSION, COMPRESSION_NONE);
    TIFFSetField(tiff, TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_MOSAIC);
    TIFFSetField(tiff, TIFFTAG_MAKE, "Selvedge");
    TIFFSetField(tiff, TIFFTAG_MODEL, "Test camera");
    TIFFSetField(tiff, TIFFTAG_PLANARCONFIG, PLANARCONFIG_CONTIG);
    TIFFSetField(tiff, TIFFTAG_CFAREPEATPATTERNDIM, repeat);
    TIFFSetField(tiff, TIFFTAG_CFAPATTERN, 4, "\0\1\1\2");
    TIFFSetField(tiff, TIFFTAG_DNGVERSION, "\1\3\0\0");
    TIFFSetField(tiff, TIFFTAG_UNIQUECAMERAMODEL, "Selvedge Test camera");
    TIFFSetField(tiff, TIFFTAG_COLORMATRIX1, 9, matrix);
    TIFFSetField(tiff, TIFFTAG_ASSHOTNEUTRAL, 3, neutral);
    TIFFSetField(tiff, TIFFTAG_CALIBRATIONILLUMINANT1, DAYLIGHT);
    TIFFSetField(tiff, TIFFTAG_BLACKLEVEL, 1, &black);
    TIFFSetField(tiff, TIFFTAG_WHITELEVEL, 1, &white);
    TIFFSetField(tiff, TIFFTAG_ROWSPERSTRIP, (uint32_t)d->height);
}

status dng_file_write(const char *path, const struct dng_picture *d, const uint16_t *sample, struct error *err)
{
    TIFF *tiff = TIFFOpen(path, "w");
    if (tiff == NULL) return error_set(err, STATUS_IO, "cannot write raw picture '%s'", path);
    set_tags(tiff, d);
    bool ok = TIFFWriteEncodedStrip(tiff, 0, (void *)(uintptr_t)sample, (tmsize_t)(d->width * d->height * 2)) > 0 &&
              TIFFWriteDirectory(tiff) == 1;
    if (ok && d->exposure_s > 0.0) ok = write_exif(tiff, d) == 1;
    TIFFClose(tiff);
    return ok ? STATUS_OK : error_set(err, STATUS_IO, "cannot write raw picture '%s'", path);
}
