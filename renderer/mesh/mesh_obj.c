/* Wavefront OBJ: v x y z, vt u v, f v/vt[/vn] ... with indices from 1, or from the last point when negative. */
#include "base/files/durable.h"
#include "base/files/reading_note.h"
#include "renderer/mesh/mesh.h"

#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { FILE_LIMIT_BYTES = 1 << 30, CONTINUED = '\v' };
static const char blank[] = " \t\v";

struct obj_reader {
    const char *name;
    size_t line;
    double scale_mm;
    size_t n_position, n_texture; /* before the present line */
    struct mesh *m;               /* its arrays have room for all lines of the file */
    struct file_ledger *ledger;
};

static status at_line(const struct obj_reader *r, const char *what, struct error *err)
{
    return error_set(err, STATUS_FORMAT, "cannot use mesh '%s', line %zu: %s", r->name, r->line, what);
}

static const char *skip_blanks(const char *text) { return text + strspn(text, blank); }

/* ---- lines ---- */

/* Returns the end of the line when `text`, which is a backslash, continues it, NULL otherwise. */
static char *continued_at(char *text)
{
    char *at = text + 1 + strspn(text + 1, " \t\r");
    return *at == '\n' ? at : NULL;
}

/* Replaces comments by blanks, ends of lines by '\n' alone, and a backslash with the end of line after it by blanks and
 * CONTINUED. A comment ends with its line, because names of folders in it may end with a backslash. */
static void simplify(char *text)
{
    bool comment = false;
    for (char *end; *text != '\0'; text++) {
        if (*text == '\r') *text = text[1] == '\n' ? ' ' : '\n';
        comment = (comment || *text == '#') && *text != '\n';
        if (comment)
            *text = ' ';
        else if (*text == '\\' && (end = continued_at(text)) != NULL) {
            memset(text, ' ', (size_t)(end - text));
            *end = CONTINUED;
            text = end;
        }
    }
}

static size_t count(const char *text, char c)
{
    size_t n = 0;
    for (; *text != '\0'; text++) n += *text == c;
    return n;
}

/* ---- statements ---- */

static status read_numbers(const struct obj_reader *r, const char **text, size_t n, double *out, struct error *err)
{
    for (size_t i = 0; i < n; i++) {
        char *end;
        const char *at = skip_blanks(*text);
        out[i] = r->scale_mm * strtod(at, &end);
        if (end == at || (*end != '\0' && strchr(blank, *end) == NULL)) return at_line(r, "a number is missing", err);
        *text = end;
    }
    return STATUS_OK;
}

/* Index of a point in the text, from 0; UINT32_MAX when there is no such point. n_before: points of the lines before,
 * from which negative numbers count. A positive number may name a point of a later line. */
static uint32_t read_index(const char **text, size_t n, size_t n_before)
{
    char *end;
    long long i = strtoll(*text, &end, 10);
    if (end == *text) return UINT32_MAX;
    *text = end;
    if (i < 0) i += (long long)n_before + 1;
    return i >= 1 && i <= (long long)n ? (uint32_t)(i - 1) : UINT32_MAX;
}

static status read_corner(const struct obj_reader *r, const char **text, uint32_t corner[2], struct error *err)
{
    corner[0] = read_index(text, r->m->n_position, r->n_position);
    if (corner[0] == UINT32_MAX) return at_line(r, "the face names a position (v) that is not there", err);
    if (**text != '/' || (*text)[1] == '/')
        return at_line(r, "the face has no texture coordinates (vt), which say where the cloth lies", err);
    ++*text;
    corner[1] = read_index(text, r->m->n_texture, r->n_texture);
    if (corner[1] == UINT32_MAX) return at_line(r, "the face names a texture coordinate (vt) that is not there", err);
    if (**text == '/') *text += 1 + strspn(*text + 1, "+-0123456789"); /* the normal */
    return **text == '\0' || strchr(blank, **text) != NULL ? STATUS_OK
                                                           : at_line(r, "a corner of the face is not v/vt/vn", err);
}

static status read_face(const struct obj_reader *r, const char *text, struct error *err)
{
    uint32_t first[2] = {0, 0}, last[2] = {0, 0}, corner[2];
    size_t n = 0;
    for (text = skip_blanks(text); *text != '\0'; text = skip_blanks(text), n++) {
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

/* Returns what follows the keyword, NULL where the line has another one. */
static const char *after_keyword(const char *line, const char *keyword)
{
    const size_t n = strlen(keyword);
    return strncmp(line, keyword, n) == 0 && (line[n] == '\0' || strchr(blank, line[n]) != NULL) ? line + n : NULL;
}

static status read_points(struct obj_reader *r, const char *line, struct error *err)
{
    const char *at;
    line = skip_blanks(line);
    if ((at = after_keyword(line, "v")) != NULL)
        return read_numbers(r, &at, 3, r->m->position_mm[r->m->n_position++], err);
    if ((at = after_keyword(line, "vt")) != NULL)
        return read_numbers(r, &at, 2, r->m->texture_mm[r->m->n_texture++], err);
    return STATUS_OK;
}

/* Statements beside the surface, and surfaces that are no polygons. */
static status note_statement(const struct obj_reader *r, const char *line, struct error *err)
{
    static const struct {
        const char *keyword, *name, *reason;
    } known[] = {
        {"vn", "normals", "they are computed from the triangles"},
        {"usemtl", "material", "the cloth of the job takes its place"},
        {"mtllib", "material library", "the cloth of the job takes its place"},
        {"l", "lines", "only faces carry cloth"},
        {"p", "points", "only faces carry cloth"},
    };
    static const char *const free_form[] = {"surf", "curv", "curv2", "cstype", "fo"};
    for (size_t i = 0; i < sizeof free_form / sizeof *free_form; i++)
        if (after_keyword(line, free_form[i]) != NULL)
            return at_line(r, "it is of a curved surface or an obsolete face; save the mesh as polygons", err);
    for (size_t i = 0; i < sizeof known / sizeof *known; i++) {
        const char *value = after_keyword(line, known[i].keyword);
        if (value == NULL || r->ledger == NULL) continue;
        value = skip_blanks(value);
        if (file_ledger_find(r->ledger, known[i].name) == NULL)
            file_ledger_add(r->ledger, known[i].name, known[i].reason, "%s", value[0] != '\0' ? value : "stated");
    }
    return STATUS_OK;
}

/* The second pass: faces may name points of later lines. */
static status read_faces(struct obj_reader *r, const char *line, struct error *err)
{
    const char *at;
    line = skip_blanks(line);
    r->n_position += after_keyword(line, "v") != NULL;
    r->n_texture += after_keyword(line, "vt") != NULL;
    if ((at = after_keyword(line, "f")) != NULL) return read_face(r, at, err);
    return note_statement(r, line, err);
}

static status read_lines(struct obj_reader *r, char *text,
                         status (*read)(struct obj_reader *r, const char *line, struct error *err), struct error *err)
{
    status s = STATUS_OK;
    r->line = 1;
    while (text != NULL && s == STATUS_OK) {
        char *end = strchr(text, '\n');
        if (end != NULL) *end = '\0';
        s = read(r, text, err);
        r->line += 1 + count(text, CONTINUED);
        if (end != NULL) *end = '\n';
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

/* Checks that the file is text, and returns it after a byte order mark. */
static status find_text(const char *name, char *data, size_t n_bytes, char **text, struct error *err)
{
    *text = strncmp(data, "\xef\xbb\xbf", 3) == 0 ? data + 3 : data;
    if (memchr(data, '\0', n_bytes) != NULL)
        return error_set(err, STATUS_FORMAT, "cannot use mesh '%s': it is no text, or text in UTF-16: save it as UTF-8",
                         name);
    return STATUS_OK;
}

status mesh_read_obj_ledger(const char *path, double scale_mm, struct mesh *m, struct file_ledger *ledger,
                            struct error *err)
{
    char *data = NULL, *text = NULL;
    size_t n_bytes = 0;
    struct obj_reader r = {.name = path_file_name(path), .scale_mm = scale_mm, .m = m, .ledger = ledger};
    reading_note_set("OBJ mesh", path);
    status s = file_read_all(path, FILE_LIMIT_BYTES, &data, &n_bytes, err);
    memset(m, 0, sizeof *m);
    if (s == STATUS_OK) s = find_text(r.name, data, n_bytes, &text, err);
    if (s != STATUS_OK) goto out;
    simplify(text);
    /* a line holds one point at most, and a corner of a triangle has a slash */
    size_t n_line = count(text, '\n') + 1, n_corner = count(text, '/');
    s = mesh_new(m, n_line, n_line, n_corner < MESH_MAX_TRIANGLE ? n_corner : MESH_MAX_TRIANGLE, err);
    m->n_position = m->n_texture = m->n_triangle = 0;
    if (s == STATUS_OK) s = read_lines(&r, text, read_points, err);
    if (s == STATUS_OK) s = read_lines(&r, text, read_faces, err);
    if (s == STATUS_OK) s = weld(m, err);
    if (s == STATUS_OK) s = mesh_check(m, err);
    if (s != STATUS_OK) mesh_release(m);
out:
    reading_note_set(NULL, NULL);
    free(data);
    return s;
}

status mesh_read_obj(const char *path, double scale_mm, struct mesh *m, struct error *err)
{
    return mesh_read_obj_ledger(path, scale_mm, m, NULL, err);
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
