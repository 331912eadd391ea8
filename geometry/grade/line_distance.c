#include "geometry/grade/line_distance.h"

#include <math.h>
#include <string.h>

enum { SLAB = 16 }; /* slices of a task */

struct distance_job {
    const struct volume *v;
    const struct fiber_set *f;
    const uint8_t *kind;
    uint8_t *code;
};

/* A segment of a fiber, in voxels. */
struct capsule {
    float a[3], u[3], length2, radius, stretch; /* stretch: long half axis over radius */
    float long_axis[3];
    uint8_t kind;
};

/* Distance of a point from the surface. rest: from the nearest point of the axis. */
static float surface_distance(const struct capsule *c, const float rest[3])
{
    const float away2 = rest[0] * rest[0] + rest[1] * rest[1] + rest[2] * rest[2], away = sqrtf(away2);
    if (c->stretch <= 1.0f || away2 <= 0.0f) return away - c->radius;
    const float along = rest[0] * c->long_axis[0] + rest[1] * c->long_axis[1] + rest[2] * c->long_axis[2];
    const float across2 = fmaxf(0.0f, away2 - along * along);
    const float as_disc = sqrtf(along * along / (c->stretch * c->stretch) + across2 * c->stretch * c->stretch);
    return (as_disc - c->radius) * away / as_disc;
}

static void enter(const struct capsule *c, float distance, uint8_t *code)
{
    const float units = floorf(distance * LINE_PER_VOXEL);
    const uint8_t found = distance <= 0.0f ? (uint8_t)(LINE_INSIDE + c->kind)
                                           : (uint8_t)(LINE_OUTSIDE + fminf(units, LINE_FAR - LINE_OUTSIDE));
    if (found < *code) *code = found;
}

/* Enters a capsule in the slices from .. end - 1. */
static void enter_capsule(const struct capsule *c, const size_t n[3], size_t from, size_t end, uint8_t *code)
{
    const float reach = c->radius * c->stretch + (float)(LINE_FAR - LINE_OUTSIDE) / LINE_PER_VOXEL;
    size_t low[3], high[3];
    for (int x = 0; x < 3; x++) {
        const float first = floorf(c->a[x] + fminf(0.0f, c->u[x]) - reach),
                    last = ceilf(c->a[x] + fmaxf(0.0f, c->u[x]) + reach);
        low[x] = (size_t)fminf(fmaxf(first, 0.0f), (float)n[x]);
        high[x] = (size_t)fminf(fmaxf(last, 0.0f), (float)n[x]);
    }
    low[2] = low[2] < from ? from : low[2];
    high[2] = high[2] > end ? end : high[2];
    for (size_t k = low[2]; k < high[2]; k++)
        for (size_t j = low[1]; j < high[1]; j++)
            for (size_t i = low[0]; i < high[0]; i++) {
                uint8_t *to = &code[volume_index(n, i, j, k)];
                float rest[3] = {(float)i + 0.5f - c->a[0], (float)j + 0.5f - c->a[1], (float)k + 0.5f - c->a[2]};
                const float dot = rest[0] * c->u[0] + rest[1] * c->u[1] + rest[2] * c->u[2];
                const float t = c->length2 > 0.0f ? fminf(fmaxf(dot / c->length2, 0.0f), 1.0f) : 0.0f;
                for (int x = 0; x < 3; x++) rest[x] -= t * c->u[x];
                enter(c, surface_distance(c, rest), to);
            }
}

/* The segment that begins at vertex k of fiber i. */
static struct capsule capsule_of(const struct distance_job *j, size_t i, size_t k)
{
    const struct fiber_set *f = j->f;
    struct capsule c = {.kind = j->kind[i], .stretch = 1.0f};
    for (size_t x = 0; x < 3; x++) {
        const float per_m = (float)(1.0 / j->v->voxel_size_m[x]);
        c.a[x] = f->position_m[3 * k + x] * per_m;
        c.u[x] = f->position_m[3 * k + 3 + x] * per_m - c.a[x];
        c.length2 += c.u[x] * c.u[x];
    }
    c.radius = fiber_radius_m(f, i, k) / (float)j->v->voxel_size_m[0];
    if (f->shape != NULL && fiber_shape_has_section(&f->shape[k])) {
        c.stretch = sqrtf(f->shape[k].ratio);
        memcpy(c.long_axis, f->shape[k].long_axis, sizeof c.long_axis);
    }
    return c;
}

static void map_slab(void *context, size_t i_task, size_t i_thread)
{
    const struct distance_job *j = context;
    const size_t *n = j->v->n, from = i_task * SLAB, end = from + SLAB < n[2] ? from + SLAB : n[2];
    (void)i_thread;
    memset(j->code + volume_index(n, 0, 0, from), LINE_FAR, (end - from) * n[0] * n[1]);
    for (size_t i = 0; i < j->f->n_fiber; i++)
        for (size_t k = j->f->first_vertex[i]; k + 1 < j->f->first_vertex[i + 1]; k++) {
            const struct capsule c = capsule_of(j, i, k);
            const float reach = c.radius * c.stretch + (float)LINE_FAR / LINE_PER_VOXEL;
            if (fmaxf(c.a[2], c.a[2] + c.u[2]) + reach < (float)from) continue;
            if (fminf(c.a[2], c.a[2] + c.u[2]) - reach > (float)end) continue;
            enter_capsule(&c, n, from, end, j->code);
        }
    scratch_keep_within(j->v->space);
}

status line_distance_map(const struct volume *v, const struct fiber_set *f, const uint8_t *kind,
                         struct thread_pool *pool, uint8_t *code, struct error *err)
{
    struct distance_job j = {v, f, kind, code};
    status s = thread_pool_run(pool, (v->n[2] + SLAB - 1) / SLAB, map_slab, &j, NULL);
    if (s != STATUS_OK) return error_set(err, s, "grading the scan was cancelled");
    for (size_t r = 0; r < v->unknown.n; r++)
        memset(code + v->unknown.run[r].first, LINE_UNKNOWN, v->unknown.run[r].end - v->unknown.run[r].first);
    return STATUS_OK;
}
