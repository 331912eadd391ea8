/* Makes one line of all lines that are joined, with vertices about a voxel apart over the gaps between them. */
#ifndef SELVEDGE_GEOMETRY_JOIN_EMIT_H
#define SELVEDGE_GEOMETRY_JOIN_EMIT_H

#include "geometry/fibers/polyline.h"

#include <stdbool.h>

/* The joints of all ends. partner: the end to which an end is joined, UINT32_MAX for a free end; then the number of
 * vertices that are left out there. End 2 l is the first vertex of line l, end 2 l + 1 the last. */
struct join_partners {
    const uint32_t *partner;
    const uint8_t *trim;
};

/* Goes from every free end through partners to the other free end. done: false for each line at first. Sections of the
 * lines are kept, and interpolated over the gaps. out: initialised, empty. STATUS_NO_MEMORY. */
status joins_emit(const struct polyline_set *lines, const struct join_partners *joins, bool *done,
                  struct polyline_set *out, struct error *err);

#endif
