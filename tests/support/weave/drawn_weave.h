/* Pictures of weaves with known drafts, for tests of the detection: yarns as cylinders under even light, or the top
 * view of a phantom, turned and scaled, with a gradient of the light, a dark object and noise. */
#ifndef SELVEDGE_TESTS_DRAWN_WEAVE_H
#define SELVEDGE_TESTS_DRAWN_WEAVE_H

#include <stddef.h>
#include <stdint.h>

struct drawn_weave {
    const char *rows;     /* the draft: '#' warp on top, '.' weft on top, rows downwards, '/' between rows */
    double spacing_px[2]; /* of warps, of wefts */
    double rotation_deg;  /* clockwise in the picture */
    double cover;         /* width over spacing */
    double warp_rgb[3], weft_rgb[3];
    double unevenness;     /* standard deviation of a yarn's brightness, relative */
    double noise;          /* standard deviation over the mean radiance */
    double gradient;       /* brightness at the left edge over that at the right edge, less 1 */
    double dark_corner_px; /* radius of a black object in a corner */
    uint64_t seed;
    size_t edge_px;
    /* A tile in place of cylinders: values 0 to 255, tile_size of them, with tile_yarns warps and wefts. */
    const uint8_t *tile;
    size_t tile_size[2], tile_yarns[2];
};

/* edge_px x edge_px x 3, from malloc; exits the program without memory. */
float *drawn_weave_picture(const struct drawn_weave *w);

/* Number of columns and rows of `rows`. */
void drawn_weave_size(const char *rows, size_t size[2]);

#endif
