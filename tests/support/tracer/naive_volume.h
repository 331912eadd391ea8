/* A second volume tracer, deliberately naive: double precision, the volume as it is stored, optical depth added up voxel
 * by voxel, no next-event estimation, no roulette, directions drawn without looking at the model, light found by
 * chance. What the renderer must agree with. Only phase_two_lobe.v1, one channel. */
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
    double sky;                               /* the same radiance from everywhere */
    double furnace[NAIVE_VOLUME_N_TABLE + 1]; /* integral of S cos th_i over wi, by |th_o| */
};

void naive_volume_init(struct naive_volume *n, const struct direction_volume *v, const double param[12], double d_per_m,
                       bool black_sheet, double sky);
/* Radiance of one path through a random point of the crop (channel 0 of the parameters). The volume's top layer must
 * hold something, for the orbit centre lies on it. */
double naive_volume_path(const struct naive_volume *n, const struct configuration *c, struct rng *r);

#endif
