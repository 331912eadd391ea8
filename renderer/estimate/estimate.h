/* Path-traced estimates of mean radiance over a photograph's crop, with derivatives by every parameter of the model
 * from the same paths (fabric thesis 5.5.1, figure 5.3), for fibers and for volumes. Every figure carries the variance
 * of its mean. Results depend on the key and the counts only: bit-identical for any number of threads.
 */
#ifndef SELVEDGE_RENDERER_ESTIMATE_H
#define SELVEDGE_RENDERER_ESTIMATE_H

#include "base/thread_pool.h"
#include "renderer/estimate/radiance_estimate.h"
#include "renderer/transport/radiance_request.h"

/* out: n_configuration estimates. STATUS_INVALID (a configuration, a parameter, fewer sets than groups, a cloth without
 * the form that the model needs), STATUS_CANCELLED (within 100 ms), STATUS_NUMERIC (naming model and configuration when
 * a NaN appears).
 */
status estimate_run(const struct estimate_request *q, struct thread_pool *pool, const struct progress *progress,
                    struct estimate *out, struct error *err);

/* For estimates that are moved to other places of an array: replaces the number k of each partner by place[k], and
 * leaves out partners whose place is SIZE_MAX. */
void estimate_move_partners(struct estimate *e, const size_t *place);

/* Paths that are traced for a configuration of which n_path (more than 0) are asked: whole blocks of
 * RADIANCE_BLOCK_PATHS, for every rotation; as many for every part of a contrast. */
size_t estimate_n_path(const struct configuration *c, size_t n_path);

#endif
