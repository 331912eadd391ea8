/* Reads Cem Yuksel's .hair. All numbers are little-endian. */
#include "geometry/fibers/fiber_hair.h"
#include "base/files/durable.h"
#include "geometry/fibers/fiber_import.h"

#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Points that are thinner, over the mean thickness of their fiber, count as this thick: rays need some thickness. */
static const double LEAST_THICKNESS = 0.05;

static uint32_t get_u16(const uint8_t *from) { return (uint32_t)from[0] | (uint32_t)from[1] << 8; }
static uint32_t get_u32(const uint8_t *from) { return get_u16(from) | get_u16(from + 2) << 16; }

static float get_f32(const uint8_t *from)
{
    uint32_t bits = get_u32(from);
    float v;
    memcpy(&v, &bits, sizeof v);
    return v;
}

struct hair_header {
    uint32_t n_strand, n_point, flags, default_segments;
    float default_thickness, default_transparency, default_colour[3];
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
    const char *at = strstr(text, HAIR_TILE_KEY);
    *groups = at != NULL && strstr(at, HAIR_GROUP_KEY) != NULL;
    *numbers = at != NULL && strstr(at, HAIR_SECTION_KEY) != NULL ? FIBER_SHAPE_NUMBERS
               : at != NULL && strstr(at, HAIR_LUMEN_KEY) != NULL ? FIBER_SHAPE_WITH_LUMEN
                                                                  : 0;
    if (at == NULL) return;
    char *end;
    double x = strtod(at + sizeof HAIR_TILE_KEY - 1, &end);
    if (*end != ',') return;
    double y = strtod(end + 1, &end);
    if (!(x > 0.0) || !(y > 0.0) || !isfinite(x) || !isfinite(y)) return;
    tile_size_m[0] = 1e-3 * x;
    tile_size_m[1] = 1e-3 * y;
}

static struct hair_header get_header(const uint8_t *data, double tile_size_m[2], bool *groups)
{
    struct hair_header h = {
        .n_strand = get_u32(data + 4),
        .n_point = get_u32(data + 8),
        .flags = get_u32(data + 12),
        .default_segments = get_u32(data + 16),
        .default_thickness = get_f32(data + 20),
        .default_transparency = get_f32(data + 24),
        .default_colour = {get_f32(data + 28), get_f32(data + 32), get_f32(data + 36)},
    };
    get_text(tile_size_m, data, groups, &h.numbers);
    return h;
}

/* The statements that have no use here. */
static void note_unused(const struct hair_header *h, bool groups, struct file_ledger *ledger)
{
    static const char opaque[] = "the fitted model says how much light a fiber lets through",
                      fitted[] = "the fitted model says which color a fiber has";
    const float *c = h->default_colour;
    if ((h->flags & HAIR_TRANSPARENCY) != 0)
        file_ledger_add(ledger, "transparency", opaque, "of each point");
    else if (h->default_transparency != 0.0f)
        file_ledger_add(ledger, "transparency", opaque, "%g", (double)h->default_transparency);
    if ((h->flags & HAIR_COLOUR) != 0)
        file_ledger_add(ledger, "colors", groups ? NULL : fitted, groups ? "groups of fibers" : "of each point");
    else if ((c[0] != 1.0f || c[1] != 1.0f || c[2] != 1.0f) && (c[0] != 0.0f || c[1] != 0.0f || c[2] != 0.0f))
        file_ledger_add(ledger, "colors", fitted, "%g %g %g", (double)c[0], (double)c[1], (double)c[2]);
}

void fiber_import_hair_statements(const uint8_t header[HAIR_HEADER_BYTES], struct file_ledger *ledger,
                                  double tile_size_m[2])
{
    bool groups;
    const struct hair_header h = get_header(header, tile_size_m, &groups);
    note_unused(&h, groups, ledger);
}

/* The radius of the job is for files that state none. */
static status settle_radius(struct hair_header *h, double radius_m, const char *name, struct error *err)
{
    const bool stated = (h->flags & HAIR_THICKNESS) != 0 || h->default_thickness > 0.0f;
    if (!isnan(radius_m) && stated) return fiber_terms_two_radii(name, err);
    if (!stated && isnan(radius_m)) return fiber_terms_no_radius(name, err);
    if (!stated) h->default_thickness = (float)(2e3 * radius_m);
    return STATUS_OK;
}

static status decode(struct fiber_set *f, const uint8_t *data, uint64_t n_bytes, const struct fiber_file_terms *terms,
                     const char *name, struct error *err)
{
    if (n_bytes < HAIR_HEADER_BYTES || memcmp(data, "HAIR", 4) != 0)
        return error_set(err, STATUS_FORMAT, "cannot read fibers '%s': not a .hair file", name);
    bool groups;
    double tile_size_m[2];
    struct hair_header h = get_header(data, tile_size_m, &groups);
    status s = check_header(&h, n_bytes, name, err);
    if (s == STATUS_OK) s = settle_radius(&h, terms->radius_m, name, err);
    if (s == STATUS_OK) note_unused(&h, groups, terms->ledger);
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

status fiber_import_hair(struct fiber_set *f, const char *path, const struct fiber_file_terms *terms, struct error *err)
{
    char *data = NULL;
    size_t n_bytes = 0;
    struct fiber_set read;
    fiber_set_init(&read);
    status s = check_file(path, err);
    if (s == STATUS_OK) s = file_read_all(path, SIZE_MAX / 2, &data, &n_bytes, err);
    if (s == STATUS_OK) s = decode(&read, (const uint8_t *)data, n_bytes, terms, path_file_name(path), err);
    free(data);
    if (s != STATUS_OK) {
        fiber_set_release(&read);
        return s;
    }
    fiber_set_release(f);
    *f = read;
    return STATUS_OK;
}
