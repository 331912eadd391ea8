/* A volume of fibers laid on a mesh: the same shell map as for fibers (renderer/scene/bent/shell.h). Nothing of the
 * volume is copied. Optical depth is measured in the flat cloth, so that a stretched cloth is as dense as the flat one.
 */
#ifndef SELVEDGE_RENDERER_VOLUME_BENT_H
#define SELVEDGE_RENDERER_VOLUME_BENT_H

#include "geometry/mesh/mesh.h"
#include "renderer/scene/bent/shell_walk.h"
#include "renderer/transport/volume/volume_tracer.h"

struct volume_bent {
    struct shell_space space;
};

/* bent: like flat, which must outlive it, on the mesh; its origin is the orbit centre. black_sheet: one lies under all
 * of it. Errors as scene_bend (renderer/scene/scene.h). volume_scene_release in any case. */
status volume_scene_bend(const struct volume_scene *flat, const struct mesh *mesh, bool black_sheet,
                         struct volume_scene *bent, struct error *err);
void volume_bent_release(struct volume_scene *bent);

/* The radiance of one path from a point outside of the shell; no derivatives. */
void volume_bent_trace(const struct volume_setting *s, const double origin_mm[3], const double direction[3],
                       struct rng *rng, struct volume_result *out);

#endif
