/* The contrast of a crop's texture, estimated from paths that are spread evenly over equal parts ("cells") of the crop.
 *
 *   C = 1/(K - 1) sum_k (mu_k - mu)^2 / mu^2,      mu_k: mean radiance of cell k of K = n_side^2, mu: of the crop
 *
 * each channel on its own. Plain squares of noisy means would add their noise; so each cell has two independent sets of
 * paths with means a_k and b_k, and the numerator is 1/(K - 1) sum_k (a_k - a)(b_k - b), whose expectation is the
 * numerator of the true means for any number of paths. The denominator is a b. The remaining bias of the
 * quotient falls with the paths of the whole crop, not of a cell: about 4 times the relative variance of their mean.
 * The derivative belongs to the same expression, one set's value with the other's derivative and the mirror image.
 *
 * Variance: delta rule with the sample variances inside cells (and their covariances with the derivatives); the term
 * that both sets have in common, s_a s_b, is counted once.
 *
 * Called by estimate_blocks.c. A task consists of whole cells, so results do not depend on the threads.
 */
#ifndef SELVEDGE_RENDERER_CONTRAST_BLOCKS_H
#define SELVEDGE_RENDERER_CONTRAST_BLOCKS_H

#include "renderer/estimate/block_trace.h"
#include "renderer/estimate/radiance_estimate.h"

struct contrast_plan {
    size_t n_side, n_cell, n_half; /* cells a side, cells, paths of each of a cell's two sets */
    size_t n_task, cells_per_task, blocks_per_task;
    size_t n_jac;
    double *sum; /* owned */
};

/* n_path: rounded up to 4 a cell. STATUS_NO_MEMORY. */
status contrast_plan_init(struct contrast_plan *c, size_t n_side, size_t n_path, size_t n_jac, struct error *err);
void contrast_plan_release(struct contrast_plan *c);
/* Traces all paths of task i_task. Returns the number of bounces. value: room for RADIANCE_BLOCK_PATHS x (3 + n_jac).
 */
uint64_t contrast_trace_task(const struct estimate_blocks *b, const struct contrast_plan *c, size_t i_group,
                             size_t i_task, float *value);
/* The sums of task i_task, which lie in a row, and how many they are. */
size_t contrast_task_sums(const struct contrast_plan *c, size_t i_task, double **sum);
/* Mean, variance and derivatives of the contrast, n_path; false when *bad_value is not finite. */
bool contrast_reduce(const struct contrast_plan *c, struct estimate *e, size_t *bad_value);

#endif
