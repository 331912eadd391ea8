/* An estimator whose parameters are those of the scattering model followed by the numbers of the cloth (flatness of its
 * yarns, their packing, ...). A method of descent then fits both together.
 *
 * Paths have no derivative by a number of the cloth, because moving a fiber changes what a path hits. These columns are
 * therefore differences between two cloths: the mean radiance at number k moved by `difference` of its range in the fit
 * coordinate, minus that of the cloth itself, over the distance. Even iterations move up and odd ones down, and a fit
 * averages the derivatives of all its iterations: that is a central difference (error of second order) for the price of
 * a one-sided one. Both replicas of an iteration see the same cloths, so each cloth is built once. Where a move would
 * leave the bounds it goes to the other side. All cloths are traced with the same random numbers, and the
 * variance of a difference is stated as if the two means were independent, which is an upper limit where they are
 * positively correlated.
 *
 * A fit of m numbers thus traces m + 1 cloths for each estimate. The scattering parameters are not searched again at
 * every cloth: minimising the linearised residuals over both blocks at once gives the same step as variable projection
 * (Golub and Pereyra 1973, section 2; Kaufman 1975 for the form of the Jacobian used here), which removes the
 * scattering parameters first.
 */
#ifndef SELVEDGE_OPTIMIZER_CLOTH_ESTIMATOR_H
#define SELVEDGE_OPTIMIZER_CLOTH_ESTIMATOR_H

#include "optimizer/fit/descent/descent.h"

enum { CLOTH_MAX_FITTED = 32 };

/* Gives estimates of one cloth after the other. estimate: `number` has n_number values in internal units; call->param
 * are the scattering parameters alone, and the derivatives in `out` are by these. The result must depend on its
 * arguments only. Its errors end the fit. */
struct cloth_source {
    void *context;
    size_t n_number;
    status (*estimate)(void *context, const double *number, const struct estimator_call *call,
                       const struct progress *progress, struct estimate *out, double *wall_s, struct error *err);
};

struct cloth_estimator {
    struct cloth_source source;
    size_t n_scattering; /* parameters of the scattering model */
    size_t n_configuration;
    struct coordinate coordinate[CLOTH_MAX_FITTED]; /* of the numbers, with the bounds of the fit */
    bool fixed[CLOTH_MAX_FITTED];                   /* no differences are made; their derivatives are 0 */
    bool number_derivatives;                        /* whether estimates have them; without, they trace one cloth */
    double difference;                              /* share of the range, in (0, 0.5] */
    struct estimate *moved;                         /* n_configuration, owned */
};

/* info, parameter: of the numbers. STATUS_INVALID for more than CLOTH_MAX_FITTED numbers; STATUS_NO_MEMORY. */
status cloth_estimator_init(struct cloth_estimator *e, const struct cloth_source *source, size_t n_scattering,
                            size_t n_configuration, const struct param_info *info,
                            const struct fit_parameter *parameter, struct error *err);
void cloth_estimator_release(struct cloth_estimator *e);
/* It has n_scattering + n_number parameters and uses e, which must not move in memory. */
struct estimator cloth_estimator(struct cloth_estimator *e);

#endif
