/* Directions of fibers by structure tensors, sampled in bricks that are spread evenly over a volume. Only bricks of
 * some 30 voxels are read at a time, so the volume may be larger than memory. */
#ifndef SELVEDGE_GEOMETRY_DIRECTION_SAMPLES_H
#define SELVEDGE_GEOMETRY_DIRECTION_SAMPLES_H

#include "base/thread_pool.h"
#include "geometry/volume/volume.h"

enum { DIRECTION_SAMPLES_PER_BRICK = 64 };

/* d: unit direction of least change. weight: how clearly it is a single line, in 0..1; 0 means that there is no
 * sample. */
struct direction_sample {
    float d[3], weight;
};

/* Brick b has the samples b * DIRECTION_SAMPLES_PER_BRICK and following. Bricks b, b + n_column, b + 2 n_column, ...
 * lie above each other in z. */
struct direction_samples {
    size_t n_brick, n_column; /* n_column: number of columns of bricks in x and y */
    struct direction_sample *sample;
};

/* Takes samples where the blurred volume reaches `material`, a scanner value. STATUS_CANCELLED, STATUS_NO_MEMORY. */
status direction_samples_take(const struct volume *v, double material, struct thread_pool *pool,
                              const struct progress *progress, struct direction_samples *samples, struct error *err);
void direction_samples_release(struct direction_samples *samples);

#endif
