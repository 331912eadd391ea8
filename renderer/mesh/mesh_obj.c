/* Wavefront OBJ: v x y z, vt u v, f v/vt[/vn] ... with indices from 1, or from the end when negative. */
#include "base/files/durable.h"
#include "renderer/mesh/mesh.h"

#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { FILE_LIMIT_BYTES = 1 << 30 };

struct obj_reader {
    const char *name;
    size_t line;
    double scale_mm;
    struct mesh *m; /* its arrays have room for all lines of the file */
};

static status at_line(const struct obj_reader *r, const char *what, struct error *err)
{
    return error_set(err, STATUS_FORMAT, "cannot use mesh '%s', line %zu: %s", r->name, r->line, what);
}

static status read_numbers(const struct obj_reader *r, const char *text, size_t n, double *out, struct error *err)
{
    for (size_t i = 0; i < n; i++) {
        char *end;
        out[i] = r->scale_mm * strtod(text, &end);
        if (end == text) return at_line(r, "a number is missing", err);
        text = end;
    }
    return STATUS_OK;
}

/* Index of a point in the text, from 0; UINT32_MAX when there is no such point yet. */
static uint32_t read_index(const char **text, size_t n)
{
    char *end;
    long long i = strtoll(*text, &end, 10);
    if (end == *text) return UINT32_MAX;
    *text = end;
    if (i < 0) i += (long long)n + 1;
    return i >= 1 && i <= (long long)n ? (uint32_t)(i - 1) : UINT32_MAX;
}

static status read_corner(const struct obj_reader *r, const char **text, uint32_t corner[2], struct error *err)
{
    corner[0] = read_index(text, r->m->n_position);
    if (corner[0] == UINT32_MAX) return at_line(r, "the face names a position (v) that is not there", err);
    if (**text != '/' || (*text)[1] == '/')
        return at_line(r, "the face has no texture coordinates (vt), which say where the cloth lies", err);
    ++*text;
    corner[1] = read_index(text, r->m->n_texture);
    if (corner[1] == UINT32_MAX) return at_line(r, "the face names a texture coordinate (vt) that is not there", err);
    *text += strcspn(*text, " \t\r");
    return STATUS_OK;
}

static status read_face(const struct obj_reader *r, const char *text, struct error *err)
{
    uint32_t first[2] = {0, 0}, last[2] = {0, 0}, corner[2];
    size_t n = 0;
    for (text += strspn(text, " \t\r"); *text != '\0'; text += strspn(text, " \t\r"), n++) {
        status s = read_corner(r, &text, corner, err);
        if (s != STATUS_OK) return s;
        if (n == 0) memcpy(first, corner, sizeof first);
        if (n >= 2) {
            if (r->m->n_triangle >= MESH_MAX_TRIANGLE)
                return error_set(err, STATUS_TOO_LARGE, "cannot use mesh '%s': more than %d triangles", r->name,
                                 MESH_MAX_TRIANGLE);
            r->m->triangle[r->m->n_triangle++] =
                (struct mesh_triangle){{first[0], last[0], corner[0]}, {first[1], last[1], corner[1]}};
        }
        memcpy(last, corner, sizeof last);
    }
    return n >= 3 ? STATUS_OK : at_line(r, "a face needs three corners or more", err);
}

static status read_line(const struct obj_reader *r, const char *line, struct error *err)
{
    line += strspn(line, " \t");
    if (strncmp(line, "v ", 2) == 0 || strncmp(line, "v\t", 2) == 0)
        return read_numbers(r, line + 2, 3, r->m->position_mm[r->m->n_position++], err);
    if (strncmp(line, "vt ", 3) == 0 || strncmp(line, "vt\t", 3) == 0)
        return read_numbers(r, line + 3, 2, r->m->texture_mm[r->m->n_texture++], err);
    if (strncmp(line, "f ", 2) == 0 || strncmp(line, "f\t", 2) == 0) return read_face(r, line + 2, err);
    return STATUS_OK;
}

static size_t count(const char *text, char c)
{
    size_t n = 0;
    for (; *text != '\0'; text++) n += *text == c;
    return n;
}

static status read_lines(struct obj_reader *r, char *text, struct error *err)
{
    status s = STATUS_OK;
    while (text != NULL && s == STATUS_OK) {
        char *end = strchr(text, '\n');
        if (end != NULL) *end = '\0';
        r->line++;
        s = read_line(r, text, err);
        text = end != NULL ? end + 1 : NULL;
    }
    return s;
}

struct numbered_point {
    double x[3];
    uint32_t i;
};

static int compare_points(const void *pa, const void *pb)
{
    const struct numbered_point *a = pa, *b = pb;
    for (int k = 0; k < 3; k++)
        if (a->x[k] != b->x[k]) return a->x[k] < b->x[k] ? -1 : 1;
    return a->i < b->i ? -1 : a->i > b->i;
}

/* Makes triangles name the first of several equal positions, as programs write them along seams of the texture. */
static status weld(struct mesh *m, struct error *err)
{
    struct numbered_point *p = malloc((m->n_position + 1) * sizeof *p);
    uint32_t *first = malloc((m->n_position + 1) * sizeof *first);
    status s =
        p != NULL && first != NULL ? STATUS_OK : error_set(err, STATUS_NO_MEMORY, "cannot read a mesh: no memory");
    for (size_t i = 0; i < m->n_position && s == STATUS_OK; i++) {
        memcpy(p[i].x, m->position_mm[i], sizeof p[i].x);
        p[i].i = (uint32_t)i;
    }
    if (s == STATUS_OK) qsort(p, m->n_position, sizeof *p, compare_points);
    for (size_t i = 0; i < m->n_position && s == STATUS_OK; i++) {
        bool same = i > 0 && memcmp(p[i].x, p[i - 1].x, sizeof p[i].x) == 0;
        first[p[i].i] = same ? first[p[i - 1].i] : p[i].i;
    }
    for (size_t i = 0; i < m->n_triangle && s == STATUS_OK; i++)
        for (int k = 0; k < 3; k++) m->triangle[i].position[k] = first[m->triangle[i].position[k]];
    free(p);
    free(first);
    return s;
}

status mesh_read_obj(const char *path, double scale_mm, struct mesh *m, struct error *err)
{
    char *text = NULL;
    struct obj_reader r = {path_file_name(path), 0, scale_mm, m};
    status s = file_read_all(path, FILE_LIMIT_BYTES, &text, NULL, err);
    memset(m, 0, sizeof *m);
    if (s != STATUS_OK) return s;
    /* a line holds one point at most, and a corner of a triangle has a slash */
    size_t n_line = count(text, '\n') + 1, n_corner = count(text, '/');
    s = mesh_new(m, n_line, n_line, n_corner < MESH_MAX_TRIANGLE ? n_corner : MESH_MAX_TRIANGLE, err);
    m->n_position = m->n_texture = m->n_triangle = 0;
    if (s == STATUS_OK) s = read_lines(&r, text, err);
    if (s == STATUS_OK) s = weld(m, err);
    if (s == STATUS_OK) s = mesh_check(m, err);
    if (s != STATUS_OK) mesh_release(m);
    free(text);
    return s;
}

/* Two triangles of a cut rectangle: a b d, a d c. */
static bool is_rectangle(const struct mesh_triangle *t)
{
    return t[0].position[0] == t[1].position[0] && t[0].position[2] == t[1].position[1] &&
           t[0].texture[0] == t[1].texture[0] && t[0].texture[2] == t[1].texture[1];
}

status mesh_obj_text(const struct mesh *m, char **text, size_t *n_bytes, struct error *err)
{
    FILE *f = open_memstream(text, n_bytes);
    if (f == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot write a mesh: no memory");
    fputs("# Selvedge: positions in millimetres, texture coordinates in millimetres of cloth\n", f);
    for (size_t i = 0; i < m->n_position; i++)
        fprintf(f, "v %.6g %.6g %.6g\n", m->position_mm[i][0], m->position_mm[i][1], m->position_mm[i][2]);
    for (size_t i = 0; i < m->n_texture; i++) fprintf(f, "vt %.6g %.6g\n", m->texture_mm[i][0], m->texture_mm[i][1]);
    for (size_t i = 0; i < m->n_triangle; i++) {
        bool two = i + 1 < m->n_triangle && is_rectangle(&m->triangle[i]);
        fputc('f', f);
        for (int k = 0; k < 3; k++) fprintf(f, " %u/%u", m->triangle[i].position[k] + 1, m->triangle[i].texture[k] + 1);
        if (two) fprintf(f, " %u/%u", m->triangle[i + 1].position[2] + 1, m->triangle[i + 1].texture[2] + 1);
        fputc('\n', f);
        i += two;
    }
    bool failed = ferror(f) != 0;
    if (fclose(f) == 0 && !failed) return STATUS_OK;
    free(*text);
    *text = NULL;
    return error_set(err, STATUS_NO_MEMORY, "cannot write a mesh: no memory");
}
