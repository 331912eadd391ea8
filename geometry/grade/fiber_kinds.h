/* The kinds of fibers in a scan, by density and radius. */
#ifndef SELVEDGE_GEOMETRY_FIBER_KINDS_H
#define SELVEDGE_GEOMETRY_FIBER_KINDS_H

#include "geometry/fibers/fiber_set.h"
#include "geometry/volume/volume.h"

enum { FIBER_KINDS_MOST = 4 };

/* A fiber by its radius and length, in any unit. */
struct fiber_row {
    double radius, length;
};

/* Sorts rows, the thickest first, and returns how many of them are a kind of their own; n if there is one kind. */
size_t fiber_rows_split(struct fiber_row *row, size_t n);

struct fiber_kinds {
    size_t n;
    struct fiber_kind {
        double density;     /* over the densest fibers' */
        double share;       /* of the length of all fibers */
        double radius_m;    /* mean by length */
        double radius_se_m; /* of the mean; NaN: not known */
        size_t n_fiber;
    } kind[FIBER_KINDS_MOST];
};

/* Sorts the fibers into kinds: those with most of their length in v->light from the others, and each of these into
 * thick and thin fibers where there is a gap between both. Dense kinds come first, and thick ones before thin ones.
 * single_se_m, shared_se_m: standard errors of the radius of one fiber, and of all radii together; NaN: not known.
 * STATUS_NO_MEMORY. */
status fiber_kinds_measure(const struct volume *v, const struct fiber_set *f, double single_se_m, double shared_se_m,
                           struct fiber_kinds *kinds, struct error *err);

#endif
