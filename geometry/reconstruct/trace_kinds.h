/* The kinds of traced lines by their radius: thick and thin fibers side by side in one scan. */
#ifndef SELVEDGE_GEOMETRY_TRACE_KINDS_H
#define SELVEDGE_GEOMETRY_TRACE_KINDS_H

#include "geometry/fibers/polyline.h"

struct trace_kinds {
    double spread;        /* of the radii over their mean, within the kind where it is larger */
    double thin_diameter; /* mean of the thin kind, in the unit of the lines; 0: there is one kind */
};

/* Finds the kinds of lines with known radii (fiber_kinds.h). spread: of the radii of all lines, which is left as it is
 * where there is one kind. STATUS_NO_MEMORY. */
status trace_find_kinds(const struct polyline_set *lines, double spread, struct trace_kinds *kinds, struct error *err);

#endif
