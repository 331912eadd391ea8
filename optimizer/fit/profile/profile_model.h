/* A fiber's profile by a scattering model: the radiance that leaves the fiber, per irradiance of parallel light across
 * its direction, L = S(th_i, th_o, phi) cos th_i (scattering.h), as a mean over the width of the fiber for models of
 * the near field, and over the turn of the section for flat fibers, which twist within the lit length. Where a model
 * states the width that its section shows, each turn has as much light as it shows width to the light. */
#ifndef SELVEDGE_OPTIMIZER_PROFILE_MODEL_H
#define SELVEDGE_OPTIMIZER_PROFILE_MODEL_H

#include "base/thread_pool.h"
#include "optimizer/photographs/profile/fiber_profile.h"
#include "renderer/scattering/scattering.h"

/* How the rows are computed. */
struct profile_work {
    struct thread_pool *pool;        /* NULL runs in the caller */
    const struct progress *progress; /* only its `cancel` counts; NULL: none */
};

/* Computes value[i * n_channel + c] of row i and, if jac is not NULL, its derivative by parameter p, jac[(i * n_channel
 * + c) * n_param + p], in internal units. A profile of one channel has the model's first channel. Errors: from the
 * model's prepare; STATUS_CANCELLED, at most 32 rows after the flag was set. */
status profile_model_predict(const struct scattering_model *model, const double *param,
                             const struct fiber_profile *profile, const struct profile_work *work, double *value,
                             double *jac, struct error *err);

#endif
