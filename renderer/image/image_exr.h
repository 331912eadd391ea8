/* Statements of an OpenEXR file beside its samples. */
#ifndef SELVEDGE_RENDERER_IMAGE_EXR_H
#define SELVEDGE_RENDERER_IMAGE_EXR_H

#include "renderer/image/color_primaries.h"

#include <OpenEXR/openexr.h>

struct exr_statements {
    double exposure_s, iso, aperture; /* NaN: not stated. aperture is the f-number */
    bool has_primaries;
    struct color_primaries primaries;
    double pixel_aspect;   /* width of a pixel over its height */
    int n_part;            /* the first one is read */
    bool has_other_window; /* the window of the data is not the window of the display */
    char channels[96];     /* names of all channels, with commas */
    char attributes[96];   /* names of the attributes that no other member holds, with commas; "" for none */
};

/* image_read_exr for the pixels as they are stored, with the statements of the file. */
status image_read_exr_stated(struct image *im, const char *path, size_t limit_pixel, struct exr_statements *said,
                             struct error *err);

/* Reads the statements of the first part of an open file. */
void exr_statements_read(exr_const_context_t file, struct exr_statements *said);

#endif
