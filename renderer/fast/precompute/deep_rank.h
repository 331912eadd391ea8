/* Removes the noise of paths from a table of deep light: retains the part on which two independent halves agree.
 *
 * Means over lights and means over views have little noise. They are retained exactly, so that no energy is lost. The
 * remainder is a matrix of views x (lights and channels): its largest singular values are retained, and the rest of it
 * is multiplied by one factor. Cross-validation chooses the number of singular values and the factor, such that the
 * result from one half differs least from the other half, in the mean of squares. */
#ifndef SELVEDGE_RENDERER_DEEP_RANK_H
#define SELVEDGE_RENDERER_DEEP_RANK_H

#include "base/thread_pool.h"

enum { DEEP_RANK_MOST = 48 };

/* half: the table by each half of the paths, n_view x n_light x 3. view_area, light_area: weight of each view and light
 * in integrals; entries without weight become 0. */
struct deep_halves {
    const double *half[2], *view_area, *light_area;
    size_t n_view, n_light;
};

struct deep_rank_fit {
    size_t rank;    /* singular values that are kept, 0 to DEEP_RANK_MOST */
    double of_rest; /* factor of the rest, 0 to 1 */
    double noise2;  /* sum of view_area * light_area * squared standard error, by the halves' difference */
};

/* Writes the table to value, an array of its own as large as a half. STATUS_NO_MEMORY, STATUS_CANCELLED. */
status deep_rank_keep(const struct deep_halves *t, struct thread_pool *pool, double *value, struct deep_rank_fit *fit,
                      struct error *err);

#endif
