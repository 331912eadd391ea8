/* A second volume tracer that the renderer must agree with. It is deliberately slow and simple: it uses double
 * precision, reads the volume as it is stored, adds up optical depth voxel by voxel, has no next-event estimation and
 * no roulette, draws directions independently of the model, and finds the light by chance. It supports
 * phase_two_lobe.v1 in one channel. */
#ifndef SELVEDGE_TESTS_NAIVE_VOLUME_H
#define SELVEDGE_TESTS_NAIVE_VOLUME_H

#include "base/rng.h"
#include "geometry/volume/volume.h"
#include "renderer/scene/configuration.h"

#include <stdbool.h>

enum { NAIVE_VOLUME_N_TABLE = 90 };

struct naive_volume {
    const struct direction_volume *v;
    double param[12], d_per_m;
    bool black_sheet;
    double sky;                               /* radiance of a uniform environment */
    double furnace[NAIVE_VOLUME_N_TABLE + 1]; /* integral of S cos th_i over wi, by |th_o| */
};

void naive_volume_init(struct naive_volume *n, const struct direction_volume *v, const double param[12], double d_per_m,
                       bool black_sheet, double sky);
/* Radiance of one path through a random point of the crop (channel 0 of the parameters). The top layer of the volume
 * must not be empty, because the orbit centre lies on it. */
double naive_volume_path(const struct naive_volume *n, const struct configuration *c, struct rng *r);

#endif
