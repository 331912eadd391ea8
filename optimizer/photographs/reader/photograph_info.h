/* The request to a picture reader, and the statements of a file beside its pixels. */
#ifndef SELVEDGE_OPTIMIZER_PHOTOGRAPH_INFO_H
#define SELVEDGE_OPTIMIZER_PHOTOGRAPH_INFO_H

#include "base/files/file_ledger.h"
#include "optimizer/job/document/picture_words.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* The request of a reader: transfer curve, black level and limits. */
struct photograph_request {
    bool transfer_assumed;      /* a curve that the file declares comes before `transfer` */
    enum job_transfer transfer; /* of integer samples; undeclared is an error for them */
    double black_level;         /* value of the file that stands for no light; NaN: the file's own, or 0 */
    size_t limit_pixel;
};

/* The statements of a file besides its pixels. */
struct photograph_info {
    const char *format;               /* "OpenEXR", "TIFF", "camera raw", "PNG", "JPEG" */
    unsigned bits;                    /* of one sample as stored; 32 for float */
    bool encoded;                     /* integer samples of a picture, whose curve is declared */
    bool curve_of_file;               /* the file declares that curve */
    bool curved;                      /* integer samples that are not proportional to light */
    bool less_trustworthy;            /* 8 bits, or made by a camera's own processing */
    bool has_alpha;                   /* an alpha channel that is opaque everywhere, and was left out */
    double exposure_s, iso, aperture; /* NaN: not stated. aperture is the f-number */
    double black_level;               /* the subtracted level, in the file's values */
    double full_scale;                /* file values from black to saturation, which are 1 in the image; 1 for float */
    /* Values of the image at and above which a sample is saturated, of each channel: 1 for the largest value of integer
     * samples, less where fewer bits are used (saturation.h). INFINITY: none is. Where a pixel has a saturated sample
     * and its colors were converted, all its samples are that high. */
    double saturation[3];
    float narrow_scale[6];     /* light of the largest values of 10, 12 and 14 bits in 16, low and high; or 0 */
    unsigned orientation;      /* of Exif and TIFF, 1 to 8, 1 where it is not stated; already applied */
    unsigned exif_color_space; /* 1: sRGB, 2: Adobe RGB, 65535: uncalibrated; 0: not stated */
    bool auto_balance;         /* the camera chose the white balance by the picture */
    double sample_px[3][2];    /* where a pixel's samples of each channel lie from its middle, right and down */
    double to_rec709[9];       /* from the file's primaries, row-major; all 0 where it states none */
    char camera[96];           /* maker and model; "": not stated */
    struct file_ledger ledger; /* every statement of the file, also those above */
};

/* The least value of a channel that is saturated; INFINITY: none is. */
double photograph_saturation(const struct photograph_info *info);

#endif
