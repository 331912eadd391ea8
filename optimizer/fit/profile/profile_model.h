/* What a scattering model says of a fiber's profile: the radiance that leaves the fiber, per irradiance of parallel
 * light across its direction, L = S(th_i, th_o, phi) cos th_i (scattering.h), as a mean over the width of the fiber for
 * models of the near field, and over the turn of the section for flat fibers, which twist within the lit length.
 */
#ifndef SELVEDGE_OPTIMIZER_PROFILE_MODEL_H
#define SELVEDGE_OPTIMIZER_PROFILE_MODEL_H

#include "base/thread_pool.h"
#include "optimizer/fit/profile/fiber_profile.h"
#include "renderer/scattering/scattering.h"

/* Computes value[i * n_channel + c] of row i and, if jac is not NULL, its derivative by parameter p,
 * jac[(i * n_channel + c) * n_param + p], in internal units. A profile of one channel has that of the model's first.
 * pool: NULL runs in the caller. Errors are those of the model's prepare. */
status profile_model_predict(const struct scattering_model *model, const double *param,
                             const struct fiber_profile *profile, struct thread_pool *pool, double *value, double *jac,
                             struct error *err);

#endif
