/* Finds the layers of a scan that hold material, before it is read: of a large scan of cloth most is void above and
 * below, which would cost memory and time in every step.
 *
 * The means of 3 x 3 voxels of a slice are taken at up to about 4 million places of a lattice. A layer of the lattice
 * holds material where more of them exceed Otsu's threshold than the noise of the emptiest layers explains. */
#ifndef SELVEDGE_GEOMETRY_VOID_TRIM_H
#define SELVEDGE_GEOMETRY_VOID_TRIM_H

#include "base/progress.h"
#include "geometry/reconstruct/scan_look.h"

enum { VOID_TRIM_MARGIN = 64 }; /* layers of void that are kept on either side: noise is measured in them */

/* Writes the layers range[0] .. range[1] - 1 across an axis of the file (0 columns, 1 rows, 2 slices) that hold
 * material, with the margin: all of them where material cannot be told from void. The padding of `look` is left out.
 * Errors of reading; STATUS_CANCELLED,
 * STATUS_NO_MEMORY. */
status void_trim_find(struct volume_source *source, const struct scan_look *look, int axis,
                      const struct progress *progress, size_t range[2], struct error *err);

#endif
