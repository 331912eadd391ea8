/* Metadata as ImageMagick and others put them into PNG files before the format had chunks for them: a text chunk
 * "Raw profile type NAME" with the number of bytes and the bytes in hexadecimal digits. */
#ifndef SELVEDGE_OPTIMIZER_PNG_RAW_PROFILE_H
#define SELVEDGE_OPTIMIZER_PNG_RAW_PROFILE_H

#include "optimizer/photographs/reader/photograph_info.h"

#include <stddef.h>

/* Reads a text chunk into info if it is such a profile of Exif ("exif", "APP1") or XMP ("xmp"); one of another name is
 * entered as not used. Damaged digits are left out, as the file then states nothing. */
void png_raw_profile_read(const char *key, const char *text, size_t n_text, struct photograph_info *info);

#endif
