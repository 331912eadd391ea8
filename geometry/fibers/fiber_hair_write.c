/* Writes Cem Yuksel's .hair. All numbers are little-endian. */
#include "base/files/durable.h"
#include "geometry/fibers/fiber_hair.h"
#include "geometry/fibers/fiber_set.h"

#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static void put_u16(uint8_t *to, uint32_t v)
{
    to[0] = (uint8_t)v;
    to[1] = (uint8_t)(v >> 8);
}

static void put_u32(uint8_t *to, uint32_t v)
{
    put_u16(to, v & 0xffffu);
    put_u16(to + 2, v >> 16);
}

static void put_f32(uint8_t *to, float v)
{
    uint32_t bits;
    memcpy(&bits, &v, sizeof bits);
    put_u32(to, bits);
}

/* Number of strands that a fiber of n vertices is written as, because the format counts a strand's segments in 16
 * bits. */
static size_t n_strand_of(size_t n) { return (n - 2) / FIBER_HAIR_MAX_SEGMENT + 1; }

/* Counts the strands and points that the file will hold. The vertex between two strands of a fiber is in both. */
static status count_strands(const struct fiber_set *f, const char *name, size_t *n_strand, size_t *n_point,
                            struct error *err)
{
    *n_strand = 0;
    for (size_t i = 0; i < f->n_fiber; i++) {
        size_t n = f->first_vertex[i + 1] - f->first_vertex[i];
        if (n < 2)
            return error_set(err, STATUS_INVALID,
                             "cannot write fibers '%s': fiber %zu has %zu vertices, but needs at least 2", name, i, n);
        *n_strand += n_strand_of(n);
    }
    *n_point = f->n_vertex + (*n_strand - f->n_fiber);
    if (*n_point > UINT32_MAX) /* there are fewer strands than points */
        return error_set(err, STATUS_TOO_LARGE,
                         "cannot write fibers '%s': %zu vertices, but the format is limited to %u", name, *n_point,
                         UINT32_MAX);
    return STATUS_OK;
}

/* numbers: of a section (fiber_shape.h), here and below; 0: there are none. */
static void put_header(uint8_t *to, const struct fiber_set *f, size_t n_strand, size_t n_point, bool groups,
                       int numbers)
{
    memset(to, 0, HAIR_HEADER_BYTES);
    memcpy(to, "HAIR", 4);
    put_u32(to + 4, (uint32_t)n_strand);
    put_u32(to + 8, (uint32_t)n_point);
    put_u32(to + 12, HAIR_SEGMENTS | HAIR_POINTS | HAIR_THICKNESS | (groups ? HAIR_COLOUR : 0));
    put_f32(to + 20, f->n_fiber > 0 ? 2000.0f * f->radius_m[0] : 0.0f);
    for (size_t c = 0; c < 3; c++) put_f32(to + 28 + 4 * c, 1.0f);
    char text[HAIR_TEXT_BYTES];
    int n = snprintf(text, sizeof text, "%s%.17g,%.17g%s%s", HAIR_TILE_KEY, 1e3 * f->tile_size_m[0],
                     1e3 * f->tile_size_m[1], groups ? HAIR_GROUP_KEY : "",
                     numbers == 0                     ? ""
                     : numbers == FIBER_SHAPE_NUMBERS ? HAIR_SECTION_KEY
                                                      : HAIR_LUMEN_KEY);
    if (n > 0 && n < HAIR_TEXT_BYTES) memcpy(to + HAIR_TEXT_OFFSET, text, (size_t)n);
}

/* The colours of groups are the corners of the rgb cube: group 0 is white, and bit c of the group clears channel c. */
static float group_channel(uint8_t group, size_t c) { return ((uint32_t)group >> c & 1u) != 0 ? 0.0f : 1.0f; }

/* The numbers of a point that the format has no array for. */
static void put_section(uint8_t *to, const struct fiber_shape *s, int numbers)
{
    float value[FIBER_SHAPE_WITH_LUMEN];
    fiber_shape_numbers(s, value);
    for (int i = 0; i < numbers; i++) put_f32(to + 4 * i, value[i]);
}

static int section_numbers(const struct fiber_set *f)
{
    return f->shape == NULL ? 0 : fiber_set_has_lumens(f) ? FIBER_SHAPE_WITH_LUMEN : FIBER_SHAPE_NUMBERS;
}

/* to: the arrays of the file, after the header. */
static void put_strands(uint8_t *to, const struct fiber_set *f, size_t n_strand, size_t n_point, bool groups,
                        int numbers)
{
    uint8_t *segments = to, *points = segments + 2 * n_strand, *thickness = points + 12 * n_point;
    uint8_t *colour = thickness + 4 * n_point, *section = colour + (groups ? 12 * n_point : 0);
    for (size_t i = 0; i < f->n_fiber; i++)
        for (size_t from = f->first_vertex[i], last = f->first_vertex[i + 1] - 1; from < last;) {
            size_t n = last - from < FIBER_HAIR_MAX_SEGMENT ? last - from : FIBER_HAIR_MAX_SEGMENT;
            put_u16(segments, (uint32_t)n);
            for (size_t k = from; k <= from + n; k++, points += 12, thickness += 4) {
                for (size_t a = 0; a < 3; a++) put_f32(points + 4 * a, 1000.0f * f->position_m[3 * k + a]);
                put_f32(thickness, 2000.0f * fiber_radius_m(f, i, k));
                if (numbers > 0) put_section(section, &f->shape[k], numbers);
                section += 4 * numbers;
                for (size_t c = 0; groups && c < 3; c++, colour += 4) put_f32(colour, group_channel(f->group[i], c));
            }
            segments += 2;
            from += n;
        }
}

status fiber_set_write_hair(const struct fiber_set *f, const char *path, struct error *err)
{
    const char *name = path_file_name(path);
    size_t n_strand = 0, n_point = 0;
    status s = count_strands(f, name, &n_strand, &n_point, err);
    if (s != STATUS_OK) return s;
    bool groups = fiber_set_n_group(f) > 1;
    const int numbers = section_numbers(f);
    const size_t point_bytes = (groups ? 28u : 16u) + 4u * (size_t)numbers;
    const size_t n_bytes = HAIR_HEADER_BYTES + 2 * n_strand + point_bytes * n_point;
    uint8_t *data = malloc(n_bytes);
    if (data == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot write fibers '%s': out of memory", name);
    put_header(data, f, n_strand, n_point, groups, numbers);
    put_strands(data + HAIR_HEADER_BYTES, f, n_strand, n_point, groups, numbers);
    s = durable_replace(path, data, n_bytes, err);
    free(data);
    return s;
}
