/* Shared by the readers of integer pictures (PNG, JPEG, TIFF): the declared transfer curve, and the check of an alpha
 * channel. */
#ifndef SELVEDGE_OPTIMIZER_INTEGER_SAMPLES_H
#define SELVEDGE_OPTIMIZER_INTEGER_SAMPLES_H

#include "optimizer/photographs/reader/photograph_reader.h"

/* Checks that the document declares how integer samples stand for light. STATUS_INVALID with the words to write; also
 * for a black level of samples that are not linear, or above the largest sample. Fills the members of info that
 * follow. */
status integer_samples_declare(const char *path, const struct photograph_request *q, unsigned bits,
                               struct photograph_info *info, struct error *err);
/* Light of each of the 2^bits sample values, 1 for the largest. The caller frees it; NULL without
 * memory. IEC 61966-2-1 for sRGB. */
float *integer_samples_curve(const struct photograph_request *q, const struct photograph_info *info);
/* STATUS_UNSUPPORTED for a picture that is transparent somewhere. */
status integer_samples_transparent(const char *path, struct error *err);
/* STATUS_UNSUPPORTED for a picture of a palette. */
status integer_samples_palette(const char *path, struct error *err);

#endif
