/* Estimates of configurations whose radiance is the mean over cloth rotations (configuration.h, n_rotation): each such
 * configuration is estimated at its rotations, with an equal share of its paths each, and the estimates are averaged.
 * A stratified mean: unbiased for the rotations stated, and its variance comes from the paths alone.
 */
#ifndef SELVEDGE_RENDERER_ROTATION_MEAN_H
#define SELVEDGE_RENDERER_ROTATION_MEAN_H

#include "base/status.h"
#include "renderer/estimate/radiance_estimate.h"
#include "renderer/scene/configuration.h"

struct rotation_mean {
    size_t n, n_turned;           /* configurations asked for, and rotations of all of them */
    struct configuration *turned; /* in the order asked for; n_rotation 0 */
    size_t *n_path;               /* of turned */
    size_t *first;                /* n + 1 entries: the rotations of i are first[i] .. first[i + 1] - 1 */
    size_t *row;                  /* of turned: the configuration asked for */
    struct estimate *estimate;    /* of turned; filled in by the caller */
};

/* True when any configuration asks for more than one rotation. Otherwise the functions below are not needed. */
bool rotation_mean_wanted(const struct configuration *c, size_t n);
/* STATUS_INVALID (contrast of a mean over rotations), STATUS_NO_MEMORY. Release in any case. */
status rotation_mean_init(struct rotation_mean *m, const struct configuration *c, const size_t *n_path, size_t n,
                          struct error *err);
/* out: n estimates from m->estimate. */
void rotation_mean_take(const struct rotation_mean *m, struct estimate *out);
void rotation_mean_release(struct rotation_mean *m);

#endif
