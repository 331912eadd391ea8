/* Functions that add the yarns, loops, felt and pile of a phantom; twists are rounded so that the tile closes. Used
 * only in this folder. */
#ifndef SELVEDGE_GEOMETRY_PHANTOM_STRAND_H
#define SELVEDGE_GEOMETRY_PHANTOM_STRAND_H

#include "geometry/cloth/yarn_path.h"
#include "geometry/phantom/phantom_option.h"

/* The strands of a phantom, and the numbers of its plied yarns after rounding. */
struct phantom_strands {
    struct strand_set set;
    struct phantom_plied plied;
};

/* Greatest common divisor, where 0 is allowed. After a / gcd(a, k) steps of k a ring of length a is closed. */
static inline size_t strand_greatest_divisor(size_t a, size_t b)
{
    return b == 0 ? a : strand_greatest_divisor(b, a % b);
}

/* The two functions below for yarns with plies. */
double plied_section_radius_m(const struct phantom_option *o, double fiber_radius_m);
status plied_yarn_add(struct phantom_strands *s, const struct phantom_option *o, const struct yarn *y,
                      struct error *err);

/* Radius of a yarn's round section, to the surface of the outermost fiber. */
double yarn_section_radius_m(const struct phantom_option *o, double fiber_radius_m);
/* Adds the fibers of one yarn and its fly-aways. */
status yarn_add(struct phantom_strands *s, const struct phantom_option *o, const struct yarn *y, struct error *err);

/* Fill the set; o has been checked. They set tile_m to whole voxels. */
status weave_make(struct phantom_strands *s, const struct phantom_option *o, struct phantom_report *r,
                  struct error *err);
status knit_make(struct phantom_strands *s, const struct phantom_option *o, struct phantom_report *r,
                 struct error *err);
status felt_make(struct strand_set *s, const struct phantom_option *o, struct error *err);
status pile_add(struct strand_set *s, const struct phantom_option *o, double ground_z_m, struct error *err);

#endif
