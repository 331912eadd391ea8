#include "geometry/filter/ridge_map.h"

#include <math.h>

#define J_UNIT (1.0 / 40000.0)

struct material_job {
    struct ridge_map *m;
    const struct volume *v;
    float eps_d;
};

static void mark_material(void *context, size_t i_task, size_t i_thread)
{
    (void)i_thread;
    const struct material_job *job = context;
    const size_t n = volume_n_voxel(job->v->n), from = i_task * VOXEL_BITS_TASK;
    scratch_keep_within(job->v->space);
    for (size_t at = from; at < n && at < from + VOXEL_BITS_TASK; at++)
        if (job->v->density[at] >= job->eps_d) voxel_bits_add(&job->m->material, at);
}

status ridge_map_init(struct ridge_map *m, const struct volume *v, float eps_d, size_t n_climb,
                      struct thread_pool *pool, struct error *err)
{
    const size_t *n = v->n, n_voxel = volume_n_voxel(n);
    struct material_job job = {m, v, eps_d};
    void *offset = NULL;
    *m = (struct ridge_map){.n = {n[0], n[1], n[2]}, .n_climb = n_climb, .space = v->space};
    status s = voxel_bits_init(&m->material, n_voxel, v->space, err);
    if (s == STATUS_OK) s = voxel_bits_init(&m->ridge, n_voxel, v->space, err);
    if (s == STATUS_OK)
        s = thread_pool_run(pool, (n_voxel + VOXEL_BITS_TASK - 1) / VOXEL_BITS_TASK, mark_material, &job, NULL);
    if (s == STATUS_OK) s = voxel_bits_count(&m->material, err);
    if (s != STATUS_OK) return s;
    s = scratch_new(v->space, m->material.n_set * sizeof *m->offset, "the ridges of fibers", &offset, err);
    m->offset = offset;
    return s;
}

void ridge_map_release(struct ridge_map *m)
{
    scratch_release(m->space, m->offset);
    voxel_bits_release(&m->material);
    voxel_bits_release(&m->ridge);
    scratch_release(m->space, m->j);
    direction_volume_release(&m->direction);
    *m = (struct ridge_map){0};
}

void ridge_map_mark(struct ridge_map *m, const size_t from[3], const size_t x[3])
{
    const size_t edge = 2 * m->n_climb + 1;
    size_t code = 0;
    for (int a = 2; a >= 0; a--) code = code * edge + (x[a] + m->n_climb - from[a]);
    m->offset[voxel_bits_place(&m->material, volume_index(m->n, from[0], from[1], from[2]))] = (uint16_t)code;
    voxel_bits_add_shared(&m->ridge, volume_index(m->n, x[0], x[1], x[2]));
}

status ridge_map_list(struct ridge_map *m, struct error *err)
{
    static const double voxel_m[3] = {1.0, 1.0, 1.0};
    void *array = NULL;
    status s = voxel_bits_count(&m->ridge, err);
    if (s != STATUS_OK) return s;
    s = scratch_new(m->space, m->ridge.n_set * sizeof *m->j, "the ridges of fibers", &array, err);
    m->j = array;
    if (s != STATUS_OK) return s;
    const size_t n[3] = {m->ridge.n_set > 0 ? m->ridge.n_set : 1, 1, 1};
    return direction_volume_init_in(&m->direction, n, voxel_m, m->space, err);
}

bool ridge_map_is_ridge(const struct ridge_map *m, size_t at) { return voxel_bits_has(&m->ridge, at); }

size_t ridge_map_top(const struct ridge_map *m, size_t at)
{
    const size_t code = m->offset[voxel_bits_place(&m->material, at)], climb = m->n_climb, edge = 2 * climb + 1;
    const size_t dx = code % edge, dy = code / edge % edge, dz = code / (edge * edge);
    return at + dx + dy * m->n[0] + dz * m->n[0] * m->n[1] - climb * (1 + m->n[0] + m->n[0] * m->n[1]);
}

size_t ridge_map_place(const struct ridge_map *m, size_t at) { return voxel_bits_place(&m->ridge, at); }

double ridge_map_share(const struct ridge_map *m, size_t at) { return m->j[ridge_map_place(m, at)] * J_UNIT; }

void ridge_map_set_share(struct ridge_map *m, size_t at, double share)
{
    m->j[ridge_map_place(m, at)] = (uint16_t)fmin(fmax(1.0, share / J_UNIT), 65535.0);
}
