/* Tables of diffusion for a cloth with a pile: how much of the light that is scattered more often than paths are traced
 * comes back to the eye, from where, and from which directions. Averages over random walks through the flat cloth.
 *
 * The radiance of such light at the last traced hit is, for light L from the directions of one side of the cloth,
 *     leaving(wo) integral of R(r) / R  L(x + r, w) entering(w) pair(wo, w) |cos| / pi  dw dr,
 * equations 2.3 and 2.5 of the dissertation of Yan with these functions in place of Fresnel's transmission, and with a
 * dipole's R(r) that has the reflectance and the mean square distance of the walks.
 *
 * Directions point away from the cloth, in the frame of the flat cloth; side 0 is above, 1 below. Millimetres. */
#ifndef SELVEDGE_RENDERER_DIFFUSION_TABLES_H
#define SELVEDGE_RENDERER_DIFFUSION_TABLES_H

#include "base/thread_pool.h"
#include "renderer/quick/diffuse_dipole.h"
#include "renderer/scattering/scattering.h"
#include "renderer/scene/scene.h"

#include <stdint.h>

/* Cells of directions: equal steps of z in [-1, 1], and of the azimuth. */
enum {
    DIFFUSION_N_Z = 12,
    DIFFUSION_N_PHI = 12,
    DIFFUSION_N_DIRECTION = DIFFUSION_N_Z * DIFFUSION_N_PHI,
    DIFFUSION_N_BETWEEN = DIFFUSION_N_PHI / 2 + 1
};

struct diffusion_tables {
    size_t n_set;
    uint32_t n_traced; /* hits of a path that are traced */
    bool black_sheet;  /* under the cloth that was walked through */
    double tile_mm[2];
    float leaving[2][DIFFUSION_N_DIRECTION][3]; /* [side of the light][direction to the eye]: fraction of the light */
    float entering[DIFFUSION_N_DIRECTION][3];   /* direction to the light; its mean over a side by cosines is 1 */
    /* [z to the eye][z to the light][steps between their azimuths]: factor on the product of both, which aligned fibers
     * do not have alone: they keep the angle between light and fiber. */
    float pair[DIFFUSION_N_Z][DIFFUSION_N_Z][DIFFUSION_N_BETWEEN][3];
    struct diffuse_dipole dipole[2][3]; /* [side of the light][channel] */
    double share[2][3], share_se[2][3]; /* leaving, the mean over walks, and its standard error */
    double mean_square_mm2[2][3];
};

/* A fiber stands whose two ends differ in height by a third of the cloth's thickness or more, as ends of weft and warp
 * do not. standing (may be NULL): the fraction of what is seen of a flat cloth, from all directions of a side by their
 * cosines, that are such fibers; of the side that has more. STATUS_INVALID (field "cloth"), stating it, for a cloth
 * without a pile, where less than half stands; STATUS_NO_MEMORY. */
status diffusion_check_pile(const struct scene *flat, double *standing, struct error *err);

struct diffusion_request {
    const struct scene *scene;
    const struct scattering_model *model;
    const double *param;
    size_t n_set;
    uint32_t n_traced, n_walk;
    bool product; /* without `pair`: as published */
};
/* n_traced: at least 1. n_walk 0: 65,536, one or two seconds of a processor. param: max(n_set, 1) * model->n_param.
 * STATUS_INVALID for a model whose fibers are flat (field "model"), for a bent scene, and for a parameter (field: its
 * name); STATUS_NO_MEMORY, STATUS_CANCELLED. Whether the cloth has a pile is not asked. Nothing is to be released. */
status diffusion_tables_make(const struct diffusion_request *q, struct thread_pool *pool,
                             const struct progress *progress, struct diffusion_tables *t, struct error *err);

void diffusion_leaving_at(const struct diffusion_tables *t, size_t side, const float wo[3], float rgb[3]);
/* entering(wi) pair(wo, wi), linear between cells of one side. */
void diffusion_entering_at(const struct diffusion_tables *t, const float wo[3], const float wi[3], float rgb[3]);

/* How a radiance source renders by diffusion. */
struct diffusion_option {
    const struct diffusion_tables *tables; /* they say how many hits of a path are traced */
};

#endif
