/* Hair of Mitsuba 0.6 as binary: "BINARY_HAIR", u32 number of vertices, then f32 x y z of each; one infinite number
 * goes before the first vertex of every fiber (src/shapes/hair.cpp). All are little-endian. */
#include "base/files/durable.h"
#include "geometry/fibers/fiber_import.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

enum { MAGIC_BYTES = 11, HEADER_BYTES = 15, NUMBER_BYTES = 4, POINT_BYTES = 12 };

struct mitsuba_file {
    const char *name;
    const uint8_t *number; /* n of them, four bytes each */
    size_t n, n_vertex;
};

static uint32_t get_u32(const uint8_t *b)
{
    return (uint32_t)b[0] | (uint32_t)b[1] << 8 | (uint32_t)b[2] << 16 | (uint32_t)b[3] << 24;
}

static float number_at(const struct mitsuba_file *m, size_t i)
{
    const uint32_t bits = get_u32(m->number + NUMBER_BYTES * i);
    float v;
    memcpy(&v, &bits, sizeof v);
    return v;
}

/* Numbers of the vertices: 3 each, and at most one before each of them. */
static status read_header(const char *data, size_t n_bytes, struct mitsuba_file *m, struct error *err)
{
    const uint8_t *b = (const uint8_t *)data;
    if (n_bytes < HEADER_BYTES || memcmp(data, "BINARY_HAIR", MAGIC_BYTES) != 0)
        return error_set(err, STATUS_FORMAT, "cannot read fibers '%s': not a binary .hair file of Mitsuba", m->name);
    m->number = b + HEADER_BYTES;
    m->n = (n_bytes - HEADER_BYTES) / NUMBER_BYTES;
    m->n_vertex = get_u32(b + MAGIC_BYTES);
    const size_t n_point_bytes = n_bytes - HEADER_BYTES;
    if (n_point_bytes % NUMBER_BYTES == 0 && n_point_bytes >= POINT_BYTES * m->n_vertex &&
        n_point_bytes <= (POINT_BYTES + NUMBER_BYTES) * m->n_vertex)
        return STATUS_OK;
    return error_set(err, STATUS_FORMAT,
                     "cannot read fibers '%s': it has %zu bytes, which is not the length of %zu points", m->name,
                     n_bytes, m->n_vertex);
}

/* Visits the vertices in order. f: NULL to count fibers alone. */
static status visit(const struct mitsuba_file *m, struct fiber_set *f, size_t *n_fiber, struct error *err)
{
    size_t i = 0, k = 0;
    *n_fiber = 0;
    for (; k < m->n_vertex && i + 2 < m->n; k++) {
        const bool begins = isinf(number_at(m, i)) || k == 0;
        if (isinf(number_at(m, i))) i++;
        if (i + 3 > m->n) break;
        if (begins && f != NULL) f->first_vertex[*n_fiber] = k;
        *n_fiber += begins;
        for (size_t a = 0; a < 3; a++, i++) {
            const float x = number_at(m, i);
            if (!isfinite(x))
                return error_set(err, STATUS_FORMAT, "cannot read fibers '%s': point %zu is not a finite point",
                                 m->name, k);
            if (f != NULL) f->position_m[3 * k + a] = 1e-3f * x;
        }
    }
    if (k == m->n_vertex && i == m->n) return STATUS_OK;
    return error_set(err, STATUS_FORMAT, "cannot read fibers '%s': its header states %zu points, but it has others",
                     m->name, m->n_vertex);
}

static status decode(const struct mitsuba_file *m, double radius_m, struct fiber_set *f, struct error *err)
{
    size_t n_fiber = 0;
    status s = visit(m, NULL, &n_fiber, err);
    if (s == STATUS_OK && n_fiber == 0)
        s = error_set(err, STATUS_FORMAT, "cannot read fibers '%s': it has no fiber", m->name);
    if (s == STATUS_OK) s = fiber_set_reserve(f, n_fiber, m->n_vertex, err);
    if (s == STATUS_OK) s = visit(m, f, &n_fiber, err);
    if (s != STATUS_OK) return s;
    f->first_vertex[n_fiber] = m->n_vertex;
    for (size_t i = 0; i < n_fiber; i++) {
        f->radius_m[i] = (float)radius_m;
        if (f->first_vertex[i + 1] - f->first_vertex[i] < 2)
            return error_set(err, STATUS_FORMAT, "cannot read fibers '%s': fiber %zu has one point only", m->name, i);
    }
    f->tile_size_m[0] = f->tile_size_m[1] = 0.0;
    fiber_set_classify(f);
    return STATUS_OK;
}

status fiber_import_mitsuba(struct fiber_set *f, const char *path, const struct fiber_file_terms *terms,
                            struct error *err)
{
    char *data = NULL;
    size_t n_bytes = 0;
    struct mitsuba_file m = {.name = path_file_name(path)};
    struct fiber_set read;
    fiber_set_init(&read);
    status s = file_read_all(path, SIZE_MAX / 2, &data, &n_bytes, err);
    if (s == STATUS_OK) s = read_header(data, n_bytes, &m, err);
    if (s == STATUS_OK && isnan(terms->radius_m)) s = fiber_terms_no_radius(m.name, err);
    if (s == STATUS_OK) s = decode(&m, terms->radius_m, &read, err);
    free(data);
    if (s != STATUS_OK) {
        fiber_set_release(&read);
        return s;
    }
    fiber_set_release(f);
    *f = read;
    return STATUS_OK;
}
