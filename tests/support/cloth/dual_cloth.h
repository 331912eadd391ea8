/* Fibers of one model with their averages for dual scattering. Errors fail the test. */
#ifndef SELVEDGE_TESTS_DUAL_CLOTH_H
#define SELVEDGE_TESTS_DUAL_CLOTH_H

#include "geometry/fibers/fiber_set.h"
#include "renderer/quick/dual_tables.h"

struct dual_cloth {
    struct scene *scene;
    const struct scattering_model *model;
    double param[SCATTERING_MAX_PARAM];
    struct dual_tables tables;
};

/* Parameters of two_lobe.v1 in file units. */
extern const double dual_cloth_wide[9], dual_cloth_narrow[9];

/* Releases f. fraction: what fibers of isotropic.v1 scatter in every channel; two_lobe: NULL, or parameters of
 * two_lobe.v1 in its place. */
void dual_cloth_init(struct dual_cloth *c, struct fiber_set *f, double fraction, const double *two_lobe);
/* Of hand_weave_small. */
void dual_cloth_weave(struct dual_cloth *c, double fraction, const double *two_lobe);
void dual_cloth_release(struct dual_cloth *c);

#endif
