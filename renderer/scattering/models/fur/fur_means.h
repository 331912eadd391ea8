/* Shares of light in the mean over the offset of a fiber with a medulla, without absorption, by cos th_d, and their
 * derivatives. The balance along the fiber takes the light around it from them (fur.h). */
#ifndef SELVEDGE_RENDERER_FUR_MEANS_H
#define SELVEDGE_RENDERER_FUR_MEANS_H

#include "base/thread_pool.h"
#include "renderer/scattering/models/fur/fur_mean.h"

struct fur_means {
    struct fur_mean row[FUR_N_ROW + 1][FUR_N_PART_OF_LIGHT];
};

/* The pool may be NULL. */
void fur_means_fill(struct fur_means *m, const double *param, struct thread_pool *pool);
/* Between two rows by straight lines. */
struct fur_mean fur_mean_at(const struct fur_means *m, double cos_theta, int part);

#endif
