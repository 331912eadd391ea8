#include "renderer/glint/glint_triangles.h"

#include "renderer/glint/triangle_gaussian.h"

#include <math.h>
#include <stdlib.h>

static const double reach = 5;

/* Normals at the corners of the cells of texel (x, y): (n_split + 1)^2, row-major. In a smooth map the texel reaches
 * from its middle to the next one's. */
static void corners(const struct glint_triangles *t, size_t x, size_t y, float corner[25][2])
{
    const size_t n = t->n_split + 1;
    for (size_t k = 0; k < n * n; k++) {
        const double share[2] = {(double)(k % n) / (double)t->n_split, (double)(k / n) / (double)t->n_split};
        const double place[2] = {(double)x + 0.5 + (t->map->is_flat ? 0 : share[0]),
                                 (double)y + 0.5 + (t->map->is_flat ? 0 : share[1])};
        glint_map_at(t->map, place, corner[k], NULL);
    }
}

static void bounds_add(struct glint_bounds *b, const float least[2], const float most[2])
{
    for (int a = 0; a < 2; a++) {
        b->least[a] = fminf(b->least[a], least[a]);
        b->most[a] = fmaxf(b->most[a], most[a]);
    }
}

status glint_triangles_make(const struct glint_map *m, size_t n_split, float roughness, struct glint_triangles *t,
                            struct error *err)
{
    *t = (struct glint_triangles){.map = m, .n_split = n_split, .roughness = roughness};
    for (size_t n = m->n;; n /= 2) {
        struct glint_bounds *level = malloc(n * n * sizeof *level);
        if (level == NULL) {
            glint_triangles_release(t);
            return error_set(err, STATUS_NO_MEMORY, "cannot make the triangles of a normal map: out of memory");
        }
        for (size_t k = 0; k < n * n; k++) level[k] = (struct glint_bounds){{2, 2}, {-2, -2}};
        if (n == m->n)
            for (size_t k = 0; k < n * n; k++) {
                float corner[25][2];
                corners(t, k % n, k / n, corner);
                for (size_t i = 0; i < (n_split + 1) * (n_split + 1); i++) bounds_add(&level[k], corner[i], corner[i]);
            }
        else
            for (size_t k = 0; k < 4 * n * n; k++) {
                const struct glint_bounds *from = &t->level[t->n_level - 1][k];
                bounds_add(&level[k / (2 * n) / 2 * n + k % (2 * n) / 2], from->least, from->most);
            }
        t->level[t->n_level++] = level;
        if (n == 1) return STATUS_OK;
    }
}

void glint_triangles_release(struct glint_triangles *t)
{
    for (size_t k = 0; k < t->n_level; k++) free(t->level[k]);
    t->n_level = 0;
}

/* A query in texels, with the rectangles of places and normals that count. */
struct tree_query {
    struct triangle_query gaussian;
    double least[2], most[2]; /* places */
    double normal_least[2], normal_most[2];
};

static double cell_integral(const struct tree_query *q, const double low[2], double width, const float *corner[4])
{
    double sum = 0;
    for (int k = 0; k < 2; k++) { /* at the low corner with legs up, and at the high corner with legs down */
        struct glint_triangle t;
        const float *const at[3] = {corner[3 * k], corner[k == 0 ? 1 : 2], corner[k == 0 ? 2 : 1]};
        bool near = true;
        for (int a = 0; a < 2; a++) {
            t.corner[a] = low[a] + k * width;
            t.leg[a] = k == 0 ? width : -width;
            double least = 2, most = -2;
            for (int i = 0; i < 3; i++) {
                t.normal[i][a] = (double)at[i][a];
                least = fmin(least, t.normal[i][a]);
                most = fmax(most, t.normal[i][a]);
            }
            near = near && least <= q->normal_most[a] && most >= q->normal_least[a];
        }
        if (near) sum += triangle_gaussian(&t, &q->gaussian);
    }
    return sum;
}

static double texel_integral(const struct glint_triangles *t, const struct tree_query *q, size_t x, size_t y,
                             const double low[2])
{
    const size_t n = t->n_split;
    const double width = 1 / (double)n;
    float corner[25][2];
    double sum = 0;
    corners(t, x, y, corner);
    for (size_t j = 0; j < n; j++)
        for (size_t i = 0; i < n; i++) {
            const double at[2] = {low[0] + (double)i * width, low[1] + (double)j * width};
            const size_t k = j * (n + 1) + i;
            const float *of[4] = {corner[k], corner[k + 1], corner[k + n + 1], corner[k + n + 2]};
            sum += cell_integral(q, at, width, of);
        }
    return sum;
}

/* Integral over node (x, y) of a level of the quadtree; shift: of the period, in texels. */
static double tree_integral(const struct glint_triangles *t, const struct tree_query *q, size_t level, size_t x,
                            size_t y, const double shift[2])
{
    const double edge = (double)(1U << level), half = t->map->is_flat ? 0 : 0.5;
    const struct glint_bounds *b = &t->level[level][y * (t->map->n >> level) + x];
    const double low[2] = {shift[0] + (double)x * edge + half, shift[1] + (double)y * edge + half};
    for (int a = 0; a < 2; a++)
        if (low[a] > q->most[a] || low[a] + edge < q->least[a] || (double)b->least[a] > q->normal_most[a] ||
            (double)b->most[a] < q->normal_least[a])
            return 0;
    if (level == 0) return texel_integral(t, q, x, y, low);
    double sum = 0;
    for (size_t k = 0; k < 4; k++) sum += tree_integral(t, q, level - 1, 2 * x + k % 2, 2 * y + k / 2, shift);
    return sum;
}

double glint_triangles_density(const struct glint_triangles *t, const struct glint_footprint *at, const float half[2])
{
    const double texel = (double)t->map->texel_um, n = (double)t->map->n, r = (double)t->roughness;
    double c[3], sum = 0, shift[2];
    struct tree_query q = {.gaussian.variance_r = r * r};
    /* a footprint without extent is as narrow as a hundredth of a texel */
    for (int a = 0; a < 3; a++) c[a] = (double)at->covariance_um2[a] / (texel * texel) + (a == 1 ? 0 : 1e-4);
    const double det = c[0] * c[2] - c[1] * c[1];
    const double inverse[3] = {c[2] / det, -c[1] / det, c[0] / det};
    for (int a = 0; a < 3; a++) q.gaussian.inverse[a] = inverse[a];
    for (int a = 0; a < 2; a++) {
        q.gaussian.center[a] = (double)at->center_um[a] / texel;
        q.gaussian.half[a] = (double)half[a];
        q.least[a] = q.gaussian.center[a] - reach * sqrt(c[2 * a]);
        q.most[a] = q.gaussian.center[a] + reach * sqrt(c[2 * a]);
        q.normal_least[a] = (double)half[a] - reach * r;
        q.normal_most[a] = (double)half[a] + reach * r;
    }
    for (shift[1] = floor(q.least[1] / n - 0.5 / n) * n; shift[1] <= q.most[1]; shift[1] += n)
        for (shift[0] = floor(q.least[0] / n - 0.5 / n) * n; shift[0] <= q.most[0]; shift[0] += n)
            sum += tree_integral(t, &q, t->n_level - 1, 0, 0, shift);
    return sum / (4 * M_PI * M_PI * sqrt(det) * r * r);
}
