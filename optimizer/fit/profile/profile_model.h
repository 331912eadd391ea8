/* A fiber's profile by a scattering model: the radiance that leaves the fiber, per irradiance of parallel light across
 * its direction, L = S(th_i, th_o, phi) cos th_i (scattering.h), as a mean over the width of the fiber for models of
 * the near field, and over the turn of the section for flat fibers, which twist within the lit length. Where a model
 * states the width that its section shows, each turn has as much light as it shows width to the light.
 *
 * A profile with azimuths of the light is not a mean over turns: its section is turned by `turn_rad`, the azimuth of v
 * of the fiber frame (the short axis of an elliptical section) in the sense of phi_i, from where phi_i is 0. */
#ifndef SELVEDGE_OPTIMIZER_PROFILE_MODEL_H
#define SELVEDGE_OPTIMIZER_PROFILE_MODEL_H

#include "base/thread_pool.h"
#include "optimizer/photographs/profile/fiber_profile.h"
#include "renderer/scattering/scattering.h"

/* Returns whether the profile has azimuths of the light that the model distinguishes, so that the turn counts. */
bool profile_model_turns(const struct scattering_model *model, const struct fiber_profile *profile);

/* How the rows are computed. Without members all modes are computed in the caller, at the turn 0. */
struct profile_work {
    struct thread_pool *pool;        /* NULL runs in the caller */
    const struct progress *progress; /* only its `cancel` counts; NULL: none */
    double turn_rad;                 /* where profile_model_turns */
    size_t mode;                     /* 0: all modes; k + 1: scattering_model.mode[k] alone */
    double *by_turn;                 /* NULL, or the derivative of each value by turn_rad, per radian; 0 where no turn
                                      * counts. From a difference over +-0.5 degrees */
};

struct profile_scan {
    size_t n;
    double *value;
    void (*found)(void *context, size_t k, const double *value);
    void *context;
};

/* Computes value[i * n_channel + c] of row i and, if jac is not NULL, its derivative by parameter p, jac[(i * n_channel
 * + c) * n_param + p], in internal units. A profile of one channel has the model's first channel. Errors: from the
 * model's prepare; STATUS_CANCELLED, at most 32 rows after the flag was set. */
status profile_model_predict(const struct scattering_model *model, const double *param,
                             const struct fiber_profile *profile, const struct profile_work *work, double *value,
                             double *jac, struct error *err);

/* Scans the turn: computes the values at each of n turns spread evenly over half a turn, k pi / n, and calls
 * found(context, k, value) in order. work->turn_rad and by_turn are ignored; value: room for those of all rows. Errors
 * as above. */
status profile_model_scan(const struct scattering_model *model, const double *param,
                          const struct fiber_profile *profile, const struct profile_work *work,
                          const struct profile_scan *scan, struct error *err);

#endif
