/* Places of the fibers that are seen from outside of a flat cloth: hits of rays from all directions above and, without
 * a black sheet, below, whose density goes with the cosine to the normal. */
#ifndef SELVEDGE_RENDERER_SEEN_PLACES_H
#define SELVEDGE_RENDERER_SEEN_PLACES_H

#include "base/thread_pool.h"
#include "renderer/scene/scene_ray.h"

struct seen_place {
    struct scene_hit hit;
    float position_mm[3]; /* within the tile */
    bool met;
};

struct seen_places {
    struct seen_place *place; /* n, all met */
    size_t n;
};

/* STATUS_INVALID: no ray met a fiber; STATUS_NO_MEMORY, STATUS_CANCELLED. */
status seen_places_find(const struct scene *flat, struct thread_pool *pool, const struct progress *progress,
                        struct seen_places *seen, struct error *err);
void seen_places_release(struct seen_places *seen);

#endif
