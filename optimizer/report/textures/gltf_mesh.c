#include "optimizer/report/textures/gltf_mesh.h"

#include "optimizer/report/export/twin_result.h"
#include "renderer/mesh/mesh_drape.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const double mm = 1e-3, ball_radius_mm = 20.0;
enum { STEP = 2, BALL_COLUMNS = 128, BALL_ROWS = 64 };

/* A grid of vertices, rows along the warp. */
struct grid {
    size_t n_row, n_column;
};

static bool allocate(struct gltf_mesh *m, struct grid n)
{
    m->n_vertex = n.n_row * n.n_column;
    m->position_m = calloc(3 * m->n_vertex, sizeof(float));
    m->normal = calloc(3 * m->n_vertex, sizeof(float));
    m->tangent = calloc(4 * m->n_vertex, sizeof(float));
    m->texture = calloc(2 * m->n_vertex, sizeof(float));
    m->corner = calloc(6 * (n.n_row - 1) * (n.n_column - 1), sizeof(uint16_t));
    return m->position_m && m->normal && m->tangent && m->texture && m->corner;
}

static void make_unit(double v[3])
{
    const double length = sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
    for (int a = 0; a < 3; a++) v[a] /= fmax(length, 1e-12);
}

/* From z up to y up. */
static void put(float *out, const double v[3], double scale)
{
    out[0] = (float)(scale * v[0]);
    out[1] = (float)(scale * v[2]);
    out[2] = (float)(-scale * v[1]);
}

/* weft: direction of the weft; it is made perpendicular to the normal. cloth_mm: place on the cloth. */
static void put_vertex(struct gltf_mesh *m, size_t i, const double p_mm[3], const double normal[3],
                       const double weft[3], const double cloth_mm[2], const double tile_mm[2])
{
    double t[3];
    const double out = weft[0] * normal[0] + weft[1] * normal[1] + weft[2] * normal[2];
    for (int a = 0; a < 3; a++) t[a] = weft[a] - out * normal[a];
    make_unit(t);
    put(m->position_m + 3 * i, p_mm, mm);
    put(m->normal + 3 * i, normal, 1.0);
    put(m->tangent + 4 * i, t, 1.0);
    m->tangent[4 * i + 3] = 1.0f;
    m->texture[2 * i] = (float)(0.5 + cloth_mm[0] / tile_mm[0]);
    m->texture[2 * i + 1] = (float)(0.5 - cloth_mm[1] / tile_mm[1]);
}

/* Triangles of all cells, without those whose edge is a pole where a ball has them. */
static void put_corners(struct gltf_mesh *m, struct grid n, bool has_poles)
{
    for (size_t j = 0; j + 1 < n.n_row; j++)
        for (size_t i = 0; i + 1 < n.n_column; i++) {
            const size_t a = j * n.n_column + i, b = a + n.n_column;
            const size_t cell[2][3] = {{a, a + 1, b + 1}, {a, b + 1, b}};
            for (int k = 0; k < 2; k++) {
                if (has_poles && ((k == 0 && j == 0) || (k == 1 && j + 2 == n.n_row))) continue;
                for (int c = 0; c < 3; c++) m->corner[m->n_corner++] = (uint16_t)cell[k][c];
            }
        }
}

static status no_memory(struct error *err)
{
    return error_set(err, STATUS_NO_MEMORY, "cannot make a mesh for glTF: out of memory");
}

static void weft_at(const struct mesh *d, size_t side, size_t j, size_t i, double out[3])
{
    const double *left = d->position_mm[j * side + (i > 0 ? i - 1 : i)],
                 *right = d->position_mm[j * side + (i + 1 < side ? i + 1 : i)];
    for (int a = 0; a < 3; a++) out[a] = right[a] - left[a];
}

status gltf_mesh_drape(const double tile_mm[2], const struct progress *progress, struct gltf_mesh *m, struct error *err)
{
    struct mesh d = {0};
    *m = (struct gltf_mesh){0};
    status s = mesh_drape(TWIN_DRAPE_SIZE_MM, TWIN_DRAPE_RADIUS_MM, progress, &d, err);
    if (s != STATUS_OK) return s;
    const size_t side = (size_t)lround(sqrt((double)d.n_position));
    const struct grid n = {(side - 1) / STEP + 1, (side - 1) / STEP + 1};
    double(*normal)[3] = malloc(d.n_position * sizeof *normal), weft[3];
    if (normal == NULL || !allocate(m, n)) s = no_memory(err);
    if (s == STATUS_OK) s = mesh_normals(&d, normal, err);
    for (size_t k = 0; k < m->n_vertex && s == STATUS_OK; k++) {
        const size_t j = k / n.n_column * STEP, i = k % n.n_column * STEP, at = j * side + i;
        weft_at(&d, side, j, i, weft);
        put_vertex(m, k, d.position_mm[at], normal[at], weft, d.texture_mm[at], tile_mm);
    }
    if (s == STATUS_OK) put_corners(m, n, false);
    free(normal);
    mesh_release(&d);
    return s;
}

status gltf_mesh_ball(const double tile_mm[2], struct gltf_mesh *m, struct error *err)
{
    const struct grid n = {BALL_ROWS + 1, BALL_COLUMNS + 1};
    const double repeats = fmax(round(2.0 * M_PI * ball_radius_mm / tile_mm[0]), 1.0),
                 radius_mm = repeats * tile_mm[0] / (2.0 * M_PI);
    *m = (struct gltf_mesh){0};
    if (!allocate(m, n)) return no_memory(err);
    for (size_t k = 0; k < m->n_vertex; k++) {
        const double phi = 2.0 * M_PI * (double)(k % n.n_column) / BALL_COLUMNS,
                     height = M_PI * ((double)(k / n.n_column) / BALL_ROWS - 0.5);
        const double normal[3] = {cos(phi) * cos(height), sin(phi) * cos(height), sin(height)},
                     weft[3] = {-sin(phi), cos(phi), 0.0}, cloth_mm[2] = {radius_mm * phi, radius_mm * height};
        const double p_mm[3] = {radius_mm * normal[0], radius_mm * normal[1], radius_mm * normal[2]};
        put_vertex(m, k, p_mm, normal, weft, cloth_mm, tile_mm);
    }
    put_corners(m, n, true);
    return STATUS_OK;
}

void gltf_mesh_release(struct gltf_mesh *m)
{
    free(m->position_m);
    free(m->normal);
    free(m->tangent);
    free(m->texture);
    free(m->corner);
    *m = (struct gltf_mesh){0};
}
