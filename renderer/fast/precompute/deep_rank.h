/* Removes the noise of paths from a table of deep light: retains the part on which two independent halves agree.
 *
 * Means over lights and over views have little noise, and are kept exactly: of each view, channel and light, so that no
 * energy is lost. The remainder is a matrix of views x (lights and channels). Its largest singular values are
 * kept whole, and the rest of it with one factor, as far as both halves agree on it. Number and factor are those with
 * which the matrix of one half is nearest to the other half (cross-validation; both ways, in the mean of squares over
 * views and lights). */
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
    double noise2;  /* sum over the table of both areas times the square of a standard error, from both halves */
};

/* value: as large as a half, apart from them. STATUS_NO_MEMORY, STATUS_CANCELLED. */
status deep_rank_keep(const struct deep_halves *t, struct thread_pool *pool, double *value, struct deep_rank_fit *fit,
                      struct error *err);

#endif
