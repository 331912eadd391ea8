#include "geometry/grade/line_distance.h"

#include "base/lanes.h"

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

/* Enters a capsule in a row of n voxels, the first of which lies at x from its end a. */
static void enter_row(const struct capsule *c, const float x[3], size_t n, uint8_t *code)
{
    static const lanes STEP = {0.0f, 1.0f, 2.0f, 3.0f, 4.0f, 5.0f, 6.0f, 7.0f};
    const lanes zero = {0.0f}, one = zero + 1.0f, most = zero + (LINE_FAR - LINE_OUTSIDE), least = zero + 1e-6f;
    const float inverse2 = c->length2 > 0.0f ? 1.0f / c->length2 : 0.0f;
    const float wide2 = c->stretch * c->stretch, narrow2 = 1.0f / wide2;
    const float ahead = x[1] * c->u[1] + x[2] * c->u[2];
    for (size_t i = 0; i < n; i += LANES) {
        const lanes dx = x[0] + (STEP + (float)(int)i);
        lanes t = (dx * c->u[0] + ahead) * inverse2;
        t = lanes_choose(t < zero, zero, t);
        t = lanes_choose(t > one, one, t);
        const lanes rx = dx - t * c->u[0], ry = x[1] - t * c->u[1], rz = x[2] - t * c->u[2];
        const lanes away2 = rx * rx + ry * ry + rz * rz;
        const lanes along = rx * c->long_axis[0] + ry * c->long_axis[1] + rz * c->long_axis[2];
        const lanes rest2 = away2 - along * along, across2 = lanes_choose(rest2 > zero, rest2, zero);
        lanes as_disc = lanes_sqrt(along * along * narrow2 + across2 * wide2);
        as_disc = lanes_choose(as_disc > least, as_disc, least);
        const lanes distance = (as_disc - c->radius) * lanes_sqrt(away2) / as_disc;
        lanes units = distance * (float)LINE_PER_VOXEL;
        units = lanes_choose(units < most, units, most);
        const lane_mask whole = __builtin_convertvector(units, lane_mask) + LINE_OUTSIDE, in = distance <= zero;
        const lane_mask found = (whole & ~in) | (in & (LINE_INSIDE + c->kind));
        for (size_t l = 0; l < LANES && i + l < n; l++)
            code[i + l] = found[l] < code[i + l] ? (uint8_t)found[l] : code[i + l];
    }
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
        for (size_t j = low[1]; j < high[1] && low[0] < high[0]; j++) {
            const float x[3] = {(float)low[0] + 0.5f - c->a[0], (float)j + 0.5f - c->a[1], (float)k + 0.5f - c->a[2]};
            enter_row(c, x, high[0] - low[0], &code[volume_index(n, low[0], j, k)]);
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
