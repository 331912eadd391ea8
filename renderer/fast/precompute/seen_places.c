#include "renderer/fast/precompute/seen_places.h"
#include "renderer/scene/scene_place.h"
#include "renderer/transport/surface/fiber_walk.h"

#include <stdlib.h>
#include <string.h>

enum { N_RAY = 1 << 19, TASK_RAYS = 4096 };
static const struct rng_key key = {.seed = 0x7365656e706c6163u};

struct find_job {
    const struct scene *scene;
    struct seen_place *place;
};

static void find_one(const struct scene *s, uint32_t i, struct seen_place *out)
{
    struct rng rng;
    struct scene_ray ray;
    rng_start(&rng, &key, i, 0);
    bool below = !scene_has_black_sheet(s) && i % 2 == 1;
    out->met = fiber_walk_enter(s, below, &rng, &ray) && scene_trace(s, &ray, &out->hit);
    if (!out->met) return;
    struct scene_place place;
    scene_place_find(s, &out->hit, ray.offset_mm, &place);
    memcpy(out->position_mm, place.position_mm, sizeof out->position_mm);
}

static void run_task(void *context, size_t i_task, size_t i_thread)
{
    (void)i_thread;
    const struct find_job *f = context;
    for (size_t i = i_task * TASK_RAYS; i < (i_task + 1) * TASK_RAYS; i++)
        find_one(f->scene, (uint32_t)i, &f->place[i]);
}

status seen_places_find(const struct scene *flat, struct thread_pool *pool, const struct progress *progress,
                        struct seen_places *seen, struct error *err)
{
    struct progress silent = progress_silent(progress);
    *seen = (struct seen_places){.place = malloc(N_RAY * sizeof *seen->place)};
    if (seen->place == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot make tables: out of memory");
    struct find_job f = {flat, seen->place};
    status s = thread_pool_run(pool, N_RAY / TASK_RAYS, run_task, &f, &silent);
    if (s != STATUS_OK) return error_set(err, s, "cancelled");
    for (size_t i = 0; i < N_RAY; i++)
        if (seen->place[i].met) seen->place[seen->n++] = seen->place[i];
    return seen->n > 0 ? STATUS_OK
                       : error_set(err, STATUS_INVALID, "cannot make tables: no ray from outside meets a fiber");
}

void seen_places_release(struct seen_places *seen)
{
    free(seen->place);
    *seen = (struct seen_places){0};
}
