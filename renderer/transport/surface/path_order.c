#include "renderer/transport/surface/path_order.h"

#include "renderer/transport/radiance_tracer.h"

#include <math.h>
#include <stdlib.h>

/* Puts the lower 16 bits of x at the even places. */
static uint32_t spread(uint32_t x)
{
    x = (x | x << 8) & 0x00ff00ff;
    x = (x | x << 4) & 0x0f0f0f0f;
    x = (x | x << 2) & 0x33333333;
    return (x | x << 1) & 0x55555555;
}

/* The number of the place in the tile where a ray begins: places of one quarter of the tile come one after the other,
 * and so within each quarter. 0 for rays that do not meet the cloth. */
static uint32_t number_of(const struct camera *camera, const struct scene *scene, const double tile_mm[2],
                          const double xy[2])
{
    struct scene_ray ray;
    uint32_t at[2];
    if (!camera_ray(camera, scene, xy, &ray)) return 0;
    for (int a = 0; a < 2; a++) {
        const double place = (double)ray.origin_mm[a] / tile_mm[a];
        at[a] = (uint32_t)(fmin(place - floor(place), 0x1.ffffp-1) * 0x1p16);
    }
    return spread(at[0]) | spread(at[1]) << 1;
}

static int compare(const void *a, const void *b)
{
    const uint64_t x = *(const uint64_t *)a, y = *(const uint64_t *)b;
    return (x > y) - (x < y);
}

void path_order_fill(const struct camera *camera, const struct scene *scene, size_t n_path, double (*xy)[2],
                     uint32_t *order)
{
    uint64_t key[RADIANCE_MOST_PATHS];
    double tile_mm[2];
    scene_tile_mm(scene, tile_mm);
    for (size_t i = 0; i < n_path; i++) key[i] = (uint64_t)number_of(camera, scene, tile_mm, xy[i]) << 32 | i;
    qsort(key, n_path, sizeof *key, compare);
    for (size_t i = 0; i < n_path; i++) order[i] = (uint32_t)key[i];
}
