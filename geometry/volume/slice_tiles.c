#include "geometry/volume/slice_tiles.h"
#include "base/files/durable.h"

#include <endian.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <zlib.h>

enum { HEADER_BYTES = 64, VERSION = 1, MOST_SLICES_AT_ONCE = 64, MOST_LEVEL = 24 };

/* One slice as compressed tiles of all levels, one after the other. */
struct packed_slice {
    uint8_t *bytes;
    size_t n_byte;
    status failed;
};

struct tile_job {
    const struct slice_codes *codes;
    int axis;
    size_t width, height, n_slice;
    size_t n_level, tiles_of_level[MOST_LEVEL], tiles_of_slice;
    size_t first, n; /* the slices that are worked on */
    uint8_t *plane;  /* of each of them densities and directions */
    struct packed_slice packed[MOST_SLICES_AT_ONCE];
    uint32_t *length; /* of every tile of the file, bytes */
    const char *name;
};

static size_t tiles_along(size_t edge) { return (edge + SLICE_TILE_EDGE - 1) / SLICE_TILE_EDGE; }

static void choose_levels(struct tile_job *j)
{
    size_t w = j->width, h = j->height;
    for (j->n_level = 0;; w = (w + 1) / 2, h = (h + 1) / 2) {
        j->tiles_of_level[j->n_level] = tiles_along(w) * tiles_along(h);
        j->tiles_of_slice += j->tiles_of_level[j->n_level++];
        if (w <= SLICE_TILE_EDGE && h <= SLICE_TILE_EDGE) return;
    }
}

/* Copies layer i_task of the scan into the slices that are worked on. */
static void gather(void *context, size_t i_task, size_t i_thread)
{
    const struct tile_job *j = context;
    const size_t *n = j->codes->n, area = j->width * j->height;
    (void)i_thread;
    scratch_keep_within(j->codes->space);
    for (int part = 0; part < 2; part++) {
        const uint8_t *from = part == 0 ? j->codes->density : j->codes->direction;
        uint8_t *to = j->plane + (part == 0 ? 0 : area);
        if (j->axis == 2) memcpy(to + 2 * area * i_task, from + volume_index(n, 0, 0, j->first + i_task), area);
        for (size_t i = 0; j->axis == 1 && i < j->n; i++)
            memcpy(to + 2 * area * i + i_task * n[0], from + volume_index(n, 0, j->first + i, i_task), n[0]);
        for (size_t y = 0; j->axis == 0 && y < n[1]; y++)
            for (size_t i = 0; i < j->n; i++)
                to[2 * area * i + i_task * n[1] + y] = from[volume_index(n, j->first + i, y, i_task)];
    }
}

/* Appends the tile whose corner is at x, y as one zlib stream: its densities, then its directions. */
static status pack_tile(struct packed_slice *to, size_t *capacity, const uint8_t *const plane[2], const size_t size[2],
                        const size_t corner[2], uint32_t *length)
{
    size_t w = size[0] - corner[0] < SLICE_TILE_EDGE ? size[0] - corner[0] : SLICE_TILE_EDGE;
    size_t h = size[1] - corner[1] < SLICE_TILE_EDGE ? size[1] - corner[1] : SLICE_TILE_EDGE;
    z_stream z = {0};
    /* runs of void and of directions are all that repeats in noise, so searching for more would only take time */
    if (deflateInit2(&z, 1, Z_DEFLATED, 15, 9, Z_RLE) != Z_OK) return STATUS_NO_MEMORY;
    size_t most = deflateBound(&z, 2 * w * h), wanted = to->n_byte + most;
    if (wanted > *capacity) {
        uint8_t *larger = realloc(to->bytes, 2 * wanted);
        if (larger == NULL) {
            deflateEnd(&z);
            return STATUS_NO_MEMORY;
        }
        to->bytes = larger;
        *capacity = 2 * wanted;
    }
    z.next_out = to->bytes + to->n_byte;
    z.avail_out = (uInt)most;
    for (size_t row = 0; row < 2 * h; row++) {
        z.next_in = (z_const Bytef *)plane[row / h] + (corner[1] + row % h) * size[0] + corner[0];
        z.avail_in = (uInt)w;
        deflate(&z, row + 1 < 2 * h ? Z_NO_FLUSH : Z_FINISH);
    }
    *length = (uint32_t)z.total_out;
    to->n_byte += z.total_out;
    deflateEnd(&z);
    return STATUS_OK;
}

/* Packs one slice; it halves the planes in place. */
static void pack(void *context, size_t i_task, size_t i_thread)
{
    struct tile_job *j = context;
    const size_t area = j->width * j->height;
    uint8_t *density = j->plane + 2 * area * i_task, *direction = density + area;
    struct packed_slice *to = &j->packed[i_task];
    uint32_t *length = j->length + (j->first + i_task) * j->tiles_of_slice;
    size_t capacity = 0, size[2] = {j->width, j->height}, corner[2];
    (void)i_thread;
    *to = (struct packed_slice){.failed = STATUS_OK};
    for (size_t level = 0; level < j->n_level; level++) {
        const uint8_t *const plane[2] = {density, direction};
        for (corner[1] = 0; corner[1] < size[1]; corner[1] += SLICE_TILE_EDGE)
            for (corner[0] = 0; corner[0] < size[0] && to->failed == STATUS_OK; corner[0] += SLICE_TILE_EDGE)
                to->failed = pack_tile(to, &capacity, plane, size, corner, length++);
        if (level + 1 == j->n_level) break;
        slice_codes_halve(density, direction, size[0], size[1], density, direction);
        for (int a = 0; a < 2; a++) size[a] = (size[a] + 1) / 2;
    }
}

static void put_u32(uint8_t *p, size_t x)
{
    uint32_t little = htole32((uint32_t)x);
    memcpy(p, &little, 4);
}

static void put_f32(uint8_t *p, double x)
{
    float value = (float)x;
    uint32_t bits;
    memcpy(&bits, &value, 4);
    put_u32(p, bits);
}

static status put_head(const struct tile_job *j, FILE *file, struct error *err)
{
    const struct slice_codes *c = j->codes;
    const int along[3] = {j->axis == 0 ? 1 : 0, j->axis == 2 ? 1 : 2, j->axis};
    const size_t n_tile = j->n_slice * j->tiles_of_slice;
    uint8_t head[HEADER_BYTES] = "SELVSLIC";
    const size_t number[8] = {VERSION,    (size_t)j->axis, j->width,   j->height,
                              j->n_slice, SLICE_TILE_EDGE, j->n_level, c->factor};
    for (size_t i = 0; i < 8; i++) put_u32(head + 8 + 4 * i, number[i]);
    for (size_t i = 0; i < 3; i++) put_f32(head + 40 + 4 * i, 1e6 * c->voxel_size_m[along[i]]);
    put_u32(head + 52, SLICE_DENSITY_STEPS);
    put_u32(head + 56, SLICE_DIRECTION_STEPS);
    for (size_t i = 0; i < n_tile; i++) j->length[i] = htole32(j->length[i]);
    if (fseeko(file, 0, SEEK_SET) != 0 || fwrite(head, 1, sizeof head, file) != sizeof head ||
        fwrite(j->length, 4, n_tile, file) != n_tile)
        return error_set_errno(err, "cannot write '%s'", j->name);
    return STATUS_OK;
}

/* Packs the slices first .. first + n and appends them to the file. */
static status put_slices(struct tile_job *j, struct thread_pool *pool, const struct progress *progress, FILE *file,
                         struct error *err)
{
    const struct progress silent = progress_silent(progress);
    status s = thread_pool_run(pool, j->axis == 2 ? j->n : j->codes->n[2], gather, j, &silent);
    for (size_t i = 0; i < j->n; i++) j->packed[i] = (struct packed_slice){0};
    if (s == STATUS_OK) s = thread_pool_run(pool, j->n, pack, j, &silent);
    if (s != STATUS_OK) error_set(err, s, "writing '%s' was cancelled", j->name);
    for (size_t i = 0; i < j->n; i++) {
        const struct packed_slice *p = &j->packed[i];
        if (s == STATUS_OK && p->failed != STATUS_OK)
            s = error_set(err, p->failed, "cannot write '%s': out of memory", j->name);
        if (s == STATUS_OK && fwrite(p->bytes, 1, p->n_byte, file) != p->n_byte)
            s = error_set_errno(err, "cannot write '%s'", j->name);
        free(p->bytes);
    }
    return s;
}

static status put_all(struct tile_job *j, struct thread_pool *pool, const struct progress *progress, FILE *file,
                      struct error *err)
{
    const size_t n_tile = j->n_slice * j->tiles_of_slice, slice_bytes = 2 * j->width * j->height;
    size_t at_once = scratch_buffer_bytes(j->codes->space) / slice_bytes;
    at_once = at_once < 1 ? 1 : at_once > MOST_SLICES_AT_ONCE ? MOST_SLICES_AT_ONCE : at_once;
    j->length = calloc(n_tile, sizeof *j->length);
    j->plane = malloc(at_once * slice_bytes);
    status s = STATUS_OK;
    if (j->length == NULL || j->plane == NULL)
        s = error_set(err, STATUS_NO_MEMORY, "cannot write '%s': out of memory", j->name);
    if (s == STATUS_OK && fseeko(file, (off_t)(HEADER_BYTES + 4 * n_tile), SEEK_SET) != 0)
        s = error_set_errno(err, "cannot write '%s'", j->name);
    for (j->first = 0; j->first < j->n_slice && s == STATUS_OK; j->first += j->n) {
        j->n = j->n_slice - j->first < at_once ? j->n_slice - j->first : at_once;
        s = put_slices(j, pool, progress, file, err);
        progress_report(progress, (double)(j->first + j->n) / (double)j->n_slice);
    }
    if (s == STATUS_OK) s = put_head(j, file, err);
    free(j->length);
    free(j->plane);
    return s;
}

status slice_tiles_write(const struct slice_codes *codes, int axis, struct thread_pool *pool,
                         const struct progress *progress, const char *path, struct error *err)
{
    struct tile_job j = {.codes = codes, .axis = axis, .name = path_file_name(path)};
    j.width = codes->n[axis == 0 ? 1 : 0];
    j.height = codes->n[axis == 2 ? 1 : 2];
    j.n_slice = codes->n[axis];
    choose_levels(&j);
    FILE *file = fopen(path, "wbe");
    if (file == NULL) return error_set_errno(err, "cannot write '%s'", j.name);
    status s = put_all(&j, pool, progress, file, err);
    if (fclose(file) != 0 && s == STATUS_OK) s = error_set_errno(err, "cannot write '%s'", j.name);
    return s;
}
