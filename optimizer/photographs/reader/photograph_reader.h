/* The table of picture readers: OpenEXR, TIFF, camera raw, PNG, JPEG. A new format is one file and one row of
 * PHOTOGRAPH_READERS.
 *
 * Files are foreign and may be hostile. Readers check sizes before they allocate memory, and every failure is an error
 * that names the file and the reason. A reader gives linear rgb: grey is copied to all channels.
 */
#ifndef SELVEDGE_OPTIMIZER_PHOTOGRAPH_READER_H
#define SELVEDGE_OPTIMIZER_PHOTOGRAPH_READER_H

#include "optimizer/photographs/reader/photograph_info.h"
#include "renderer/image/image.h"

#include <stdint.h>

enum { PHOTOGRAPH_FIRST_BYTES = 16 };

typedef struct photograph_reader {
    const char *id, *title; /* "png.v1"; "PNG", as messages name the format */
    const char *suffix;     /* suffixes of its files, each between blanks: " png " */
    bool (*recognise)(const uint8_t first_byte[PHOTOGRAPH_FIRST_BYTES]); /* NULL: by the suffix alone */
    /* Reads the whole picture into im, which is released by the caller on success only, and fills info. Integer
     * samples: a channel at its largest value is exactly 1 (more where a raw sample is above it), all others are
     * below. Leaves the conversion of primaries, the orientation and the search for saturation to
     * photograph_file_read. STATUS_FORMAT, STATUS_UNSUPPORTED, STATUS_INVALID, STATUS_TOO_LARGE, STATUS_IO,
     * STATUS_NO_MEMORY. */
    status (*read)(const char *path, const struct photograph_request *q, struct image *im, struct photograph_info *info,
                   struct error *err);
} photograph_reader;

/* Raw files come first, because many of them begin as TIFF does. */
#define PHOTOGRAPH_READERS(READER)                                                                                     \
    READER(raw_photograph_reader)                                                                                      \
    READER(exr_photograph_reader)                                                                                      \
    READER(png_photograph_reader) READER(jpeg_photograph_reader) READER(tiff_photograph_reader)

#define PHOTOGRAPH_READER_DECLARATION(name) extern const photograph_reader name;
PHOTOGRAPH_READERS(PHOTOGRAPH_READER_DECLARATION)

size_t photograph_reader_count(void);
const photograph_reader *photograph_reader_at(size_t i);

/* Reads a picture by the reader that its first bytes ask for. STATUS_UNSUPPORTED for an unknown format, STATUS_FORMAT
 * where the name ends in the suffix of another format; otherwise the errors of the readers. */
status photograph_file_read(const char *path, const struct photograph_request *q, struct image *im,
                            struct photograph_info *info, struct error *err);

#endif
