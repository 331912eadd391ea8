/* Exposure and orientation from an XMP packet (ISO 16684-1: properties of Exif and TIFF as XML). Exif data come
 * first. The names are searched in the text: as attributes, elements, or the first item of a list. */
#ifndef SELVEDGE_OPTIMIZER_XMP_H
#define SELVEDGE_OPTIMIZER_XMP_H

#include "optimizer/photographs/reader/photograph_info.h"

/* Sets the members of info that are stated here and not set yet. */
void xmp_read(const void *packet, size_t n_bytes, struct photograph_info *info);

#endif
