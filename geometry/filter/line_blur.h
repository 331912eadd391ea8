/* The isotropic part of the line filter (line_filter.h), L = V * [2 sqrt(s/pi) exp(-s |p|^2) - sqrt(t/pi)
 * exp(-t |p|^2)], in a window of slices that moves up through the volume. Each slice has the same bits in every
 * window. */
#ifndef SELVEDGE_GEOMETRY_LINE_BLUR_H
#define SELVEDGE_GEOMETRY_LINE_BLUR_H

#include "base/thread_pool.h"
#include "geometry/volume/volume.h"

struct line_blur;

/* Makes a window of at most n_most slices of v, which must outlive it. STATUS_INVALID for s, t <= 0;
 * STATUS_NO_MEMORY. */
status line_blur_new(const struct volume *v, double s, double t, size_t n_most, struct thread_pool *pool,
                     struct line_blur **blur, struct error *err);
void line_blur_free(struct line_blur *b);
/* Moves the window to the slices from .. to - 1. It costs least where `from` does not fall. STATUS_CANCELLED. */
status line_blur_move(struct line_blur *b, size_t from, size_t to, struct thread_pool *pool,
                      const struct progress *progress);
/* Number of slices by which a window had better move: enough for all threads, and few, since they take memory. */
size_t line_blur_slab(const struct thread_pool *pool);
/* Returns L as a volume of the shape of v, of which only the slices of the window may be read, until it moves. */
struct volume line_blur_volume(const struct line_blur *b);

#endif
