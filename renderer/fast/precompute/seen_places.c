#include "renderer/fast/precompute/seen_places.h"
#include "base/rng.h"
#include "renderer/scene/scene_place.h"

#include <math.h>
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
    double tile_mm[2];
    rng_start(&rng, &key, i, 0);
    scene_tile_mm(s, tile_mm);
    double u = rng_double(&rng), r = sqrt(u), phi = 2.0 * M_PI * rng_double(&rng);
    bool below = !scene_has_black_sheet(s) && i % 2 == 1;
    double z = sqrt(1.0 - u) + 1e-6, side = below ? -1.0 : 1.0;
    const double d[3] = {r * cos(phi), r * sin(phi), -side * z};
    double start[3] = {tile_mm[0] * rng_double(&rng), tile_mm[1] * rng_double(&rng),
                       below ? -scene_thickness_mm(s) - 0.01 : 0.01};
    struct scene_ray ray;
    out->met = scene_ray_enter(s, start, d, &ray) && scene_trace(s, &ray, &out->hit);
    if (!out->met) return;
    struct scene_place place;
    scene_place_of(s, &out->hit, ray.offset_mm, &place);
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
