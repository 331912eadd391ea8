/* The holder of the glints of a scene, inside of renderer/scene. */
#ifndef SELVEDGE_RENDERER_SCENE_GLINT_DATA_H
#define SELVEDGE_RENDERER_SCENE_GLINT_DATA_H

#include "renderer/scene/scene_data.h"

bool scene_has_glints(const struct film_groups *films);
/* Holds nothing yet (scene_glints_make). NULL: out of memory. */
struct scene_glints *scene_glints_new(void);
void scene_glints_free(struct scene_glints *g);

#endif
