/* Shared by the readers of integer pictures (PNG, JPEG, TIFF): the curve that the document or the file declares, and
 * refusals that they have in common. */
#ifndef SELVEDGE_OPTIMIZER_INTEGER_SAMPLES_H
#define SELVEDGE_OPTIMIZER_INTEGER_SAMPLES_H

#include "optimizer/photographs/reader/declared_color.h"

/* Checks that document or file declare how integer samples stand for light. STATUS_INVALID with the words to write;
 * also where both do and differ by more than 0.02 of full scale, and for a black level of samples that are not linear,
 * or above the largest sample. Fills the members of info that follow, and releases a curve of `color` that the
 * document's replaces. */
status integer_samples_declare(const char *path, const struct photograph_request *q, unsigned bits,
                               struct declared_color *color, struct photograph_info *info, struct error *err);
/* Returns the light of each of the 2^bits sample values of each channel, channel after channel, 1 for the largest, and
 * sets info->saturation for samples whose largest value is `largest`. The caller frees it; NULL without memory.
 * IEC 61966-2-1 for sRGB. */
float *integer_samples_curves(const struct photograph_request *q, const struct declared_color *color, unsigned largest,
                              struct photograph_info *info);
/* Enters the number of significant bits of each channel, 0: not stated. Returns the largest sample value that they
 * allow, where they stand at the upper end of `depth` bits. */
unsigned integer_samples_significant(const unsigned bits[3], unsigned depth, struct photograph_info *info);
/* STATUS_UNSUPPORTED for a picture that is transparent somewhere. */
status integer_samples_transparent(const char *path, struct error *err);
/* STATUS_UNSUPPORTED for a picture of a palette. */
status integer_samples_palette(const char *path, struct error *err);

#endif
