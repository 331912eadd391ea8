/* An estimator whose parameters are the scattering model's, followed by the numbers of the cloth (flatness of its
 * yarns, their packing, ...). A method of descent then fits both together.
 *
 * Paths have no derivative by a number of the cloth, because moving a fiber changes the hits of a path. These columns
 * are therefore differences between cloths whose numbers are moved by `difference` of their ranges in the fit
 * coordinate:
 *
 * CLOTH_MOVES_BALANCED, the default. All numbers move at once, up in half of the cloths and down in the other half, by
 * the columns of a Hadamard matrix (Plackett and Burman 1946; quadratic residues, Paley 1933). Every moved cloth thus
 * says something about every number. All moved cloths together take as many paths as the cloth itself. Compared with m
 * numbers moved one after the other, the same paths give columns of an (m + 1)th of the variance and means of two (m +
 * 1)ths. Odd iterations take the opposite moves, which removes joint effects of pairs of numbers.
 *
 * CLOTH_MOVES_SINGLE. One cloth for each number, with as many paths as the cloth itself: its mean minus the mean of the
 * cloth itself. Even iterations move up and odd ones down. For estimates of a single iteration.
 *
 * Where a move would leave the bounds, a balanced one ends there, and a single one goes to the other side. Both
 * replicas of an iteration see the same cloths, so each cloth is built once. All cloths are traced with the same random
 * numbers, and variances are stated as if the means were independent, which is an upper limit where they are positively
 * correlated.
 *
 * The scattering parameters are not searched again at every cloth: minimising the linearised residuals over both blocks
 * at once gives the same step as variable projection (Golub and Pereyra 1973, section 2; Kaufman 1975 for the form of
 * the Jacobian used here), which removes the scattering parameters first. */
#ifndef SELVEDGE_OPTIMIZER_CLOTH_ESTIMATOR_H
#define SELVEDGE_OPTIMIZER_CLOTH_ESTIMATOR_H

#include "optimizer/fit/descent/descent.h"

enum { CLOTH_MAX_FITTED = 32, CLOTH_MAX_MOVED = 44 };

enum cloth_moves { CLOTH_MOVES_BALANCED, CLOTH_MOVES_SINGLE };

/* Gives estimates of one cloth after the other. estimate: `number` has n_number values in internal units; call->param
 * are the scattering parameters alone, and the derivatives in `out` are by these. The result must depend on its
 * arguments only. Its errors end the fit. */
struct cloth_source {
    void *context;
    size_t n_number;
    status (*estimate)(void *context, const double *number, const struct estimator_call *call,
                       const struct progress *progress, struct estimate *out, double *wall_s, struct error *err);
    /* Says whether the estimates that follow belong to a final fit (cloth_search.h), for which the source may make
     * larger tiles. NULL: it makes no difference. */
    void (*set_final)(void *context, bool final);
};

struct cloth_estimator {
    struct cloth_source source;
    size_t n_scattering; /* parameters of the scattering model */
    size_t n_configuration;
    struct coordinate coordinate[CLOTH_MAX_FITTED]; /* of the numbers, with the bounds of the fit */
    bool fixed[CLOTH_MAX_FITTED];                   /* no differences are made; their derivatives are 0 */
    bool number_derivatives;                        /* whether estimates have them; without, they trace one cloth */
    enum cloth_moves moves;
    double difference;      /* share of the range, in (0, 0.5] */
    struct estimate *moved; /* of one cloth, n_configuration, owned */
    size_t *n_path;         /* of a moved cloth, n_configuration, owned */
};

/* info, parameter: of the numbers. STATUS_INVALID for more than CLOTH_MAX_FITTED numbers; STATUS_NO_MEMORY. */
status cloth_estimator_init(struct cloth_estimator *e, const struct cloth_source *source, size_t n_scattering,
                            size_t n_configuration, const struct param_info *info,
                            const struct fit_parameter *parameter, struct error *err);
void cloth_estimator_release(struct cloth_estimator *e);
/* Cloths that an estimate with derivatives by n_free numbers traces besides the cloth itself. */
size_t cloth_estimator_n_moved(enum cloth_moves moves, size_t n_free);
/* Returns the paths of such an estimate over the paths of the cloth itself, where they are many; a moved cloth takes a
 * block of paths of each configuration at least. */
double cloth_estimator_cost(enum cloth_moves moves, size_t n_free);
/* It has n_scattering + n_number parameters and uses e, which must not move in memory. */
struct estimator cloth_estimator(struct cloth_estimator *e);

#endif
