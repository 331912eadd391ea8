/* Lamps and cameras of a hemisphere, over which materials of other programs are fitted and judged: a job may have few
 * rows, and a material that is fitted to them alone may be wrong everywhere else. */
#ifndef SELVEDGE_OPTIMIZER_CLOTH_DIRECTIONS_H
#define SELVEDGE_OPTIMIZER_CLOTH_DIRECTIONS_H

#include "renderer/scene/configuration.h"

enum { CLOTH_N_FITTED = 64, CLOTH_N_BETWEEN = 24, CLOTH_N_DIRECTION = CLOTH_N_FITTED + CLOTH_N_BETWEEN };

/* A sequence of low discrepancy over the directions of lamp and camera (additive recurrence by the generalised golden
 * ratio of four dimensions). All solid angles up to 75 degrees count alike; beyond, lamps of a job are rare, and the
 * published division by a cosine makes hair bright. The last CLOTH_N_BETWEEN lie between the first. */
void cloth_directions_make(const double tile_m[2], struct configuration c[CLOTH_N_DIRECTION]);

#endif
