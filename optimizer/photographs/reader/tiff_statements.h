/* Statements of a TIFF photograph beside its samples: Exif, orientation, profile, curve, primaries, largest sample. */
#ifndef SELVEDGE_OPTIMIZER_TIFF_STATEMENTS_H
#define SELVEDGE_OPTIMIZER_TIFF_STATEMENTS_H

#include "optimizer/photographs/reader/declared_color.h"

#include <tiffio.h>

/* Reads the statements of the current page and of the Exif folder. The file is opened once more under `path`, because
 * libtiff skips numbers of other types than the standard's. Errors: of declared_color_icc. */
status tiff_statements_read(TIFF *tiff, const char *path, struct declared_color *color, struct photograph_info *info,
                            struct error *err);
/* Returns the largest value of samples of `bits` bits: the one that MaxSampleValue or SMaxSampleValue states, where it
 * is the full scale of fewer bits. Other values may be the largest of this picture alone, and are not used. */
unsigned tiff_largest_sample(TIFF *tiff, unsigned bits, struct photograph_info *info);

#endif
