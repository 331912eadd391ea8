/* A bent cloth inside of struct scene, for the files of renderer/scene: it is a copy of the flat scene's struct, with
 * the shell. Its rays are in the space of the mesh: their offsets stay 0, and i_cell is the cell that the origin
 * lies in or near, SHELL_OUTSIDE for a ray that has not reached the shell yet, and SHELL_ON_SHEET for one that has
 * ended on the black sheet.
 */
#ifndef SELVEDGE_RENDERER_BENT_SCENE_H
#define SELVEDGE_RENDERER_BENT_SCENE_H

#include "renderer/mesh/shell_walk.h"
#include "renderer/scene/scene_data.h"
#include "renderer/scene/scene_visitor.h"

struct bent_cloth {
    struct scene flat; /* a copy: the flat scene itself belongs to the caller */
    struct shell_space space;
};

bool bent_trace(const struct scene *s, struct scene_ray *ray, struct scene_hit *hit);
/* visitor: as for scene_occluded_span. True also for a ray that ends on the black sheet. */
bool bent_occluded(const struct scene *s, const struct scene_ray *ray, struct scene_visitor *visitor);
bool bent_enter(const struct scene *s, const double origin_mm[3], const double direction[3], struct scene_ray *ray);
void bent_free(struct scene *s);
size_t bent_memory_bytes(const struct scene *s);

#endif
