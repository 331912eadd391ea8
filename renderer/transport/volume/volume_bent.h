/* A volume of fibers laid on a mesh: the same shell map as for fibers (renderer/mesh/shell.h). Nothing of the
 * volume is copied. Optical depth is measured in the flat cloth, so that a stretched cloth is as dense as the flat one.
 */
#ifndef SELVEDGE_RENDERER_VOLUME_BENT_H
#define SELVEDGE_RENDERER_VOLUME_BENT_H

#include "renderer/transport/volume/volume_tracer.h"

/* The radiance of one path from a point outside of the shell; no derivatives. */
void volume_bent_trace(const struct volume_setting *s, const double origin_mm[3], const double direction[3],
                       struct rng *rng, struct volume_result *out);

#endif
