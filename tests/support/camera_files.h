/* Picture files as cameras and programs write them: TIFF of any kind, JPEG with Exif data. Raw mosaics are written
 * by optimizer/tools/simulated_camera/dng_file.h. */
#ifndef SELVEDGE_TESTS_CAMERA_FILES_H
#define SELVEDGE_TESTS_CAMERA_FILES_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

struct camera_tiff {
    size_t width, height, n_channel;
    unsigned bits; /* 8, 16; 32 is float */
    bool planes, tiled, palette, deflate;
    double exposure_s, iso, aperture; /* 0: no Exif data */
};

/* sample: width x height x n_channel of the stated kind. */
void camera_write_tiff(const char *path, const struct camera_tiff *t, const void *sample);

/* An rgb JPEG of quality 100 without subsampling; exposure_s 0: without Exif data, which otherwise say ISO 200, f/8. */
void camera_write_jpeg(const char *path, size_t width, size_t height, const uint8_t *rgb, double exposure_s);

#endif
