/* A faster loop for plain walks, which path_tracer.c calls. */
#ifndef SELVEDGE_RENDERER_PATH_PLAIN_H
#define SELVEDGE_RENDERER_PATH_PLAIN_H

#include "renderer/transport/surface/path_walk.h"

/* Traces a walk that walk_start has prepared to its end. To be called only where path_setting.plain is true and the
 * path is not recorded. */
void path_walk_plain(struct walk *w, struct scene_ray *ray);

#endif
