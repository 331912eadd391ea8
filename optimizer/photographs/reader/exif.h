/* Statements of Exif data (Exif 2.32) and of the first folder of a TIFF file: exposure, orientation, color space.
 * libexif 0.6.24 has no function for numbers of type FLOAT and DOUBLE, and libtiff skips entries whose type is not the
 * one of the standard, so the folders are read here. The data are foreign: a malformed entry counts as not stated. */
#ifndef SELVEDGE_OPTIMIZER_EXIF_H
#define SELVEDGE_OPTIMIZER_EXIF_H

#include "optimizer/photographs/reader/photograph_info.h"

#include <stdio.h>

/* Reads a TIFF or BigTIFF structure from the start of the file: the first folder and the Exif folder that it names.
 * Numbers may have any type. Where there is no exposure time or f-number, the APEX values are taken. Sets the members
 * of info that are stated and not set yet, and adds the rest to the ledger. */
void exif_read(FILE *file, struct photograph_info *info);
/* Reads the same from Exif data in memory. They begin with the TIFF structure, or with "Exif\0\0" before it. */
void exif_read_bytes(const void *data, size_t n_bytes, struct photograph_info *info);

#endif
