/* A TIFF volume that is open: its files, its slices, and the decoder. For the files tiff_*.c alone. */
#ifndef SELVEDGE_GEOMETRY_TIFF_VOLUME_H
#define SELVEDGE_GEOMETRY_TIFF_VOLUME_H

#include "geometry/volume/format/tiff_description.h"
#include "geometry/volume/format/tiff_page.h"
#include "geometry/volume/format/volume_part.h"

/* A slice of the volume: of a page, or of samples in the file that no page describes. */
struct tiff_slice {
    size_t i_path;
    uint64_t offset; /* of the page's directory; of the samples */
    uint32_t depth;  /* slice of a page that has several (ImageDepth) */
    bool is_bare;    /* uncompressed samples at offset */
};

struct tiff_stack {
    char **path;
    size_t n_path;
    struct tiff_slice *slice;
    size_t n_slice, capacity;
    size_t n_of_first;      /* slices of the first file */
    uint64_t first_page;    /* its first directory */
    struct tiff_page first; /* all other pages have the same tags */
    size_t i_sample;        /* of the samples of a pixel: the one that is read */
    TIFF *tiff;             /* the file that is open at present */
    size_t i_open;
    void *block; /* one strip or tile */
    size_t block_bytes;
    float *turned;     /* a page as it is stored, where its orientation is another */
    char message[256]; /* libtiff's first message since the last reset */
};

/* Opens file i_path, unless it is open. STATUS_NOT_FOUND, STATUS_FORMAT, STATUS_IO, STATUS_NO_MEMORY. */
status tiff_stack_open_file(struct tiff_stack *h, size_t i_path, struct error *err);
/* Returns libtiff's message, or "damaged data". */
const char *tiff_stack_cause(const struct tiff_stack *h);
status tiff_stack_add(struct tiff_stack *h, struct tiff_slice slice, struct error *err);

/* Takes the slices of the part from all that the files have, in the order of their description, and enters the
 * statements of the first file into info->ledger. Errors as of volume_source_open. */
status tiff_stack_order(struct tiff_stack *h, const struct volume_part *part, struct volume_source_info *info,
                        struct error *err);
/* Adds the images that follow the only page of the file that is open, if its description says so and the file is long
 * enough. file_bytes: its length. */
status tiff_stack_add_bare(struct tiff_stack *h, uint64_t file_bytes, struct error *err);

/* Reads slice i to value[rows][columns], turned as its orientation says. STATUS_FORMAT, STATUS_IO. */
status tiff_stack_read(struct tiff_stack *h, size_t i, float *value, struct error *err);

#endif
