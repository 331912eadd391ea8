/* Hair lobes that come nearest to the scattering of a fitted fiber, for programs that do not have its model. */
#ifndef SELVEDGE_OPTIMIZER_HAIR_FIT_H
#define SELVEDGE_OPTIMIZER_HAIR_FIT_H

#include "optimizer/report/export/hair_lobes.h"
#include "renderer/scattering/scattering.h"

enum { HAIR_FIT_N_BLEND = 2 };

/* Two hair materials. A point of a fiber has the second material with the probability second_share. Two are needed
 * because a material has a single roughness for reflected and transmitted light. */
struct hair_blend {
    struct hair_lobes lobes[HAIR_FIT_N_BLEND];
    double second_share;
};

struct hair_fit {
    struct hair_blend blend;
    /* Root mean square, over all pairs of directions, of the difference of both densities of scattered light, over the
     * root mean square of the fiber's own. */
    double rel_rms;
    /* Shares of the light, means over directions, by channel: all scattered light, and the part that turns back to the
     * side of the light, of the fiber. */
    double albedo[3], turned[3];
    /* For programs with surfaces only: an opaque fiber, diffuse under a rough dielectric. Index and roughness (whose
     * square is GGX's alpha) bring its scattering nearest to the fiber's; the colour makes a thick cloth as bright. By
     * the theory of Kubelka and Munk 1931 that is so if as much is absorbed for the light that turns back: (1 - albedo)
     * / turned is the same. */
    struct surface_fit {
        double diffuse[3], index, roughness;
        double rel_rms, albedo[3], turned[3]; /* of this fiber; rel_rms measured as above */
    } surface;
};

/* param: one set, internal units. A section that is not round is seen as a mean over its turns about the axis.
 * known: a blend to take in place of the search for one, which takes seconds; NULL: none. STATUS_INVALID as the model's
 * prepare, STATUS_NO_MEMORY. */
status hair_fit_run(const struct scattering_model *model, const double *param, const struct hair_blend *known,
                    struct hair_fit *fit, struct error *err);

#endif
