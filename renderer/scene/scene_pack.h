/* A flat scene as bytes, from which another process with the same program and a like processor builds the same scene:
 * its rays hit the same fibers at the same bits. */
#ifndef SELVEDGE_RENDERER_SCENE_PACK_H
#define SELVEDGE_RENDERER_SCENE_PACK_H

#include "base/ranks/byte_pack.h"
#include "renderer/scene/scene.h"

#include <stdint.h>

/* A number that no other scene of this process has had. */
uint64_t scene_number(const struct scene *scene);
/* Version of the Embree that this process runs with, as 10000 major + 100 minor + patch; 0 when it does not start. */
unsigned scene_engine_version(void);
/* scene: not bent. */
void scene_pack(const struct scene *scene, struct byte_pack *pack);
/* STATUS_FORMAT, STATUS_NO_MEMORY, and what scene_new gives. */
status scene_unpack(struct byte_view *view, struct scene **scene, struct error *err);

#endif
