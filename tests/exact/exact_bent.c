#include "tests/exact/exact_bent.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { MOST_PIECES = 1024 };

static double at_plane(const double p[4], const double x[3]) { return p[0] * x[0] + p[1] * x[1] + p[2] * x[2] + p[3]; }

/* Inverse of a matrix by cofactors; its determinant. */
static double invert(double m[3][3], double out[3][3])
{
    double det = 0.0;
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            out[j][i] = m[(i + 1) % 3][(j + 1) % 3] * m[(i + 2) % 3][(j + 2) % 3] -
                        m[(i + 1) % 3][(j + 2) % 3] * m[(i + 2) % 3][(j + 1) % 3];
    for (int j = 0; j < 3; j++) det += m[0][j] * out[j][0];
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) out[i][j] /= det;
    return det;
}

static void fill_cell(struct exact_cell *c, double world[4][3], double cloth[4][3])
{
    double w[3][3], f[3][3], w_inverse[3][3], f_inverse[3][3]; /* columns: edges from corner 0 */
    for (int a = 0; a < 3; a++)
        for (int k = 0; k < 3; k++) {
            w[a][k] = world[k + 1][a] - world[0][a];
            f[a][k] = cloth[k + 1][a] - cloth[0][a];
        }
    c->scale = cbrt(invert(w, w_inverse) / invert(f, f_inverse));
    for (int a = 0; a < 3; a++)
        for (int j = 0; j < 3; j++) {
            c->to_cloth[a][j] = c->to_world[a][j] = 0.0;
            for (int k = 0; k < 3; k++) {
                c->to_cloth[a][j] += f[a][k] * w_inverse[k][j];
                c->to_world[a][j] += w[a][k] * f_inverse[k][j];
            }
        }
    for (int a = 0; a < 3; a++) {
        c->to_cloth[a][3] = 0.0;
        c->to_cloth[a][3] = cloth[0][a] - at_plane(c->to_cloth[a], world[0]);
    }
    memcpy(c->plane[0], (const double[4]){0.0, 0.0, 0.0, 1.0}, sizeof c->plane[0]);
    for (int k = 1; k < 4; k++) {
        memcpy(c->plane[k], w_inverse[k - 1], sizeof w_inverse[0]);
        c->plane[k][3] = 0.0;
        c->plane[k][3] = -at_plane(c->plane[k], world[0]);
        for (int j = 0; j < 4; j++) c->plane[0][j] -= c->plane[k][j];
    }
}

/* The three tetrahedra over a triangle. Its corners go by the numbers of their positions, so that the sides of
 * neighbouring prisms are cut alike. */
static void add_triangle(struct exact_bent *b, const struct mesh *m, double (*normal)[3], size_t i, const double z[2])
{
    static const int cut[3][4][2] = {
        {{0, 0}, {1, 0}, {2, 0}, {2, 1}}, {{0, 0}, {1, 0}, {1, 1}, {2, 1}}, {{0, 0}, {0, 1}, {1, 1}, {2, 1}}};
    const struct mesh_triangle *t = &m->triangle[i];
    int order[3] = {0, 1, 2};
    for (int k = 0; k < 3; k++)
        for (int j = k + 1; j < 3; j++)
            if (t->position[order[j]] < t->position[order[k]]) {
                const int other = order[k];
                order[k] = order[j];
                order[j] = other;
            }
    for (int part = 0; part < 3; part++) {
        struct exact_cell *c = &b->cell[b->n_cell++];
        double world[4][3], cloth[4][3];
        for (int k = 0; k < 4; k++) {
            const int corner = order[cut[part][k][0]];
            const double height = z[cut[part][k][1]];
            const uint32_t p = t->position[corner];
            for (int a = 0; a < 3; a++) {
                world[k][a] = m->position_mm[p][a] + height * normal[p][a];
                cloth[k][a] = a < 2 ? m->texture_mm[t->texture[corner]][a] : height;
                b->low_mm[a] = fmin(b->low_mm[a], world[k][a]);
                b->high_mm[a] = fmax(b->high_mm[a], world[k][a]);
            }
            c->bottom[k] = part == 0 && k == 3; /* the face opposite to the one upper corner */
        }
        fill_cell(c, world, cloth);
    }
}

bool exact_bent_init(struct exact_bent *b, const struct mesh *m, double up_mm, double down_mm)
{
    struct error err;
    const double z[2] = {-down_mm, up_mm};
    memset(b, 0, sizeof *b);
    for (int a = 0; a < 3; a++) {
        b->low_mm[a] = INFINITY;
        b->high_mm[a] = -INFINITY;
    }
    double(*normal)[3] = malloc((m->n_position + 1) * sizeof *normal);
    b->cell = malloc((3 * m->n_triangle + 1) * sizeof *b->cell);
    const bool ok = normal != NULL && b->cell != NULL && mesh_normals(m, normal, &err) == STATUS_OK;
    for (size_t i = 0; i < m->n_triangle && ok; i++) add_triangle(b, m, normal, i, z);
    free(normal);
    return ok;
}

void exact_bent_release(struct exact_bent *b)
{
    free(b->cell);
    memset(b, 0, sizeof *b);
}

/* The part of a ray within a cell, and the faces through which it comes and goes; -1: it starts there. */
struct piece {
    double t[2];
    int face[2];
    uint32_t i_cell;
};

static bool clip(const struct exact_cell *c, const double o[3], const double d[3], struct piece *p)
{
    p->t[0] = 0.0;
    p->t[1] = INFINITY;
    p->face[0] = p->face[1] = -1;
    for (int k = 0; k < 4; k++) {
        const double *n = c->plane[k], at = at_plane(n, o), rate = n[0] * d[0] + n[1] * d[1] + n[2] * d[2];
        if (rate == 0.0) {
            if (at < 0.0) return false;
            continue;
        }
        const double t = -at / rate;
        const int side = rate < 0.0;
        if (side ? t < p->t[1] : t > p->t[0]) {
            p->t[side] = t;
            p->face[side] = k;
        }
        if (p->t[0] >= p->t[1]) return false;
    }
    return true;
}

static int compare(const void *pa, const void *pb)
{
    const struct piece *a = pa, *b = pb;
    return a->t[0] < b->t[0] ? -1 : a->t[0] > b->t[0];
}

enum exact_end exact_bent_walk(const struct exact_bent *b, const struct capsule_cloth *c, struct capsule_walk *w,
                               const double o[3], const double d[3], bool sheet, struct capsule_entrance *entrance,
                               uint32_t *i_cell)
{
    struct piece piece[MOST_PIECES];
    size_t n = 0;
    for (size_t i = 0; i < b->n_cell && n < MOST_PIECES; i++)
        if (clip(&b->cell[i], o, d, &piece[n])) piece[n++].i_cell = (uint32_t)i;
    qsort(piece, n, sizeof *piece, compare);
    for (size_t i = 0; i < n; i++) {
        const struct piece *p = &piece[i];
        const struct exact_cell *cell = &b->cell[p->i_cell];
        double flat_o[3], flat_d[3];
        if (sheet && p->face[0] >= 0 && cell->bottom[p->face[0]]) return EXACT_ON_SHEET;
        exact_cell_to_cloth(cell, o, flat_o);
        for (int a = 0; a < 3; a++)
            flat_d[a] = cell->to_cloth[a][0] * d[0] + cell->to_cloth[a][1] * d[1] + cell->to_cloth[a][2] * d[2];
        *i_cell = p->i_cell;
        if (capsule_walk_piece(w, c, flat_o, flat_d, p->t[0], p->t[1], entrance)) return EXACT_MET;
        if (sheet && p->face[1] >= 0 && cell->bottom[p->face[1]]) return EXACT_ON_SHEET;
    }
    return EXACT_LEFT;
}

uint32_t exact_bent_cell(const struct exact_bent *b, const double x[3])
{
    uint32_t best = 0;
    double most = -INFINITY;
    for (size_t i = 0; i < b->n_cell; i++) {
        double least = INFINITY;
        for (int k = 0; k < 4; k++) least = fmin(least, at_plane(b->cell[i].plane[k], x));
        if (least <= most) continue;
        most = least;
        best = (uint32_t)i;
    }
    return best;
}

void exact_cell_to_cloth(const struct exact_cell *c, const double x[3], double flat[3])
{
    for (int a = 0; a < 3; a++) flat[a] = at_plane(c->to_cloth[a], x);
}

void exact_cell_move(const struct exact_cell *c, const double flat_way[3], double x[3])
{
    for (int a = 0; a < 3; a++)
        x[a] += c->to_world[a][0] * flat_way[0] + c->to_world[a][1] * flat_way[1] + c->to_world[a][2] * flat_way[2];
}
