/* Fibers with rough surfaces of their own, whose light the boundary-element solver computes. Speckle tables are fitted
 * to them.
 *
 * An instance has the outline of a section of wave_table.h, its size with a deviation of 10 %, a rough surface,
 * and one orientation. Its light is the light in a channel: the mean over both polarisations and over wavelengths of
 * +-4 %. Divided by the mean over all instances, it is f. Its correlation at two pairs of directions across the fiber
 * is looked at by their distance, the change of wi + wo times radius over wavelength, in the mean over directions,
 * weighted by the light that goes there. There are pairs between which the camera moves, and beyond 45 degrees from
 * straight on pairs between which the fiber turns. Nearer to straight on, a turn changes wi + wo by little, and the
 * light by more.
 */
#ifndef SELVEDGE_RENDERER_SPECKLE_INSTANCES_H
#define SELVEDGE_RENDERER_SPECKLE_INSTANCES_H

#include "base/status.h"
#include "base/thread_pool.h"
#include "renderer/scattering/models/wave/wave_table.h"

enum { SPECKLE_N_DISTANCE = 25, SPECKLE_N_ZONE = 4, SPECKLE_N_LENGTH = 40 };

#define SPECKLE_DISTANCE_STEP 0.1

/* Standard deviation and correlation length of the height. They stand for no measurement: a slope of 4 degrees turns
 * reflected light by 8 degrees, the start of gamma in the models. */
#define SPECKLE_HEIGHT_M 50e-9
#define SPECKLE_LENGTH_M 1e-6

struct speckle_statistics {
    double correlation[SPECKLE_N_DISTANCE]; /* at SPECKLE_DISTANCE_STEP times the index; the first is 1 */
    /* By the angle from straight on, to 45, 90, 135 and 180 degrees: variance of f, and share of the light. */
    double zone_contrast2[SPECKLE_N_ZONE], zone_share[SPECKLE_N_ZONE];
    double by_length[SPECKLE_N_LENGTH]; /* share of green light by |wi + wo|, from 0 to 2 */
    double between_channels[2];         /* correlation of red with green and of green with blue */
    /* Correlation at equal half vectors, where light and camera turn by 2 degrees in opposite senses, and where the
     * fiber turns by 2 degrees below both; beyond 45 degrees from straight on. */
    double memory, turned;
};

/* Errors of wave_solver.h; STATUS_NO_MEMORY. */
status speckle_instances(const struct wave_section *section, struct thread_pool *pool, struct speckle_statistics *out,
                         struct error *err);

#endif
