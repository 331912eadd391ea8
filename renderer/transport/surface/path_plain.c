/* Walks of plain settings. */
#define PATH_PLAIN 1
#include "renderer/transport/surface/path_plain.h"

#include "renderer/transport/surface/path_steps.h"

void path_walk_plain(struct walk *w, struct scene_ray *ray) { walk_on(w, ray, NULL); }
