/* Reads and writes Cem Yuksel's .hair; docs/file-formats.md has the byte layout. All numbers are little-endian. */
#include "base/files/durable.h"
#include "geometry/fibers/fiber_set.h"

#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum {
    HAIR_HEADER_BYTES = 128,
    HAIR_TEXT_OFFSET = 40,
    HAIR_TEXT_BYTES = 88,
    HAIR_SEGMENTS = 1,
    HAIR_POINTS = 2,
    HAIR_THICKNESS = 4,
    HAIR_TRANSPARENCY = 8,
    HAIR_COLOUR = 16,
    HAIR_KNOWN = 31
};

static const char tile_key[] = "selvedge tile_mm=", group_key[] = " groups=rgb", section_key[] = " sections",
                  lumen_key[] = " lumens";
/* Points that are thinner, over the mean thickness of their fiber, count as this thick: rays need some thickness. */
static const double LEAST_THICKNESS = 0.05;

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

static uint32_t get_u16(const uint8_t *from) { return (uint32_t)from[0] | (uint32_t)from[1] << 8; }
static uint32_t get_u32(const uint8_t *from) { return get_u16(from) | get_u16(from + 2) << 16; }

static float get_f32(const uint8_t *from)
{
    uint32_t bits = get_u32(from);
    float v;
    memcpy(&v, &bits, sizeof v);
    return v;
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
    int n = snprintf(text, sizeof text, "%s%.17g,%.17g%s%s", tile_key, 1e3 * f->tile_size_m[0], 1e3 * f->tile_size_m[1],
                     groups ? group_key : "",
                     numbers == 0                     ? ""
                     : numbers == FIBER_SHAPE_NUMBERS ? section_key
                                                      : lumen_key);
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

struct hair_header {
    uint32_t n_strand, n_point, flags, default_segments;
    float default_thickness;
    int numbers; /* of the section of each point, after the arrays */
};

/* Checks the counts of the header against the length of the file. *n_bytes: length that follows from the header (at
 * most 2^37). */
static status check_header(const struct hair_header *h, uint64_t file_bytes, const char *name, struct error *err)
{
    if ((h->flags & HAIR_POINTS) == 0 || (h->flags & ~(uint32_t)HAIR_KNOWN) != 0)
        return error_set(err, STATUS_FORMAT,
                         "cannot read fibers '%s': flags 0x%x: there are no points, or a flag is unknown", name,
                         h->flags);
    if (h->n_strand == 0) return error_set(err, STATUS_FORMAT, "cannot read fibers '%s': it has no fiber", name);
    uint64_t want = HAIR_HEADER_BYTES + 12 * (uint64_t)h->n_point;
    if (h->flags & HAIR_SEGMENTS) want += 2 * (uint64_t)h->n_strand;
    if (h->flags & HAIR_THICKNESS) want += 4 * (uint64_t)h->n_point;
    if (h->flags & HAIR_TRANSPARENCY) want += 4 * (uint64_t)h->n_point;
    if (h->flags & HAIR_COLOUR) want += 12 * (uint64_t)h->n_point;
    want += 4 * (uint64_t)h->numbers * (uint64_t)h->n_point;
    if (want != file_bytes)
        return error_set(err, STATUS_FORMAT, "cannot read fibers '%s': it has %llu bytes, but its header requires %llu",
                         name, (unsigned long long)file_bytes, (unsigned long long)want);
    if (2 * (uint64_t)h->n_strand > h->n_point)
        return error_set(err, STATUS_FORMAT, "cannot read fibers '%s': %u fibers but only %u points", name, h->n_strand,
                         h->n_point);
    if ((h->flags & HAIR_SEGMENTS) == 0 && (uint64_t)h->n_strand * ((uint64_t)h->default_segments + 1) != h->n_point)
        return error_set(err, STATUS_FORMAT, "cannot read fibers '%s': %u fibers of %u segments do not make %u points",
                         name, h->n_strand, h->default_segments, h->n_point);
    return STATUS_OK;
}

/* Computes first_vertex from the segment counts. */
static status get_strands(struct fiber_set *f, const struct hair_header *h, const uint8_t *segments, const char *name,
                          struct error *err)
{
    uint64_t used = 0;
    for (size_t i = 0; i < h->n_strand; i++) {
        uint32_t n = segments == NULL ? h->default_segments : get_u16(segments + 2 * i);
        if (n == 0) return error_set(err, STATUS_FORMAT, "cannot read fibers '%s': fiber %zu has no segment", name, i);
        f->first_vertex[i] = used;
        used += (uint64_t)n + 1;
        if (used > h->n_point) break;
    }
    if (used != h->n_point)
        return error_set(err, STATUS_FORMAT, "cannot read fibers '%s': the segments do not add up to %u points", name,
                         h->n_point);
    f->first_vertex[h->n_strand] = used;
    return STATUS_OK;
}

static status get_radii(struct fiber_set *f, const struct hair_header *h, const uint8_t *thickness, const char *name,
                        struct error *err)
{
    for (size_t i = 0; i < f->n_fiber; i++) {
        double sum = 0.0;
        size_t n = f->first_vertex[i + 1] - f->first_vertex[i];
        for (size_t k = f->first_vertex[i]; k < f->first_vertex[i + 1]; k++)
            sum += thickness == NULL ? h->default_thickness : get_f32(thickness + 4 * k);
        f->radius_m[i] = (float)(0.5e-3 * sum / (double)n);
        if (!(f->radius_m[i] > 0.0f) || !isfinite(f->radius_m[i]))
            return error_set(err, STATUS_FORMAT,
                             "cannot read fibers '%s': fiber %zu has no thickness, and neither does the header", name,
                             i);
    }
    return STATUS_OK;
}

/* Lets the radius vary along fibers whose points differ in thickness. thickness: NULL if the file has none. */
static status get_varying_radii(struct fiber_set *f, const uint8_t *thickness, const char *name, struct error *err)
{
    bool varies = false;
    for (size_t i = 0; i < f->n_fiber && thickness != NULL; i++)
        for (size_t k = f->first_vertex[i]; k + 1 < f->first_vertex[i + 1]; k++)
            varies = varies || get_f32(thickness + 4 * k) != get_f32(thickness + 4 * k + 4);
    status s = varies ? fiber_set_add_shapes(f, err) : STATUS_OK;
    for (size_t i = 0; i < f->n_fiber && s == STATUS_OK && thickness != NULL && f->shape != NULL; i++)
        for (size_t k = f->first_vertex[i]; k < f->first_vertex[i + 1]; k++) {
            const float r = 0.5e-3f * get_f32(thickness + 4 * k), least = (float)LEAST_THICKNESS * f->radius_m[i];
            if (!(r >= 0.0f) || !isfinite(r))
                return error_set(err, STATUS_FORMAT, "cannot read fibers '%s': point %zu has a thickness of %g mm",
                                 name, k, 2e3 * (double)r);
            f->shape[k].radius = r > least ? r : least;
        }
    return s;
}

/* data: the sections of all points. */
static status get_sections(struct fiber_set *f, const uint8_t *data, int numbers, const char *name, struct error *err)
{
    status s = fiber_set_add_shapes(f, err);
    for (size_t k = 0; k < f->n_vertex && s == STATUS_OK; k++) {
        struct fiber_shape *to = &f->shape[k];
        float value[FIBER_SHAPE_WITH_LUMEN];
        for (int i = 0; i < numbers; i++) value[i] = get_f32(data + 4 * ((size_t)numbers * k + (size_t)i));
        if (!fiber_shape_set(to, value, numbers))
            s = error_set(err, STATUS_FORMAT, "cannot read fibers '%s': the numbers of point %zu are no section", name,
                          k);
    }
    return s;
}

/* The group that a colour stands for, or FIBER_MAX_GROUP for any other colour. */
static uint8_t get_group(const uint8_t *colour)
{
    uint8_t group = 0;
    for (size_t c = 0; c < 3; c++) {
        float v = get_f32(colour + 4 * c);
        if (v != 0.0f && v != 1.0f) return FIBER_MAX_GROUP;
        if (v == 0.0f) group |= (uint8_t)(1u << c);
    }
    return group;
}

static status get_groups(struct fiber_set *f, const uint8_t *colour, const char *name, struct error *err)
{
    for (size_t i = 0; i < f->n_fiber; i++) {
        f->group[i] = get_group(colour + 12 * f->first_vertex[i]);
        for (size_t k = f->first_vertex[i]; k < f->first_vertex[i + 1]; k++)
            if (f->group[i] >= FIBER_MAX_GROUP || get_group(colour + 12 * k) != f->group[i])
                return error_set(err, STATUS_FORMAT,
                                 "cannot read fibers '%s': the colours of fiber %zu do not state one group", name, i);
    }
    return STATUS_OK;
}

/* Reads the tile size from the text of the header; 0 if another program wrote the file. *groups, *numbers: the text
 * says that the colours are groups, and that sections of so many numbers follow the arrays. */
static void get_text(double tile_size_m[2], const uint8_t *header, bool *groups, int *numbers)
{
    char text[HAIR_TEXT_BYTES + 1];
    memcpy(text, header + HAIR_TEXT_OFFSET, HAIR_TEXT_BYTES);
    text[HAIR_TEXT_BYTES] = '\0';
    tile_size_m[0] = tile_size_m[1] = 0.0;
    const char *at = strstr(text, tile_key);
    *groups = at != NULL && strstr(at, group_key) != NULL;
    *numbers = at != NULL && strstr(at, section_key) != NULL ? FIBER_SHAPE_NUMBERS
               : at != NULL && strstr(at, lumen_key) != NULL ? FIBER_SHAPE_WITH_LUMEN
                                                             : 0;
    if (at == NULL) return;
    char *end;
    double x = strtod(at + sizeof tile_key - 1, &end);
    if (*end != ',') return;
    double y = strtod(end + 1, &end);
    if (!(x > 0.0) || !(y > 0.0) || !isfinite(x) || !isfinite(y)) return;
    tile_size_m[0] = 1e-3 * x;
    tile_size_m[1] = 1e-3 * y;
}

static struct hair_header get_header(const uint8_t *data, double tile_size_m[2], bool *groups)
{
    struct hair_header h = {get_u32(data + 4),  get_u32(data + 8),  get_u32(data + 12),
                            get_u32(data + 16), get_f32(data + 20), 0};
    get_text(tile_size_m, data, groups, &h.numbers);
    return h;
}

static status decode(struct fiber_set *f, const uint8_t *data, uint64_t n_bytes, const char *name, struct error *err)
{
    if (n_bytes < HAIR_HEADER_BYTES || memcmp(data, "HAIR", 4) != 0)
        return error_set(err, STATUS_FORMAT, "cannot read fibers '%s': not a .hair file", name);
    bool groups;
    double tile_size_m[2];
    struct hair_header h = get_header(data, tile_size_m, &groups);
    status s = check_header(&h, n_bytes, name, err);
    if (s == STATUS_OK) s = fiber_set_reserve(f, h.n_strand, h.n_point, err);
    if (s != STATUS_OK) return s;
    const uint8_t *segments = NULL, *at = data + HAIR_HEADER_BYTES;
    if (h.flags & HAIR_SEGMENTS) {
        segments = at;
        at += 2 * (size_t)h.n_strand;
    }
    const uint8_t *points = at, *thickness = h.flags & HAIR_THICKNESS ? at + 12 * (size_t)h.n_point : NULL;
    s = get_strands(f, &h, segments, name, err);
    if (s == STATUS_OK) s = get_radii(f, &h, thickness, name, err);
    const size_t section_bytes = 4 * (size_t)h.numbers * (size_t)h.n_point;
    if (s == STATUS_OK && h.numbers > 0) s = get_sections(f, data + n_bytes - section_bytes, h.numbers, name, err);
    if (s == STATUS_OK) s = get_varying_radii(f, thickness, name, err);
    if (s != STATUS_OK) return s;
    for (size_t k = 0; k < 3 * (size_t)h.n_point; k++) {
        f->position_m[k] = 1e-3f * get_f32(points + 4 * k);
        if (!isfinite(f->position_m[k]))
            return error_set(err, STATUS_FORMAT, "cannot read fibers '%s': point %zu is not a finite point", name,
                             k / 3);
    }
    memcpy(f->tile_size_m, tile_size_m, sizeof f->tile_size_m);
    fiber_set_classify(f);
    const size_t after_colour = 12u * (size_t)h.n_point + section_bytes;
    return groups && (h.flags & HAIR_COLOUR) != 0 ? get_groups(f, data + n_bytes - after_colour, name, err) : STATUS_OK;
}

/* Checks the header before the rest is read, so that a wrong count allocates nothing. */
static status check_file(const char *path, struct error *err)
{
    const char *name = path_file_name(path);
    FILE *file = fopen(path, "re");
    if (file == NULL) return error_set_errno(err, "cannot read fibers '%s'", name);
    uint8_t header[HAIR_HEADER_BYTES];
    status s = STATUS_OK;
    off_t n_bytes = -1;
    if (fread(header, 1, sizeof header, file) != sizeof header || memcmp(header, "HAIR", 4) != 0)
        s = error_set(err, STATUS_FORMAT, "cannot read fibers '%s': not a .hair file", name);
    else if (fseeko(file, 0, SEEK_END) != 0 || (n_bytes = ftello(file)) < 0)
        s = error_set_errno(err, "cannot read fibers '%s'", name);
    else {
        double tile_size_m[2];
        bool groups;
        const struct hair_header h = get_header(header, tile_size_m, &groups);
        s = check_header(&h, (uint64_t)n_bytes, name, err);
    }
    fclose(file);
    return s;
}

status fiber_set_read_hair(struct fiber_set *f, const char *path, struct error *err)
{
    char *data = NULL;
    size_t n_bytes = 0;
    struct fiber_set read;
    fiber_set_init(&read);
    status s = check_file(path, err);
    if (s == STATUS_OK) s = file_read_all(path, SIZE_MAX / 2, &data, &n_bytes, err);
    if (s == STATUS_OK) s = decode(&read, (const uint8_t *)data, n_bytes, path_file_name(path), err);
    free(data);
    if (s != STATUS_OK) {
        fiber_set_release(&read);
        return s;
    }
    fiber_set_release(f);
    *f = read;
    return STATUS_OK;
}
