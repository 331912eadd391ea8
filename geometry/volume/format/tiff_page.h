/* One page of a TIFF volume: reads its tags, and checks whether a volume can have such a page. */
#ifndef SELVEDGE_GEOMETRY_TIFF_PAGE_H
#define SELVEDGE_GEOMETRY_TIFF_PAGE_H

#include "base/status.h"
#include "geometry/volume/format/sample_type.h"

#include <stdint.h>
#include <tiffio.h>

struct tiff_page {
    uint32_t width, height, depth; /* pixels; slices in the page (ImageDepth, else one) */
    enum sample_type sample;
    uint16_t bits, compression;  /* values of the tags, as libtiff names them */
    uint16_t orientation;        /* value of the tag; 0: not stated, the page has the first page's, or none */
    uint16_t n_sample;           /* of a pixel: channels, or a grey value and its alpha */
    bool has_alpha, is_separate; /* is_separate: every channel has strips or tiles of its own */
    bool is_preview;             /* of a page before it, in fewer pixels */
};

/* Reads the tags of the current page. name: of the file, page: its number from 1, both for errors. STATUS_FORMAT (no
 * pixels, a color image), STATUS_TOO_LARGE, STATUS_UNSUPPORTED (white is zero, an unknown kind of samples). */
status tiff_page_read(TIFF *tiff, const char *name, size_t page, struct tiff_page *p, struct error *err);
/* STATUS_FORMAT unless p has the edges and the sample type of the volume's first page. */
status tiff_page_compare(const struct tiff_page *p, const struct tiff_page *first, const char *name, size_t page,
                         struct error *err);
/* Bytes of the decoded samples of a slice of the page, in one channel. */
uint64_t tiff_page_bytes(const struct tiff_page *p);
/* Returns whether the samples of the current page lie in the file as they are, in one piece. */
bool tiff_page_is_contiguous(TIFF *tiff, const struct tiff_page *p);
/* Returns whether the stored bytes of the current page lie in its file of file_bytes bytes and can suffice for the size
 * that its tags state. To be called before memory is allocated for the page. */
bool tiff_page_fits(TIFF *tiff, const struct tiff_page *p, uint64_t file_bytes);

#endif
