#include "renderer/mesh/shell.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* What a cell is made from: its corners here and in the flat cloth. */
struct corners {
    double world[4][3], cloth[4][3];
};

/* A face of a cell, to find the cell on its other side, which on a seam of the texture has another place of the cloth:
 * nodes in ascending order. */
struct face {
    uint32_t node[3], i_cell;
    uint8_t k;
};

struct shell_work {
    const struct mesh *m;
    double (*normal)[3];
    double up_mm, down_mm; /* from the mesh to both ends */
    struct face *face;     /* four of each cell */
};

void shell_release(struct shell *s)
{
    free(s->cell);
    free(s->corner);
    free(s->node_mm);
    free(s->outer);
    free(s->outer_cell);
    free(s->outer_bottom);
    memset(s, 0, sizeof *s);
}

/* Rows of the inverse of a matrix; its determinant, 0 when there is none. */
static double invert(double a[3][3], double out[3][3])
{
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            int r = (j + 1) % 3, s = (j + 2) % 3, c = (i + 1) % 3, d = (i + 2) % 3;
            out[i][j] = a[r][c] * a[s][d] - a[r][d] * a[s][c];
        }
    double det = a[0][0] * out[0][0] + a[0][1] * out[1][0] + a[0][2] * out[2][0];
    for (int i = 0; i < 3 && det != 0.0; i++)
        for (int j = 0; j < 3; j++) out[i][j] /= det;
    return det;
}

/* Columns: the edges from corner 3. */
static void edges_of(double corner[4][3], double edge[3][3])
{
    for (int a = 0; a < 3; a++)
        for (int k = 0; k < 3; k++) edge[a][k] = corner[k][a] - corner[3][a];
}

/* False when the cell has no volume or is turned inside out. */
static bool fill_cell(struct corners *c, struct shell_cell *cell)
{
    double world[3][3], cloth[3][3], inverse[3][3], cloth_inverse[3][3];
    edges_of(c->world, world);
    edges_of(c->cloth, cloth);
    double det = invert(world, inverse), cloth_det = invert(cloth, cloth_inverse);
    if (!(det / cloth_det > 1e-6)) return false;
    cell->scale = (float)cbrt(det / cloth_det);
    double sum[4] = {0.0, 0.0, 0.0, 1.0};
    for (int k = 0; k < 3; k++) {
        double at = 0.0;
        for (int a = 0; a < 3; a++) at += inverse[k][a] * c->world[3][a];
        for (int a = 0; a < 3; a++) cell->plane[k][a] = inverse[k][a];
        cell->plane[k][3] = -at;
        for (int a = 0; a < 4; a++) sum[a] -= cell->plane[k][a];
    }
    memcpy(cell->plane[3], sum, sizeof sum);
    for (int a = 0; a < 3; a++) {
        for (int j = 0; j < 4; j++) {
            cell->to_cloth[a][j] = 0.0;
            for (int k = 0; k < 4; k++) cell->to_cloth[a][j] += c->cloth[k][a] * cell->plane[k][j];
        }
        for (int j = 0; j < 3; j++) {
            double x = 0.0;
            for (int k = 0; k < 3; k++) x += world[a][k] * cloth_inverse[k][j];
            cell->to_world[a][j] = (float)x;
        }
    }
    return true;
}

/* The corners of a triangle in ascending order of their positions, and the twelve corners of its three cells: of each,
 * which of the three and whether it is an upper end. */
static const uint8_t cut[3][4][2] = {
    {{0, 0}, {1, 0}, {2, 0}, {2, 1}}, {{0, 0}, {1, 0}, {2, 1}, {1, 1}}, {{0, 0}, {1, 1}, {2, 1}, {0, 1}}};

static void sort_corners(const struct mesh_triangle *t, int order[3])
{
    for (int k = 0; k < 3; k++) order[k] = k;
    for (int i = 0; i < 2; i++)
        for (int k = 0; k < 2 - i; k++)
            if (t->position[order[k]] > t->position[order[k + 1]]) {
                int swap = order[k];
                order[k] = order[k + 1];
                order[k + 1] = swap;
            }
}

static void node_position(const struct shell_work *w, uint32_t node, double out[3])
{
    double along = node % 2 == 1 ? w->up_mm : -w->down_mm;
    for (int a = 0; a < 3; a++) out[a] = w->m->position_mm[node / 2][a] + along * w->normal[node / 2][a];
}

static void add_faces(struct shell_work *w, struct shell *s, uint32_t i_cell)
{
    for (uint8_t k = 0; k < 4; k++) {
        struct face *f = &w->face[4 * i_cell + k];
        f->i_cell = i_cell;
        f->k = k;
        int n = 0;
        bool low = true;
        for (int j = 0; j < 4; j++)
            if (j != k) {
                f->node[n++] = s->corner[i_cell][j];
                low = low && s->corner[i_cell][j] % 2 == 0;
            }
        if (low) s->cell[i_cell].bottom |= (uint8_t)(1u << k);
        for (int i = 0; i < 2; i++)
            for (int j = 0; j < 2 - i; j++)
                if (f->node[j] > f->node[j + 1]) {
                    uint32_t node = f->node[j];
                    f->node[j] = f->node[j + 1];
                    f->node[j + 1] = node;
                }
    }
}

static status add_triangle(struct shell_work *w, struct shell *s, size_t i, struct error *err)
{
    const struct mesh_triangle *t = &w->m->triangle[i];
    int order[3];
    sort_corners(t, order);
    for (size_t c = 0; c < 3; c++) {
        uint32_t i_cell = (uint32_t)(3 * i + c);
        struct corners at;
        for (int k = 0; k < 4; k++) {
            int corner = order[cut[c][k][0]], up = cut[c][k][1];
            s->corner[i_cell][k] = 2 * t->position[corner] + (uint32_t)up;
            node_position(w, s->corner[i_cell][k], at.world[k]);
            for (int a = 0; a < 2; a++) at.cloth[k][a] = w->m->texture_mm[t->texture[corner]][a];
            at.cloth[k][2] = up ? w->up_mm : -w->down_mm;
        }
        if (!fill_cell(&at, &s->cell[i_cell]))
            return error_set(err, STATUS_INVALID,
                             "the cloth cannot be laid on triangle %zu of the mesh: over its thickness of %g mm the "
                             "surface folds over itself, so it must bend less or the cloth must be thinner",
                             i + 1, w->down_mm - w->up_mm);
        add_faces(w, s, i_cell);
    }
    return STATUS_OK;
}

/* ---- neighbours ---- */

static int compare_faces(const void *pa, const void *pb)
{
    const struct face *a = pa, *b = pb;
    int c = memcmp(a->node, b->node, sizeof a->node);
    if (c != 0) return c;
    return a->i_cell < b->i_cell ? -1 : a->i_cell > b->i_cell;
}

static bool same_face(const struct face *a, const struct face *b)
{
    return memcmp(a->node, b->node, sizeof a->node) == 0;
}

static void add_outer(struct shell *s, const struct shell_work *w, const struct face *f)
{
    double p[4][3], u[3], v[3], n[3], inwards = 0.0;
    uint32_t node[3];
    int j = 0;
    for (int k = 0; k < 4; k++)
        if (k != f->k) node[j++] = s->corner[f->i_cell][k];
    for (int k = 0; k < 3; k++) node_position(w, node[k], p[k]);
    node_position(w, s->corner[f->i_cell][f->k], p[3]);
    for (int a = 0; a < 3; a++) {
        u[a] = p[1][a] - p[0][a];
        v[a] = p[2][a] - p[0][a];
    }
    for (int a = 0; a < 3; a++) {
        int b = (a + 1) % 3, c = (a + 2) % 3;
        n[a] = u[b] * v[c] - u[c] * v[b];
        inwards += n[a] * (p[3][a] - p[0][a]);
    }
    size_t i = s->n_outer++;
    s->outer[i][0] = node[0];
    s->outer[i][1] = inwards > 0.0 ? node[2] : node[1];
    s->outer[i][2] = inwards > 0.0 ? node[1] : node[2];
    s->outer_cell[i] = f->i_cell;
    s->outer_bottom[i] = (s->cell[f->i_cell].bottom >> f->k & 1) != 0;
}

static void find_neighbours(struct shell_work *w, struct shell *s)
{
    size_t n = 4 * s->n_cell;
    qsort(w->face, n, sizeof *w->face, compare_faces);
    for (size_t i = 0; i < n;) {
        const struct face *f = &w->face[i], *g = i + 1 < n && same_face(f, f + 1) ? f + 1 : NULL;
        s->cell[f->i_cell].neighbour[f->k] = g != NULL ? g->i_cell : SHELL_NONE;
        if (g != NULL)
            s->cell[g->i_cell].neighbour[g->k] = f->i_cell;
        else
            add_outer(s, w, f);
        i += g != NULL ? 2 : 1;
    }
}

static void place_nodes(const struct shell_work *w, struct shell *s)
{
    for (int a = 0; a < 3; a++) {
        s->low_mm[a] = INFINITY;
        s->high_mm[a] = -INFINITY;
    }
    for (size_t i = 0; i < s->n_node; i++) {
        double p[3];
        node_position(w, (uint32_t)i, p);
        for (int a = 0; a < 3; a++) {
            s->node_mm[i][a] = (float)p[a];
            s->low_mm[a] = fmin(s->low_mm[a], p[a]);
            s->high_mm[a] = fmax(s->high_mm[a], p[a]);
        }
    }
}

static bool allocate(const struct mesh *m, struct shell_work *w, struct shell *s)
{
    s->n_cell = 3 * m->n_triangle;
    s->n_node = 2 * m->n_position;
    w->normal = malloc((m->n_position + 1) * sizeof *w->normal);
    w->face = malloc((4 * s->n_cell + 1) * sizeof *w->face);
    s->cell = calloc(s->n_cell + 1, sizeof *s->cell);
    s->corner = malloc((s->n_cell + 1) * sizeof *s->corner);
    s->node_mm = malloc((s->n_node + 1) * sizeof *s->node_mm);
    s->outer = malloc((4 * s->n_cell + 1) * sizeof *s->outer);
    s->outer_cell = malloc((4 * s->n_cell + 1) * sizeof *s->outer_cell);
    s->outer_bottom = malloc(4 * s->n_cell + 1);
    return w->normal != NULL && w->face != NULL && s->cell != NULL && s->corner != NULL && s->node_mm != NULL &&
           s->outer != NULL && s->outer_cell != NULL && s->outer_bottom != NULL;
}

status shell_new(const struct mesh *m, double thickness_mm, double margin_mm, struct shell *s, struct error *err)
{
    struct shell_work w = {.m = m, .up_mm = margin_mm, .down_mm = thickness_mm + margin_mm};
    memset(s, 0, sizeof *s);
    status st = allocate(m, &w, s) ? mesh_normals(m, w.normal, err)
                                   : error_set(err, STATUS_NO_MEMORY,
                                               "cannot bend the cloth over %zu triangles: out "
                                               "of memory",
                                               m->n_triangle);
    for (size_t i = 0; i < m->n_triangle && st == STATUS_OK; i++) st = add_triangle(&w, s, i, err);
    if (st == STATUS_OK) {
        place_nodes(&w, s);
        find_neighbours(&w, s);
    } else
        shell_release(s);
    free(w.normal);
    free(w.face);
    return st;
}
