/* The description of a TIFF stack, which states the order of its pages: as ImageJ, OME and tifffile write it into the
 * tag ImageDescription of the first page. */
#ifndef SELVEDGE_GEOMETRY_TIFF_DESCRIPTION_H
#define SELVEDGE_GEOMETRY_TIFF_DESCRIPTION_H

#include "base/status.h"
#include "geometry/volume/format/volume_info.h"

enum { TIFF_CHANNELS, TIFF_SLICES, TIFF_TIMES, TIFF_DIMENSIONS };

/* OME: n_page pages from `page` on hold the images from `image` on, by tiff_description_image. */
struct tiff_block {
    size_t page, n_page, image;
};

struct tiff_description {
    const char *source;         /* "ImageJ's description"; NULL: there is none that states pages */
    size_t n[TIFF_DIMENSIONS];  /* channels, slices, times; all 0: not stated */
    int order[TIFF_DIMENSIONS]; /* fastest first */
    bool may_follow;            /* the images may lie behind the first page, which is the only directory */
    size_t n_block;             /* 0: the pages are in order */
    struct tiff_block *block;   /* owned; in the order of their images */
};

/* Reads a description, or a text that is none of these, and enters its statements into info->ledger; sets the voxel
 * size. px_per_unit: XResolution and YResolution of the page, NaN where absent. name: of the file, for errors.
 * STATUS_FORMAT for several images in one OME file, STATUS_NO_MEMORY. */
status tiff_description_read(const char *text, const double px_per_unit[2], const char *name,
                             struct tiff_description *d, struct volume_source_info *info, struct error *err);
void tiff_description_release(struct tiff_description *d);

/* Returns the number of images that are stated; 0: none are, or too many to count. */
size_t tiff_description_images(const struct tiff_description *d);
/* Returns the place of an image in the stated order. index: three numbers from 0. */
size_t tiff_description_image(const struct tiff_description *d, const size_t index[TIFF_DIMENSIONS]);
/* Returns the page, from 0, of a slice of a channel and time. SIZE_MAX: no page holds it. */
size_t tiff_description_page(const struct tiff_description *d, const size_t index[TIFF_DIMENSIONS]);

/* The kinds of descriptions, for tiff_description_read. Each returns whether the text is one. */
bool imagej_description_read(const char *text, const double px_per_unit[2], struct tiff_description *d,
                             struct volume_source_info *info);
status ome_description_read(const char *text, const char *name, struct tiff_description *d,
                            struct volume_source_info *info, struct error *err);

#endif
