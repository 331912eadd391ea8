/* The table of picture readers: OpenEXR, TIFF, camera raw, PNG, JPEG. A new format is one file and one row of
 * PHOTOGRAPH_READERS.
 *
 * Files are foreign and may be hostile. Readers check sizes before they allocate memory, and every failure is an error
 * that names the file and the reason. A reader gives linear rgb: grey is copied to all channels.
 */
#ifndef SELVEDGE_OPTIMIZER_PHOTOGRAPH_READER_H
#define SELVEDGE_OPTIMIZER_PHOTOGRAPH_READER_H

#include "base/files/file_ledger.h"
#include "optimizer/job/document/picture_words.h"
#include "renderer/image/image.h"

#include <stdbool.h>
#include <stdint.h>

enum { PHOTOGRAPH_FIRST_BYTES = 16 };

/* The request of a reader: transfer curve, black level and limits. */
struct photograph_request {
    enum job_transfer transfer; /* of integer samples; undeclared is an error for them */
    double black_level;         /* value of the file that stands for no light; NaN: the file's own, or 0 */
    size_t limit_pixel;
};

/* The statements of a file besides its pixels. */
struct photograph_info {
    const char *format;               /* "OpenEXR", "TIFF", "camera raw", "PNG", "JPEG" */
    unsigned bits;                    /* of one sample as stored; 32 for float */
    bool encoded;                     /* integer samples of a picture, whose curve the document declares */
    bool less_trustworthy;            /* 8 bits, or made by a camera's own processing */
    bool has_alpha;                   /* an alpha channel that is opaque everywhere, and was left out */
    double exposure_s, iso, aperture; /* NaN: not stated. aperture is the f-number */
    double black_level;               /* the subtracted level, in the file's values */
    double full_scale;                /* file values from black to saturation, which are 1 in the image; 1 for float */
    unsigned orientation;             /* of Exif and TIFF, 1 to 8; 0: not stated */
    unsigned exif_color_space;        /* 1: sRGB, 2: Adobe RGB, 65535: uncalibrated; 0: not stated */
    double to_rec709[9];              /* from the file's primaries, row-major; all 0 where it states none */
    char camera[96];                  /* maker and model; "": not stated */
    struct file_ledger ledger;        /* every statement of the file, also those above */
};

typedef struct photograph_reader {
    const char *id, *title; /* "png.v1"; "PNG", as messages name the format */
    const char *suffix;     /* suffixes of its files, each between blanks: " png " */
    bool (*recognise)(const uint8_t first_byte[PHOTOGRAPH_FIRST_BYTES]); /* NULL: by the suffix alone */
    /* Reads the whole picture into im, which is released by the caller on success only, and fills info. Integer
     * samples: a channel at its largest value is exactly 1 (more where a raw sample is above it), all others are
     * below. STATUS_FORMAT, STATUS_UNSUPPORTED, STATUS_INVALID, STATUS_TOO_LARGE, STATUS_IO, STATUS_NO_MEMORY. */
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
