#include "renderer/mesh/mesh.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

void mesh_release(struct mesh *m)
{
    free(m->position_mm);
    free(m->texture_mm);
    free(m->triangle);
    memset(m, 0, sizeof *m);
}

status mesh_new(struct mesh *m, size_t n_position, size_t n_texture, size_t n_triangle, struct error *err)
{
    *m = (struct mesh){.n_position = n_position, .n_texture = n_texture, .n_triangle = n_triangle};
    m->position_mm = calloc(n_position + 1, sizeof *m->position_mm);
    m->texture_mm = calloc(n_texture + 1, sizeof *m->texture_mm);
    m->triangle = calloc(n_triangle + 1, sizeof *m->triangle);
    if (m->position_mm != NULL && m->texture_mm != NULL && m->triangle != NULL) return STATUS_OK;
    mesh_release(m);
    return error_set(err, STATUS_NO_MEMORY, "cannot make a mesh of %zu triangles: out of memory", n_triangle);
}

static void subtract(const double a[3], const double b[3], double out[3])
{
    for (int k = 0; k < 3; k++) out[k] = a[k] - b[k];
}

static void cross(const double a[3], const double b[3], double out[3])
{
    out[0] = a[1] * b[2] - a[2] * b[1];
    out[1] = a[2] * b[0] - a[0] * b[2];
    out[2] = a[0] * b[1] - a[1] * b[0];
}

static double dot(const double a[3], const double b[3]) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

/* ---- checks ---- */

static bool numbers_are_finite(const struct mesh *m)
{
    double sum = 0.0;
    for (size_t i = 0; i < m->n_position; i++) sum += 0.0 * dot(m->position_mm[i], m->position_mm[i]);
    for (size_t i = 0; i < m->n_texture; i++) sum += 0.0 * (m->texture_mm[i][0] + m->texture_mm[i][1]);
    return sum == 0.0;
}

static status check_triangle(const struct mesh *m, size_t i, struct error *err)
{
    const struct mesh_triangle *t = &m->triangle[i];
    for (int k = 0; k < 3; k++)
        if (t->position[k] >= m->n_position || t->texture[k] >= m->n_texture)
            return error_set(err, STATUS_INVALID, "triangle %zu of the mesh names a point that it does not have",
                             i + 1);
    double edge[2][3], normal[3], longest = 0.0, uv[2][2];
    for (int e = 0; e < 2; e++) {
        subtract(m->position_mm[t->position[e + 1]], m->position_mm[t->position[0]], edge[e]);
        longest = fmax(longest, dot(edge[e], edge[e]));
        for (int a = 0; a < 2; a++) uv[e][a] = m->texture_mm[t->texture[e + 1]][a] - m->texture_mm[t->texture[0]][a];
    }
    cross(edge[0], edge[1], normal);
    if (!(sqrt(dot(normal, normal)) > 1e-9 * longest))
        return error_set(err, STATUS_INVALID, "triangle %zu of the mesh has no area", i + 1);
    double area = uv[0][0] * uv[1][1] - uv[0][1] * uv[1][0], size = 0.0;
    for (int e = 0; e < 2; e++) size = fmax(size, uv[e][0] * uv[e][0] + uv[e][1] * uv[e][1]);
    if (!(fabs(area) > 1e-9 * size))
        return error_set(err, STATUS_INVALID, "triangle %zu of the mesh has no area in its texture coordinates", i + 1);
    if (area < 0.0)
        return error_set(err, STATUS_INVALID,
                         "triangle %zu of the mesh is mirrored: its corners turn one way on the surface and the other "
                         "way in its texture coordinates",
                         i + 1);
    return STATUS_OK;
}

struct half_edge {
    uint32_t from, to;
    size_t i_triangle;
};

static int compare_half_edges(const void *pa, const void *pb)
{
    const struct half_edge *a = pa, *b = pb;
    if (a->from != b->from) return a->from < b->from ? -1 : 1;
    if (a->to != b->to) return a->to < b->to ? -1 : 1;
    return a->i_triangle < b->i_triangle ? -1 : a->i_triangle > b->i_triangle;
}

/* On a surface that can be thickened each direction of an edge occurs once. */
static status check_edges(const struct mesh *m, struct error *err)
{
    struct half_edge *edge = malloc(3 * m->n_triangle * sizeof *edge);
    if (edge == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot check a mesh: out of memory");
    for (size_t i = 0; i < m->n_triangle; i++)
        for (size_t k = 0; k < 3; k++)
            edge[3 * i + k] = (struct half_edge){m->triangle[i].position[k], m->triangle[i].position[(k + 1) % 3], i};
    qsort(edge, 3 * m->n_triangle, sizeof *edge, compare_half_edges);
    status s = STATUS_OK;
    for (size_t i = 1; i < 3 * m->n_triangle && s == STATUS_OK; i++)
        if (edge[i].from == edge[i - 1].from && edge[i].to == edge[i - 1].to)
            s = error_set(err, STATUS_INVALID,
                          "triangles %zu and %zu of the mesh run along an edge in the same direction: more than two "
                          "triangles meet there, or two neighbours turn differently",
                          edge[i - 1].i_triangle + 1, edge[i].i_triangle + 1);
    free(edge);
    return s;
}

status mesh_check(const struct mesh *m, struct error *err)
{
    if (m->n_triangle == 0) return error_set(err, STATUS_INVALID, "the mesh has no triangles");
    if (!numbers_are_finite(m)) return error_set(err, STATUS_INVALID, "the mesh has a number that is not finite");
    status s = STATUS_OK;
    for (size_t i = 0; i < m->n_triangle && s == STATUS_OK; i++) s = check_triangle(m, i, err);
    return s == STATUS_OK ? check_edges(m, err) : s;
}

/* ---- stretch ---- */

/* Adds one triangle: surface and texture areas, and over its surface the squared derivatives of position by u and v. */
static void add_stretch(const struct mesh *m, const struct mesh_triangle *t, double area[2], double square[2])
{
    double edge[2][3], normal[3], uv[2][2];
    for (int e = 0; e < 2; e++) {
        subtract(m->position_mm[t->position[e + 1]], m->position_mm[t->position[0]], edge[e]);
        for (int a = 0; a < 2; a++) uv[e][a] = m->texture_mm[t->texture[e + 1]][a] - m->texture_mm[t->texture[0]][a];
    }
    cross(edge[0], edge[1], normal);
    const double det = uv[0][0] * uv[1][1] - uv[0][1] * uv[1][0], surface = 0.5 * sqrt(dot(normal, normal));
    area[0] += surface;
    area[1] += 0.5 * fabs(det);
    for (int a = 0; a < 2; a++) {
        double along[3];
        const double sign = a == 0 ? 1.0 : -1.0;
        for (int k = 0; k < 3; k++) along[k] = sign * (edge[0][k] * uv[1][1 - a] - edge[1][k] * uv[0][1 - a]) / det;
        square[a] += surface * dot(along, along);
    }
}

struct mesh_stretch mesh_stretch(const struct mesh *m)
{
    double area[2] = {0, 0}, square[2] = {0, 0};
    for (size_t i = 0; i < m->n_triangle; i++) add_stretch(m, &m->triangle[i], area, square);
    return (struct mesh_stretch){area[0] / area[1], {sqrt(square[0] / area[0]), sqrt(square[1] / area[0])}};
}

/* ---- normals ---- */

static void add_corner(const struct mesh *m, const struct mesh_triangle *t, int k, double (*normal)[3])
{
    const double *p = m->position_mm[t->position[k]];
    double a[3], b[3], n[3];
    subtract(m->position_mm[t->position[(k + 1) % 3]], p, a);
    subtract(m->position_mm[t->position[(k + 2) % 3]], p, b);
    cross(a, b, n);
    double length = sqrt(dot(n, n)), angle = atan2(length, dot(a, b));
    for (int c = 0; c < 3; c++) normal[t->position[k]][c] += angle * n[c] / length;
}

status mesh_normals(const struct mesh *m, double (*normal)[3], struct error *err)
{
    memset(normal, 0, m->n_position * sizeof *normal);
    for (size_t i = 0; i < m->n_triangle; i++)
        for (int k = 0; k < 3; k++) add_corner(m, &m->triangle[i], k, normal);
    for (size_t i = 0; i < m->n_triangle; i++)
        for (int k = 0; k < 3; k++) {
            const double *n = normal[m->triangle[i].position[k]];
            if (!(dot(n, n) > 1e-6))
                return error_set(err, STATUS_INVALID, "the mesh has no upper side at a corner of triangle %zu", i + 1);
        }
    for (size_t i = 0; i < m->n_position; i++) {
        double length = sqrt(dot(normal[i], normal[i]));
        for (int c = 0; c < 3 && length > 0.0; c++) normal[i][c] /= length;
    }
    return STATUS_OK;
}
