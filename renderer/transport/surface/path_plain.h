/* Inside of path_tracer.c. */
#ifndef SELVEDGE_RENDERER_PATH_PLAIN_H
#define SELVEDGE_RENDERER_PATH_PLAIN_H

#include "renderer/transport/surface/path_walk.h"

/* Traces a walk that has begun, whose setting is plain, and that is not recorded. */
void path_walk_plain(struct walk *w, struct scene_ray *ray);

#endif
