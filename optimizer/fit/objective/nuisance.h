/* Nuisance terms: differences between the radiance that the renderer predicts and the radiance in a photograph which
 * belong to neither the cloth nor the model: a gain (exposure, lamp power) and a constant stray light (glare, room
 * light).
 *
 *   shown = gain * radiance + stray light
 *
 * A global gain and the stray light are fitted with the parameters (fit_layout.h). One gain for each photograph is
 * marginalised in the fit (linear_model.h); its most likely value follows from fresh estimates at the result. */
#ifndef SELVEDGE_OPTIMIZER_NUISANCE_H
#define SELVEDGE_OPTIMIZER_NUISANCE_H

#include "optimizer/photographs/rows/observation.h"
#include "renderer/estimate/estimate.h"

enum { FIT_MAX_NUISANCE = 2 };

#define NUISANCE_GAIN "gain"
#define NUISANCE_STRAY_LIGHT "stray_light"

/* The fitted nuisance terms; se is NaN when it is unknown. */
struct fit_nuisance {
    size_t n;
    char name[FIT_MAX_NUISANCE][16];
    double value[FIT_MAX_NUISANCE], se[FIT_MAX_NUISANCE];
    bool at_bound[FIT_MAX_NUISANCE];
};

/* Converts mean and variance of an estimate to the values in a photograph. Derivatives are not changed. */
void nuisance_show(const struct fit_nuisance *n, const struct estimate *e, struct estimate *out);

/* Most likely gain of one photograph, with its standard error: Gaussian of sd `sd` about 1, residuals of variance
 * misfit_var (in units of the objective) beside the noise of the two replicas and of the photograph. */
void nuisance_photograph_gain(const struct observation *o, const struct estimate *a, const struct estimate *b,
                              double sd, double misfit_var, double *gain, double *se);
/* Multiplies e by the gain that follows from e alone, without the other replica. Two replicas stay independent in
 * this way, so the product of their residuals has no bias by noise. */
void nuisance_apply_own_gain(const struct observation *o, const struct estimate *e, double sd, double misfit_var,
                             struct estimate *out);

#endif
