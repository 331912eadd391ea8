/* The order in which the paths of an estimate are traced. Paths that begin near each other meet the same fibers, whose
 * data are then in the cache: so it goes from one corner of the tile to another. Values are the same in any order.
 */
#ifndef SELVEDGE_RENDERER_PATH_ORDER_H
#define SELVEDGE_RENDERER_PATH_ORDER_H

#include "renderer/scene/scene.h"
#include "renderer/transport/camera.h"

/* order[n_path]: each path through a point xy of the crop once, along a Morton curve over the tile. At most
 * RADIANCE_MOST_PATHS. */
void path_order_fill(const struct camera *camera, const struct scene *scene, size_t n_path, double (*xy)[2],
                     uint32_t *order);

#endif
