/* A bound that excludes void without evaluating any direction. J is minus the sum of h values of the blurred volume
 * L (line_filter.h), so J >= -h max L over all voxels that a line may touch. Block maxima of L show where J cannot
 * be low enough; without this bound the noise in void would be searched for fibers voxel by voxel. */
#ifndef SELVEDGE_GEOMETRY_LINE_BOUND_H
#define SELVEDGE_GEOMETRY_LINE_BOUND_H

#include "base/thread_pool.h"
#include "geometry/filter/line_blur.h"

#include <stdbool.h>

enum { LINE_BOUND_CELL = 8 };

struct line_bound {
    size_t n[3]; /* cells */
    bool *reaches;
};

/* Sets a cell of `reaches` if L is at least `least` somewhere within `reach` voxels of it. Moves `blur`.
 * STATUS_NO_MEMORY, STATUS_CANCELLED. */
status line_bound_init(struct line_bound *b, struct line_blur *blur, size_t reach, double least,
                       struct thread_pool *pool, struct error *err);
void line_bound_release(struct line_bound *b);

static inline bool line_bound_reaches(const struct line_bound *b, size_t i, size_t j, size_t k)
{
    return b->reaches[(k / LINE_BOUND_CELL * b->n[1] + j / LINE_BOUND_CELL) * b->n[0] + i / LINE_BOUND_CELL];
}

#endif
