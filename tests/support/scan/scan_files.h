/* Volumes and scan files for tests: straight cylinders with known axes; TIFF pages. */
#ifndef SELVEDGE_TESTS_SCAN_FILES_H
#define SELVEDGE_TESTS_SCAN_FILES_H

#include "geometry/volume/volume.h"

#include <stdint.h>

struct test_cylinder {
    double point[3], direction[3]; /* voxels; direction is normalised inside */
    double radius;
};

/* Fills v with density 1 inside the cylinders, a ramp over one voxel at the surface, and seeded Gaussian noise. */
void test_fill_cylinders(struct volume *v, const struct test_cylinder *c, size_t n_cylinder, double noise_sd,
                         uint64_t seed);

struct test_page {
    uint32_t width, height;
    uint16_t bits; /* 8, 16 or 32 (float) */
    const void *pixel;
};

enum test_tiff_layout { TEST_STRIPS, TEST_TILES };
/* Writes pages with the given libtiff compression. */
void test_write_tiff(const char *path, const struct test_page *page, size_t n_page, uint16_t compression,
                     enum test_tiff_layout layout);
void test_write_bytes(const char *path, const void *data, size_t n_byte);
/* Makes a new folder under /tmp and writes its path. */
void test_make_folder(char path[64]);

#endif
