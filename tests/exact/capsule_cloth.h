/* The tubes of a cloth with all their copies by whole tiles, and rays through them. Written from the definition: a tube
 * is the union of its capsules, and all intervals of a ray inside capsules are collected, sorted, and joined tube by
 * tube. A plain grid over one tile says which capsules are near. Double precision throughout, millimetres. Immutable
 * once made: shared by threads.
 */
#ifndef SELVEDGE_TESTS_CAPSULE_CLOTH_H
#define SELVEDGE_TESTS_CAPSULE_CLOTH_H

#include "tests/exact/capsule.h"
#include "tests/exact/tube_links.h"

#include <stddef.h>

struct capsule_entry;

struct capsule_cloth {
    size_t n_capsule;
    struct capsule *capsule;
    uint32_t *fiber; /* of each capsule */
    struct tube_links links;
    double tile_mm[2];
    double low_mm[3]; /* corner of the grid over one tile */
    int n_cell[3];
    double cell_mm[3];
    uint32_t *first; /* of each cell, its first entry; one more */
    struct capsule_entry *entry;
};

/* Makes capsules and grid. z_top_m becomes z = 0. False: out of memory. Release in any case. */
bool capsule_cloth_init(struct capsule_cloth *c, const struct fiber_set *f, double z_top_m);
void capsule_cloth_release(struct capsule_cloth *c);
/* Moves a point to the nearest place on the surface of a capsule, of which the nearest copy is taken, if it lies within
 * this distance from there. False: it does not. */
bool capsule_cloth_project(const struct capsule_cloth *c, uint32_t i_capsule, double within_mm, double x[3]);

/* Where a ray comes into a tube. */
struct capsule_entrance {
    double t;
    uint32_t i_capsule;
    int shift[2]; /* of the copy, in tiles */
};

enum { CAPSULE_MOST_INTERVALS = 1024, CAPSULE_MOST_OPEN = 64 };

struct capsule_part {
    double from, to;
    uint32_t i_capsule;
    int shift[2];
};

/* A ray on its way. It leaves every tube that it starts in at the end of that interval, wherever this lies, and its
 * next entrance is that into any other tube, or into one of these again. */
struct capsule_walk {
    double slack;          /* a tube whose interval begins up to there contains the start: set by the caller */
    size_t n_open, n_part; /* 0 at the start */
    struct {
        struct tube tube;
        double to;             /* as far as it is known */
    } open[CAPSULE_MOST_OPEN]; /* the tubes that contain the start */
    struct capsule_part part[CAPSULE_MOST_INTERVALS];
};

/* Goes along o + t d from t0 to t1, which may be INFINITY; t0 is the t1 of the piece before, or 0. d of any length.
 * True: an entrance. */
bool capsule_walk_piece(struct capsule_walk *w, const struct capsule_cloth *c, const double o[3], const double d[3],
                        double t0, double t1, struct capsule_entrance *entrance);

#endif
