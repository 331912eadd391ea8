/* Exposure time, ISO and f-number from the Exif data of a JPEG (Exif 2.32, TIFF structure). Foreign data: whatever is
 * not as it should be counts as not stated. */
#ifndef SELVEDGE_OPTIMIZER_EXIF_H
#define SELVEDGE_OPTIMIZER_EXIF_H

#include "optimizer/photographs/reader/photograph_reader.h"

/* data: the bytes after "Exif\0\0" in the marker APP1. Sets the members that it states; leaves the others. */
void exif_read(const uint8_t *data, size_t n_bytes, struct photograph_info *info);

#endif
