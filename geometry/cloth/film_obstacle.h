/* Films as obstacles: fibers are pushed out of the films of a cloth while they are pushed apart. Used only in this
 * folder. */
#ifndef SELVEDGE_GEOMETRY_FILM_OBSTACLE_H
#define SELVEDGE_GEOMETRY_FILM_OBSTACLE_H

#include "geometry/cloth/cloth_film.h"

/* Appends a row of fixed strands for each film: as thick as the film, beside each other over its width, near enough
 * that a fiber between two of them sinks into the film by at most a quarter of the thickness. Their numbers of nodes
 * follow from the description's own values. The caller removes them after strand_relax, by the numbers of strands and
 * of nodes before. STATUS_NO_MEMORY, STATUS_TOO_LARGE. */
status film_obstacles_add(struct cloth_work *w, struct error *err);

#endif
