/* The meaning of integer samples as a picture file declares it: curve and primaries, by an ICC profile, the chunks of
 * PNG (cICP, sRGB, gAMA, cHRM), the tags of TIFF or the color space of Exif. All become curves of Little CMS and a
 * matrix to Rec. 709. */
#ifndef SELVEDGE_OPTIMIZER_DECLARED_COLOR_H
#define SELVEDGE_OPTIMIZER_DECLARED_COLOR_H

#include "optimizer/photographs/reader/photograph_info.h"
#include "renderer/image/color_primaries.h"

#include <lcms2.h>

struct declared_color {
    char source[48];        /* what declares the curve, as messages name it: "gAMA chunk"; "": nothing does */
    char curve_name[48];    /* "linear", "gamma 2.2", "the curve of sRGB" */
    bool rounded;           /* gAMA, which also stands for the curve of sRGB */
    cmsToneCurve *curve[3]; /* light of a sample, both from 0 to 1; NULL: not declared */
};

void declared_color_release(struct declared_color *color);

/* Each declares a curve unless an earlier call did; the first one counts. STATUS_NO_MEMORY. */
status declared_color_power(struct declared_color *color, const char *source, double exponent, struct error *err);
status declared_color_srgb(struct declared_color *color, const char *source, struct error *err);
/* table[c]: n values of 16 bits for channel c. */
status declared_color_tables(struct declared_color *color, const char *source, uint32_t n,
                             const uint16_t *const table[3], struct error *err);
/* Declares primaries unless they are declared; enters them into the ledger as `name`. */
void declared_color_primaries(struct photograph_info *info, const char *name, const struct color_primaries *p);

/* An ICC profile. A matrix profile of rgb, or a curve of grey, is applied. STATUS_UNSUPPORTED for other profiles of
 * rgb; a profile that is damaged or of another color space than the picture's is entered as not used. */
status declared_color_icc(struct declared_color *color, const char *path, const void *profile, size_t n_bytes,
                          bool grey, struct photograph_info *info, struct error *err);
/* The four numbers of a chunk cICP (ITU-T H.273). STATUS_UNSUPPORTED for PQ, HLG and everything that is not known. */
status declared_color_cicp(struct declared_color *color, const char *path, const uint8_t code[4],
                           struct photograph_info *info, struct error *err);
/* The color space of Exif, where nothing else declares a curve. */
status declared_color_exif(struct declared_color *color, struct photograph_info *info, struct error *err);

/* Light of the sample v, from 0 to 1, by the declared curve of channel c. */
double declared_color_light(const struct declared_color *color, size_t c, double v);
/* The largest difference between the declared curve and the curve of a document, of full scale. */
double declared_color_difference(const struct declared_color *color, enum job_transfer transfer);

#endif
