/* The ends of fibers at the two opposite faces of a tile, and their partners across the seam.
 *
 * An end (first or last vertex) may lie on the seam if it is within six radii of a face across x or y and points
 * outwards, by more than 17 degrees from the plane of the face. Two ends at opposite faces may continue each other if
 * they belong to the same group, their directions differ by less than 45 degrees, and the gap between them along the
 * axis is at most two radii (both may lie beyond or before their faces where the tile is warped). Their distance is
 * taken where the faces are, along their tangents, in the plane of the face, which is periodic in the other axis. */
#ifndef SELVEDGE_GEOMETRY_SEAM_ENDS_H
#define SELVEDGE_GEOMETRY_SEAM_ENDS_H

#include "geometry/fibers/fiber_set.h"
#include "geometry/fibers/seam/seam_field.h"

#include <stdbool.h>

struct seam_end {
    size_t i_fiber;
    bool last;         /* the fiber's last vertex instead of its first */
    double p[3], t[3]; /* metres; t: unit tangent, outwards */
    double at[2];      /* where it meets the face: along the other axis, and z */
    double radius;
    double depth; /* distance from the face, positive within the tile */
};

struct seam_ends {
    const struct fiber_set *f;
    int axis;
    struct seam_end *end[2]; /* at the low and at the high face, by height */
    size_t n[2];
    size_t *partner; /* of each end at the low face: index of one at the high face; SIZE_MAX: none */
    size_t n_pair;
};

/* The seam across axis 0 (x) or 1 (y). STATUS_NO_MEMORY. */
status seam_ends_collect(struct seam_ends *s, const struct fiber_set *f, int axis, struct error *err);
void seam_ends_release(struct seam_ends *s);

/* Cost of a pair: the square of its distance in radii. SEAM_BY_SHAPE adds the squares of the angle between the ends
 * over 0.2 rad and of the difference of their radii over a fifth of them. */
enum seam_cost { SEAM_BY_DISTANCE, SEAM_BY_SHAPE };

/* Finds partners within `reach` radii by the assignment of least cost; two ends without partners cost reach^2. The
 * offsets of `field` (NULL: none) are subtracted first. STATUS_NO_MEMORY. */
status seam_ends_match(struct seam_ends *s, enum seam_cost cost, double reach, const struct seam_field *field,
                       struct error *err);

/* Number of ends on the seam: those with a partner, and those within one radius of their face. */
size_t seam_ends_count(const struct seam_ends *s);

/* Finds the offset by which most ends at the high face lie beside ends at the low face, within 8 radii; 0 where no
 * offset stands out among those that unrelated ends have. STATUS_NO_MEMORY. */
status seam_ends_common_offset(const struct seam_ends *s, double offset_m[2], struct error *err);

/* From an end at the low face to its partner, in the plane of the face. */
void seam_ends_offset(const struct seam_ends *s, size_t low, double offset_m[2]);
/* Angle between an end at the low face and its partner. */
double seam_ends_angle_rad(const struct seam_ends *s, size_t low);

#endif
