/* Fibers as text: a line "x y z", "x y z radius", "x y z radius group", or these and the numbers of a section, in
 * millimetres for each vertex, and a blank line between fibers (docs/file-formats.md). '#' begins a comment. */
#include "base/files/durable.h"
#include "geometry/fibers/fiber_import.h"

#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static void write_section(FILE *out, const struct fiber_shape *s, bool lumens)
{
    fprintf(out, " %.4g %.6g %.4g %.4g %.6g %.6g %.6g", 1e3 * (double)s->radius_se, (double)s->ratio,
            (double)s->ratio_se, (double)s->angle_se_rad, (double)s->long_axis[0], (double)s->long_axis[1],
            (double)s->long_axis[2]);
    if (lumens) fprintf(out, " %.4g %.4g", (double)s->lumen, (double)s->lumen_se);
}

status fiber_set_write_text(const struct fiber_set *f, const char *path, struct error *err)
{
    char *text = NULL;
    size_t n_bytes = 0;
    FILE *out = open_memstream(&text, &n_bytes);
    const char *name = path_file_name(path);
    if (out == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot write fibers '%s': out of memory", name);
    const bool groups = fiber_set_n_group(f) > 1, lumens = fiber_set_has_lumens(f);
    for (size_t i = 0; i < f->n_fiber; i++) {
        if (i > 0) fputc('\n', out);
        for (size_t k = f->first_vertex[i]; k < f->first_vertex[i + 1]; k++) {
            const float *p = f->position_m + 3 * k;
            fprintf(out, "%.9g %.9g %.9g %.9g", 1e3 * (double)p[0], 1e3 * (double)p[1], 1e3 * (double)p[2],
                    1e3 * (double)fiber_radius_m(f, i, k));
            if (groups || f->shape != NULL) fprintf(out, " %u", (unsigned)f->group[i]);
            if (f->shape != NULL) write_section(out, &f->shape[k], lumens);
            fputc('\n', out);
        }
    }
    bool failed = ferror(out) != 0;
    failed = fclose(out) != 0 || failed;
    status s = failed ? error_set(err, STATUS_NO_MEMORY, "cannot write fibers '%s': out of memory", name)
                      : durable_replace(path, text, n_bytes, err);
    free(text);
    return s;
}

struct line_reader {
    const char *at, *end;
    size_t i_line; /* number of the line last read, from 1 */
};

enum { LINE_BYTES = 256 };

enum line_kind { LINE_END, LINE_BLANK, LINE_COMMENT, LINE_POINT, LINE_TOO_LONG };

/* The lines of a file, after a byte order mark. */
static struct line_reader first_line(const char *data, size_t n_bytes)
{
    const size_t mark = n_bytes >= 3 && memcmp(data, "\xef\xbb\xbf", 3) == 0 ? 3 : 0;
    return (struct line_reader){data + mark, data + n_bytes, 0};
}

/* Copies the next line to a buffer without its comment, so that strtod cannot read beyond the end of the line. A line
 * with a comment alone does not end a fiber. */
static enum line_kind next_line(struct line_reader *r, char line[LINE_BYTES])
{
    if (r->at >= r->end) return LINE_END;
    const char *stop = memchr(r->at, '\n', (size_t)(r->end - r->at));
    if (stop == NULL) stop = r->end;
    const char *from = r->at, *comment = memchr(from, '#', (size_t)(stop - from));
    size_t n = (size_t)((comment != NULL ? comment : stop) - from);
    r->at = stop + 1;
    r->i_line++;
    if (n >= LINE_BYTES) return LINE_TOO_LONG;
    memcpy(line, from, n);
    line[n] = '\0';
    const bool blank = line[strspn(line, " \t\r")] == '\0' && strlen(line) == n;
    return !blank ? LINE_POINT : comment != NULL ? LINE_COMMENT : LINE_BLANK;
}

static size_t count_points(const char *data, size_t n_bytes, size_t *n_fiber)
{
    struct line_reader r = first_line(data, n_bytes);
    char line[LINE_BYTES];
    size_t n_vertex = 0;
    bool inside = false;
    *n_fiber = 0;
    for (enum line_kind kind; (kind = next_line(&r, line)) != LINE_END;) {
        if (kind == LINE_BLANK) {
            inside = false;
            continue;
        }
        if (kind == LINE_COMMENT) continue;
        if (!inside) ++*n_fiber;
        inside = true;
        n_vertex++;
    }
    return n_vertex;
}

static bool is_end(const char *line) { return line[strspn(line, " \t\r")] == '\0'; }

/* One line of the file. */
struct text_point {
    double value[4]; /* position and radius */
    bool has_radius;
    uint8_t group;
    bool has_section;
    struct fiber_shape shape; /* in metres */
};

static bool parse_section(const char *line, struct text_point *p)
{
    float value[FIBER_SHAPE_WITH_LUMEN];
    int n = 0;
    while (n < FIBER_SHAPE_WITH_LUMEN && !is_end(line)) {
        char *end;
        value[n++] = strtof(line, &end);
        if (end == line) return false;
        line = end;
    }
    if (n != FIBER_SHAPE_NUMBERS && n != FIBER_SHAPE_WITH_LUMEN) return false;
    p->has_section = fiber_shape_set(&p->shape, value, n);
    return p->has_section && is_end(line);
}

/* Parses four finite numbers, and after them a group, a group and a section, or nothing, which is group 0; or three
 * numbers alone, whose radius is radius_mm. Returns false for anything else. */
static bool parse_point(const char *line, double radius_mm, struct text_point *p)
{
    char *end;
    p->value[3] = radius_mm;
    p->has_radius = false;
    for (int a = 0; a < 4 && !(a == 3 && is_end(line)); a++) {
        p->has_radius = a == 3;
        p->value[a] = strtod(line, &end);
        if (end == line || !isfinite(p->value[a])) return false;
        line = end;
    }
    p->group = 0;
    p->has_section = false;
    p->shape = fiber_shape_disc((float)(1e-3 * p->value[3]));
    if (!is_end(line)) {
        double number = strtod(line, &end);
        if (end == line || !(number >= 0.0 && number < FIBER_MAX_GROUP) || number != floor(number)) return false;
        p->group = (uint8_t)number;
        line = end;
    }
    return (is_end(line) || parse_section(line, p)) && (!p->has_radius || p->value[3] > 0.0);
}

static status wrong_line(const char *name, size_t i_line, bool other_group, struct error *err)
{
    if (other_group)
        return error_set(err, STATUS_FORMAT, "cannot read fibers '%s': line %zu has another group than its fiber", name,
                         i_line);
    return error_set(err, STATUS_FORMAT,
                     "cannot read fibers '%s': line %zu is not \"x y z\", \"x y z radius\" or \"x y z radius group\" "
                     "with a group of "
                     "0 to %d, alone or with the seven or nine numbers of a section",
                     name, i_line, FIBER_MAX_GROUP - 1);
}

static status close_fiber(struct fiber_set *f, size_t i_fiber, size_t n_vertex, double radius_sum, const char *name,
                          size_t i_line, struct error *err)
{
    size_t n = n_vertex - f->first_vertex[i_fiber];
    if (n < 2)
        return error_set(err, STATUS_FORMAT, "cannot read fibers '%s': the fiber ending at line %zu has one point only",
                         name, i_line);
    f->radius_m[i_fiber] = (float)(1e-3 * radius_sum / (double)n);
    f->first_vertex[i_fiber + 1] = n_vertex;
    return STATUS_OK;
}

/* One radius is stated: by every line or by the job */
static status check_radius(const struct text_point *p, double radius_m, const char *name, struct error *err)
{
    if (p->has_radius && !isnan(radius_m)) return fiber_terms_two_radii(name, err);
    return p->has_radius || !isnan(radius_m) ? STATUS_OK : fiber_terms_no_radius(name, err);
}

/* *shaped: there are sections, or the radius varies along a fiber. radius_m: of the job. */
static status parse(struct fiber_set *f, const struct line_reader *first, double radius_m, const char *name,
                    bool *shaped, struct error *err)
{
    struct line_reader r = *first;
    char line[LINE_BYTES];
    size_t i_fiber = 0, n_vertex = 0;
    double radius_sum = 0.0;
    bool with_radius = false; /* the first point states one */
    struct text_point p;
    for (;;) {
        enum line_kind kind = next_line(&r, line);
        bool inside = n_vertex > f->first_vertex[i_fiber];
        if ((kind == LINE_BLANK || kind == LINE_END) && inside) {
            status s = close_fiber(f, i_fiber++, n_vertex, radius_sum, name, r.i_line, err);
            if (s != STATUS_OK) return s;
            radius_sum = 0.0;
        }
        if (kind == LINE_END) return STATUS_OK;
        if (kind == LINE_BLANK || kind == LINE_COMMENT) continue;
        if (kind == LINE_TOO_LONG || !parse_point(line, 1e3 * radius_m, &p))
            return wrong_line(name, r.i_line, false, err);
        if (n_vertex == 0) with_radius = p.has_radius;
        if (p.has_radius != with_radius) return wrong_line(name, r.i_line, false, err);
        status s = check_radius(&p, radius_m, name, err);
        if (s != STATUS_OK) return s;
        if (inside && p.group != f->group[i_fiber]) return wrong_line(name, r.i_line, true, err);
        f->group[i_fiber] = p.group;
        for (size_t a = 0; a < 3; a++) f->position_m[3 * n_vertex + a] = (float)(1e-3 * p.value[a]);
        f->shape[n_vertex] = p.shape;
        *shaped = *shaped || p.has_section || (inside && p.shape.radius != f->shape[n_vertex - 1].radius);
        radius_sum += p.value[3];
        n_vertex++;
    }
}

status fiber_import_text(struct fiber_set *f, const char *path, const struct fiber_file_terms *terms, struct error *err)
{
    char *data = NULL;
    size_t n_bytes = 0, n_fiber = 0;
    bool shaped = false;
    struct fiber_set read;
    fiber_set_init(&read);
    status s = file_read_all(path, SIZE_MAX / 2, &data, &n_bytes, err);
    if (s != STATUS_OK) return s;
    size_t n_vertex = count_points(data, n_bytes, &n_fiber);
    if (n_fiber == 0)
        s = error_set(err, STATUS_FORMAT, "cannot read fibers '%s': it has no fiber", path_file_name(path));
    if (s == STATUS_OK) s = fiber_set_reserve(&read, n_fiber, n_vertex, err);
    if (s == STATUS_OK) s = fiber_set_add_shapes(&read, err);
    const struct line_reader first = first_line(data, n_bytes);
    if (s == STATUS_OK) s = parse(&read, &first, terms->radius_m, path_file_name(path), &shaped, err);
    if (!shaped) {
        free(read.shape);
        read.shape = NULL;
    }
    free(data);
    if (s != STATUS_OK) {
        fiber_set_release(&read);
        return s;
    }
    fiber_set_classify(&read);
    fiber_set_release(f);
    *f = read;
    f->tile_size_m[0] = f->tile_size_m[1] = 0.0;
    return STATUS_OK;
}
