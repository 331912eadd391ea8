#include "renderer/transport/volume/volume_scene.h"
#include "base/ranks/unique_number.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>

#define MARGIN_MM 1e-3

/* Voxels are read in random order, so large pages save misses of the address cache where the system has them. Only
 * whole pages inside the array are advised; failure does no harm. */
static void use_large_pages(void *data, size_t n_bytes)
{
    const uintptr_t page = 2u << 20;
    uintptr_t first = ((uintptr_t)data + page - 1) & ~(page - 1), last = ((uintptr_t)data + n_bytes) & ~(page - 1);
    if (last <= first) return;
    madvise((void *)first, last - first, MADV_HUGEPAGE);
}

/* One pass of the distance along an axis: out = min over k of max(k, in k bricks off). The three passes together give
 * the distance in bricks to the nearest one that holds something, the largest over the axes. */
static void spread_line(const uint8_t *in, size_t n, size_t stride, uint8_t *out)
{
    for (size_t i = 0; i < n; i++) {
        uint8_t best = in[i * stride];
        for (uint8_t k = 1; k < best; k++) {
            uint8_t low = i >= k ? in[(i - k) * stride] : VOLUME_EMPTY_MAX;
            uint8_t high = i + k < n ? in[(i + k) * stride] : VOLUME_EMPTY_MAX, near = low < high ? low : high;
            near = near > k ? near : k;
            best = near < best ? near : best;
        }
        out[i * stride] = best;
    }
}

static void spread(uint8_t *from, uint8_t *to, const size_t n[3], int axis)
{
    const size_t stride[3] = {1, n[0], n[0] * n[1]};
    int u = (axis + 1) % 3, w = (axis + 2) % 3;
    for (size_t i = 0; i < n[u]; i++)
        for (size_t j = 0; j < n[w]; j++) {
            size_t first = i * stride[u] + j * stride[w];
            spread_line(from + first, n[axis], stride[axis], to + first);
        }
}

static inline size_t brick_of(const struct volume_scene *s, size_t i, size_t j, size_t k)
{
    return ((k >> VOLUME_BRICK_SHIFT) * (size_t)s->n_brick[1] + (j >> VOLUME_BRICK_SHIFT)) * (size_t)s->n_brick[0] +
           (i >> VOLUME_BRICK_SHIFT);
}

static inline size_t place_in_brick(size_t i, size_t j, size_t k)
{
    const size_t mask = VOLUME_BRICK_EDGE - 1;
    return ((k & mask) << 2 * VOLUME_BRICK_SHIFT) | ((j & mask) << VOLUME_BRICK_SHIFT) | (i & mask);
}

static uint32_t pack(uint8_t density, const float d[3])
{
    float scale = copysignf(1, d[2]) / (fabsf(d[0]) + fabsf(d[1]) + fabsf(d[2]));
    uint32_t p = (uint32_t)(lrintf((d[0] + d[1]) * scale * 2047) + 2047),
             q = (uint32_t)(lrintf((d[0] - d[1]) * scale * 2047) + 2047);
    return (uint32_t)density << 24 | q << 12 | p;
}

/* Fills the brick table: the number of a stored brick, or minus the distance of an empty one to the nearest stored
 * one. */
static status number_bricks(struct volume_scene *s, const struct direction_volume *v, struct error *err)
{
    const size_t n[3] = {(size_t)s->n_brick[0], (size_t)s->n_brick[1], (size_t)s->n_brick[2]};
    size_t n_brick = volume_n_voxel(n);
    uint8_t *empty = malloc(n_brick), *spare = malloc(n_brick);
    status st = STATUS_OK;
    s->brick = malloc(n_brick * sizeof *s->brick);
    if (s->brick == NULL || empty == NULL || spare == NULL) {
        st = error_set(err, STATUS_NO_MEMORY, "cannot trace a volume: out of memory");
        goto out;
    }
    memset(spare, VOLUME_EMPTY_MAX, n_brick);
    for (size_t k = 0; k < v->n[2]; k++)
        for (size_t j = 0; j < v->n[1]; j++) {
            const uint8_t *row = v->density + volume_index(v->n, 0, j, k);
            uint8_t *brick = spare + brick_of(s, 0, j, k);
            for (size_t i = 0; i < v->n[0]; i++)
                if (row[i] != 0) brick[i >> VOLUME_BRICK_SHIFT] = 0;
        }
    spread(spare, empty, n, 0);
    spread(empty, spare, n, 1);
    spread(spare, empty, n, 2);
    for (size_t b = 0; b < n_brick; b++) s->brick[b] = empty[b] == 0 ? (int32_t)s->n_stored++ : -(int32_t)empty[b];
out:
    free(empty);
    free(spare);
    return st;
}

static status fill_bricks(struct volume_scene *s, const struct direction_volume *v, struct error *err)
{
    size_t n_byte = s->n_stored * VOLUME_BRICK_VOXELS * sizeof *s->voxel;
    s->voxel = aligned_alloc(64, n_byte); /* a brick starts a cache line */
    if (s->voxel == NULL)
        return error_set(err, STATUS_NO_MEMORY, "cannot trace a volume: no memory for %zu bytes of voxels", n_byte);
    use_large_pages(s->voxel, n_byte);
    memset(s->voxel, 0, n_byte);
    for (size_t k = 0; k < v->n[2]; k++)
        for (size_t j = 0; j < v->n[1]; j++)
            for (size_t i = 0; i < v->n[0]; i++) {
                size_t from = volume_index(v->n, i, j, k);
                if (v->density[from] == 0) continue;
                float d[3];
                direction_volume_get(v, from, d);
                s->voxel[(size_t)s->brick[brick_of(s, i, j, k)] * VOLUME_BRICK_VOXELS + place_in_brick(i, j, k)] =
                    pack(v->density[from], d);
            }
    return STATUS_OK;
}

/* The slab between the lowest and the highest layer that hold something. False: none does. */
static bool find_slab(struct volume_scene *s, const struct direction_volume *v)
{
    size_t layer = v->n[0] * v->n[1], low = v->n[2], high = 0;
    uint8_t most = 0;
    for (size_t k = 0; k < v->n[2]; k++) {
        uint8_t here = 0;
        for (size_t i = k * layer; i < (k + 1) * layer; i++) here = v->density[i] > here ? v->density[i] : here;
        if (here == 0) continue;
        most = here > most ? here : most;
        low = k < low ? k : low;
        high = k + 1;
    }
    s->low = (float)low;
    s->high = (float)high;
    s->largest_density = (float)most / 255;
    return most > 0;
}

/* Sets the size of an empty scene, and all that follows from it. */
static status set_size(struct volume_scene *s, const size_t n[3], const double voxel_size_m[3], struct error *err)
{
    size_t n_brick = 1;
    memset(s, 0, sizeof *s);
    for (int a = 0; a < 3; a++) {
        s->voxel_mm[a] = (float)(1e3 * voxel_size_m[a]);
        if (n[a] == 0 || n[a] > (1u << 24) || !(s->voxel_mm[a] > 0) || !isfinite(s->voxel_mm[a]))
            return error_set(err, STATUS_INVALID, "cannot trace a volume of %zu x %zu x %zu voxels", n[0], n[1], n[2]);
        s->n[a] = n[a];
        s->voxel_size_m[a] = voxel_size_m[a];
        s->n_brick[a] = (int32_t)((n[a] + VOLUME_BRICK_EDGE - 1) >> VOLUME_BRICK_SHIFT);
        if (n_brick <= INT32_MAX) n_brick *= (size_t)s->n_brick[a]; /* three factors may be more than 2^64 */
    }
    if (n_brick > INT32_MAX)
        return error_set(err, STATUS_INVALID, "cannot trace a volume of %zu x %zu x %zu voxels: too many", n[0], n[1],
                         n[2]);
    for (int a = 0; a < 2; a++) s->n_voxel[a] = (float)n[a];
    s->number = unique_number();
    return STATUS_OK;
}

status volume_scene_init(struct volume_scene *s, const struct direction_volume *v, const struct volume_scene_option *o,
                         struct error *err)
{
    status st = set_size(s, v->n, v->voxel_size_m, err);
    if (st != STATUS_OK) return st;
    if (!find_slab(s, v)) return error_set(err, STATUS_INVALID, "cannot trace a volume in which every voxel is empty");
    s->black_sheet = o->black_sheet;
    st = number_bricks(s, v, err);
    if (st == STATUS_OK) st = fill_bricks(s, v, err);
    if (st != STATUS_OK) volume_scene_release(s);
    return st;
}

status volume_scene_bend(const struct volume_scene *flat, const struct mesh *mesh, bool black_sheet,
                         struct volume_scene *bent, struct error *err)
{
    const double thickness_mm = (double)((flat->high - flat->low) * flat->voxel_mm[2]);
    *bent = *flat;
    bent->black_sheet = black_sheet;
    bent->bent = calloc(1, sizeof *bent->bent);
    if (bent->bent == NULL) {
        memset(bent, 0, sizeof *bent);
        return error_set(err, STATUS_NO_MEMORY, "cannot bend the cloth: out of memory");
    }
    return shell_space_init(&bent->bent->space, mesh, thickness_mm, MARGIN_MM, err);
}

static void release_bent(struct volume_scene *bent)
{
    shell_space_release(&bent->bent->space);
    free(bent->bent);
    memset(bent, 0, sizeof *bent);
}

void volume_scene_release(struct volume_scene *s)
{
    if (s->bent != NULL) {
        release_bent(s);
        return;
    }
    free(s->brick);
    free(s->voxel);
    s->brick = NULL;
    s->voxel = NULL;
}

/* The members of a scene besides its bricks that do not follow from its size. */
struct volume_head {
    size_t n[3], n_stored;
    double voxel_size_m[3];
    float low, high, largest_density;
    uint32_t black_sheet;
};

static size_t count_bricks(const struct volume_scene *s)
{
    const size_t n[3] = {(size_t)s->n_brick[0], (size_t)s->n_brick[1], (size_t)s->n_brick[2]};
    return volume_n_voxel(n);
}

void volume_scene_pack(const struct volume_scene *s, struct byte_pack *p)
{
    struct volume_head h = {.n_stored = s->n_stored,
                            .low = s->low,
                            .high = s->high,
                            .largest_density = s->largest_density,
                            .black_sheet = s->black_sheet};
    memcpy(h.n, s->n, sizeof h.n);
    memcpy(h.voxel_size_m, s->voxel_size_m, sizeof h.voxel_size_m);
    BYTE_PACK(p, h);
    byte_pack_put(p, s->brick, count_bricks(s) * sizeof *s->brick);
    byte_pack_put(p, s->voxel, s->n_stored * VOLUME_BRICK_VOXELS * sizeof *s->voxel);
}

/* Whether rays stay inside of the arrays. */
static bool in_range(const struct volume_scene *s)
{
    bool good = s->n_stored > 0 && s->low >= 0 && s->low < s->high && s->high <= (float)s->n[2] &&
                s->largest_density > 0 && s->largest_density <= 1;
    const size_t n_brick = count_bricks(s);
    for (size_t i = 0; good && i < n_brick; i++)
        good = s->brick[i] < 0 ? s->brick[i] >= -VOLUME_EMPTY_MAX : (size_t)s->brick[i] < s->n_stored;
    return good;
}

status volume_scene_unpack(struct byte_view *v, struct volume_scene *s, struct error *err)
{
    struct volume_head h;
    BYTE_VIEW(v, h);
    status st = set_size(s, h.n, h.voxel_size_m, err);
    if (st != STATUS_OK) return error_set(err, STATUS_FORMAT, "a volume of another rank is none");
    s->n_stored = h.n_stored;
    s->low = h.low;
    s->high = h.high;
    s->largest_density = h.largest_density;
    s->black_sheet = h.black_sheet != 0;
    s->brick = byte_view_array(v, count_bricks(s), sizeof *s->brick);
    s->voxel = byte_view_array(v, s->n_stored, VOLUME_BRICK_VOXELS * sizeof *s->voxel);
    st = byte_view_check(v, err);
    if (st == STATUS_OK && !in_range(s)) st = error_set(err, STATUS_FORMAT, "a volume of another rank is none");
    if (st != STATUS_OK) volume_scene_release(s);
    return st;
}

uint32_t volume_scene_voxel(const struct volume_scene *s, size_t i, size_t j, size_t k)
{
    int32_t brick = s->brick[brick_of(s, i, j, k)];
    return brick < 0 ? 0 : s->voxel[(size_t)brick * VOLUME_BRICK_VOXELS + place_in_brick(i, j, k)];
}

size_t volume_scene_memory_bytes(const struct volume_scene *s)
{
    return sizeof *s + count_bricks(s) * sizeof *s->brick + s->n_stored * VOLUME_BRICK_VOXELS * sizeof *s->voxel;
}

double volume_scene_thickness_mm(const struct volume_scene *s) { return (double)((s->high - s->low) * s->voxel_mm[2]); }

void volume_ray_turn(const struct volume_scene *s, const float direction[3], struct volume_ray *ray)
{
    for (int a = 0; a < 3; a++) {
        ray->direction[a] = direction[a];
        ray->per_mm[a] = direction[a] / s->voxel_mm[a];
        ray->mm_per[a] = s->voxel_mm[a] / direction[a]; /* infinite: never leaves that way */
    }
}

bool volume_ray_enter(const struct volume_scene *s, const double origin_mm[3], const double direction[3],
                      struct volume_ray *ray)
{
    if (!(direction[2] < 0) || !(origin_mm[2] >= 0)) return false;
    double t = -origin_mm[2] / direction[2];
    float d[3] = {(float)direction[0], (float)direction[1], (float)direction[2]};
    for (int a = 0; a < 2; a++) {
        double x = origin_mm[a] + t * direction[a], tile = (double)s->n_voxel[a] * (double)s->voxel_mm[a];
        ray->offset_mm[a] = floor(x / tile) * tile;
        ray->at[a] = (float)((x - ray->offset_mm[a]) / (double)s->voxel_mm[a]);
    }
    ray->at[2] = nextafterf(
        s->high, 0); /* inside: otherwise a first step that rounds to nothing would count as having crossed the slab */
    volume_ray_turn(s, d, ray);
    return true;
}

void volume_ray_position_mm(const struct volume_scene *s, const struct volume_ray *ray, float position_mm[3])
{
    for (int a = 0; a < 2; a++) position_mm[a] = (float)((double)(ray->at[a] * s->voxel_mm[a]) + ray->offset_mm[a]);
    position_mm[2] = (ray->at[2] - s->high) * s->voxel_mm[2];
}
