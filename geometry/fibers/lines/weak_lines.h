/* Lines that the scan does not support. */
#ifndef SELVEDGE_GEOMETRY_WEAK_LINES_H
#define SELVEDGE_GEOMETRY_WEAK_LINES_H

#include "geometry/fibers/polyline.h"
#include "geometry/volume/volume.h"

/* Copies the lines without the weak ones: their radius is at most least_radius, to which a fit takes it where it finds
 * no edge, and their mean density is below least_density. Noise beside fibers, and a background that is bright, have
 * such lines. Lines of unknown radius stay. STATUS_NO_MEMORY. */
status polylines_drop_weak(const struct polyline_set *in, const struct volume *v, double least_radius,
                           double least_density, struct polyline_set *out, struct error *err);

#endif
