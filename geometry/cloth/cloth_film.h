/* Films of a described cloth: a flat film around a yarn or in place of one, and sequins. Each is a chain of flat
 * sections, which is appended to the fibers once these have been pushed apart, and out of the films (film_obstacle.h).
 * Lengths are in metres. Used only in this folder. */
#ifndef SELVEDGE_GEOMETRY_CLOTH_FILM_H
#define SELVEDGE_GEOMETRY_CLOTH_FILM_H

#include "geometry/cloth/cloth_work.h"

struct film_node {
    double p[3];
    float axis[3];           /* along the long axis of the section, of any length but 0 */
    float half_m[2];         /* half width, half thickness */
    float step_m;            /* distance of nodes at the description's own values; not of sequins */
    uint8_t group, is_first; /* is_first: a new chain begins here */
    uint8_t axis_class;
};

/* Adds the film of one yarn of a kind that has one: with turns about the path where the kind has fibers, else along it.
 * nominal_m: length of the yarn at the description's own values. The film is one tile long; the number of its turns is
 * whole, so that it goes on in the next tile. STATUS_NO_MEMORY, STATUS_TOO_LARGE. */
status cloth_film_wrap(struct cloth_work *w, size_t kind, const struct yarn *path, double nominal_m, struct error *err);
/* Adds the sequins of the description on a cloth whose highest surface is top_m: discs in rows along x, every other row
 * moved by half a step. All lean by the same tilt, so that they overlap like tiles of a roof without meeting; the
 * spread of tilts moves each at random. */
status cloth_film_sequins(struct cloth_work *w, double top_m, struct error *err);
/* Widens low and high by the surfaces of all films. */
void cloth_film_range(const struct cloth_work *w, double *low_m, double *high_m);
/* Appends all films to the fibers, moved by shift_m along z. STATUS_NO_MEMORY. */
status cloth_film_append(const struct cloth_work *w, double shift_m, struct fiber_set *f, struct error *err);

#endif
