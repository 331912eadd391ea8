/* Hair lobes that come nearest to the scattering of a fitted fiber, for programs that do not have its model. */
#ifndef SELVEDGE_OPTIMIZER_HAIR_FIT_H
#define SELVEDGE_OPTIMIZER_HAIR_FIT_H

#include "optimizer/worker/report/export/hair_lobes.h"
#include "renderer/scattering/scattering.h"

struct hair_fit {
    struct hair_lobes lobes;
    /* Root mean square, over all pairs of directions, of the difference of both densities of scattered light, over the
     * root mean square of the fiber's own. */
    double rel_rms;
    /* Shares of the light, means over directions, by channel: what is scattered, and what of it turns back to the side
     * that it came from; of the fiber, and of the lobes. */
    double albedo[3], turned[3], lobes_albedo[3], lobes_turned[3];
    /* For programs with surfaces only: the colour of an opaque diffuse cylinder of which a thick cloth is as
     * bright, and how near the cylinder's own scattering comes, measured as rel_rms. By the theory of Kubelka and
     * Munk 1931 cloth is as bright if as much is absorbed for the light that turns back: (1 - albedo) / turned is
     * the same. */
    double diffuse[3], diffuse_rel_rms;
};

/* Of the light that a diffuse cylinder scatters, what turns back. */
#define HAIR_FIT_DIFFUSE_TURNED (0.5 + 0.125 * 3.14159265358979323846)

/* param: one set, internal units. A section that is not round is seen as a mean over its turns about the axis.
 * STATUS_INVALID as the model's prepare, STATUS_NO_MEMORY. */
status hair_fit_run(const struct scattering_model *model, const double *param, struct hair_fit *fit, struct error *err);

#endif
