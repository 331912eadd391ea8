#include "geometry/filter/ridge_map.h"

#include <math.h>

enum { WORD = 64 };
#define J_UNIT (1.0 / 40000.0)

static size_t n_word(const struct ridge_map *m) { return (volume_n_voxel(m->n) + WORD - 1) / WORD; }

static uint64_t word_of(const struct ridge_map *m, size_t at)
{
    return atomic_load_explicit(&m->bit[at / WORD], memory_order_relaxed);
}

status ridge_map_init(struct ridge_map *m, const size_t n[3], size_t n_climb, struct scratch_space *space,
                      struct error *err)
{
    *m = (struct ridge_map){.n = {n[0], n[1], n[2]}, .n_climb = n_climb, .space = space};
    void *array = NULL;
    status s = scratch_new(space, volume_n_voxel(n) * sizeof *m->offset, "the ridges of fibers", &array, err);
    m->offset = array;
    array = NULL;
    if (s == STATUS_OK) s = scratch_new(space, n_word(m) * sizeof *m->bit, "the ridges of fibers", &array, err);
    m->bit = array;
    return s;
}

void ridge_map_release(struct ridge_map *m)
{
    scratch_release(m->space, m->offset);
    scratch_release(m->space, (void *)m->bit);
    scratch_release(m->space, m->before);
    scratch_release(m->space, m->j);
    direction_volume_release(&m->direction);
    *m = (struct ridge_map){0};
}

void ridge_map_mark(struct ridge_map *m, const size_t from[3], const size_t x[3])
{
    const size_t edge = 2 * m->n_climb + 1, at = volume_index(m->n, x[0], x[1], x[2]);
    const uint64_t bit = (uint64_t)1 << at % WORD;
    size_t code = 0;
    for (int a = 2; a >= 0; a--) code = code * edge + (x[a] + m->n_climb - from[a]);
    m->offset[volume_index(m->n, from[0], from[1], from[2])] = (uint16_t)code;
    if ((word_of(m, at) & bit) == 0) atomic_fetch_or_explicit(&m->bit[at / WORD], bit, memory_order_relaxed);
}

status ridge_map_list(struct ridge_map *m, struct error *err)
{
    static const double voxel_m[3] = {1.0, 1.0, 1.0};
    void *array = NULL;
    status s = scratch_new(m->space, n_word(m) * sizeof *m->before, "the ridges of fibers", &array, err);
    if (s != STATUS_OK) return s;
    m->before = array;
    array = NULL;
    for (size_t w = 0; w < n_word(m); w++) {
        m->before[w] = m->n_ridge;
        m->n_ridge += (size_t)__builtin_popcountll(word_of(m, w * WORD));
    }
    s = scratch_new(m->space, m->n_ridge * sizeof *m->j, "the ridges of fibers", &array, err);
    m->j = array;
    if (s != STATUS_OK) return s;
    const size_t n[3] = {m->n_ridge > 0 ? m->n_ridge : 1, 1, 1};
    return direction_volume_init_in(&m->direction, n, voxel_m, m->space, err);
}

bool ridge_map_is_ridge(const struct ridge_map *m, size_t at) { return (word_of(m, at) >> at % WORD & 1) != 0; }

size_t ridge_map_top(const struct ridge_map *m, size_t at)
{
    const size_t code = m->offset[at], climb = m->n_climb, edge = 2 * climb + 1;
    const size_t dx = code % edge, dy = code / edge % edge, dz = code / (edge * edge);
    return at + dx + dy * m->n[0] + dz * m->n[0] * m->n[1] - climb * (1 + m->n[0] + m->n[0] * m->n[1]);
}

size_t ridge_map_place(const struct ridge_map *m, size_t at)
{
    const uint64_t lower = word_of(m, at) & (((uint64_t)1 << at % WORD) - 1);
    return m->before[at / WORD] + (size_t)__builtin_popcountll(lower);
}

double ridge_map_share(const struct ridge_map *m, size_t at) { return m->j[ridge_map_place(m, at)] * J_UNIT; }

void ridge_map_set_share(struct ridge_map *m, size_t at, double share)
{
    m->j[ridge_map_place(m, at)] = (uint16_t)fmin(fmax(1.0, share / J_UNIT), 65535.0);
}
