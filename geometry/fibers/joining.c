#include "geometry/fibers/joining.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

enum { END_FIT = 8 }; /* vertices that give the tangent of an end */

/* An end of line i: index 2 i (first vertex) or 2 i + 1 (last). */
struct line_end {
    float x[3], t[3]; /* position, unit tangent pointing out of the line */
};

struct join {
    float cost;
    uint32_t a, b; /* ends */
};

struct join_list {
    struct join *join;
    size_t n, capacity;
};

/* Least-squares line through the last vertices; the end is moved onto it, which takes out half of the centers' noise. */
static void fit_end(const struct polyline_set *p, size_t line, bool last, struct line_end *end)
{
    size_t n = polyline_length(p, line), m = n < END_FIT ? n : END_FIT, first = last ? p->first[line + 1] - m : p->first[line];
    float mean[3] = {0.0f, 0.0f, 0.0f}, slope[3] = {0.0f, 0.0f, 0.0f}, norm = 0.0f, weight = 0.0f;
    float centre = 0.5f * (float)(m - 1);
    for (size_t i = 0; i < m; i++) {
        float w = (float)i - centre;
        weight += w * w;
        for (int a = 0; a < 3; a++) {
            mean[a] += p->vertex[first + i][a] / (float)m;
            slope[a] += w * p->vertex[first + i][a];
        }
    }
    for (int a = 0; a < 3; a++) {
        slope[a] /= weight;
        norm += slope[a] * slope[a];
    }
    norm = norm > 0.0f ? 1.0f / sqrtf(norm) : 0.0f;
    float side = last ? 1.0f : -1.0f;
    for (int a = 0; a < 3; a++) {
        end->x[a] = mean[a] + side * centre * slope[a];
        end->t[a] = side * slope[a] * norm;
    }
}

static float density_at(const struct volume *v, const float x[3])
{
    size_t i[3];
    for (int a = 0; a < 3; a++) {
        float c = floorf(x[a]);
        i[a] = c <= 0.0f ? 0 : c >= (float)v->n[a] - 1.0f ? v->n[a] - 1 : (size_t)c;
    }
    return v->density[volume_index(v->n, i[0], i[1], i[2])];
}

/* Mean density along the way from a to b. */
static float density_between(const struct volume *v, const float a[3], const float b[3])
{
    float sum = 0.0f;
    int n = 0;
    for (float f = 0.0f; f <= 1.0f; f += 0.1f, n++) {
        float x[3];
        for (int c = 0; c < 3; c++) x[c] = a[c] + f * (b[c] - a[c]);
        sum += density_at(v, x);
    }
    return sum / (float)n;
}

/* Cost of joining two ends, INFINITY if they do not belong together. */
static float join_cost(const struct line_end *a, const struct line_end *b, float diameter)
{
    float g[3], length2 = 0.0f, ahead_a = 0.0f, ahead_b = 0.0f, cosine = 0.0f;
    for (int c = 0; c < 3; c++) {
        g[c] = b->x[c] - a->x[c];
        length2 += g[c] * g[c];
        ahead_a += g[c] * a->t[c];
        ahead_b -= g[c] * b->t[c];
        cosine -= a->t[c] * b->t[c];
    }
    float longest = fmaxf(4.0f, 1.5f * diameter), length = sqrtf(length2);
    if (length > longest || cosine < 0.75f) return INFINITY;
    if (ahead_a < -0.5f * diameter || ahead_b < -0.5f * diameter) return INFINITY;
    float side_a = sqrtf(fmaxf(0.0f, length2 - ahead_a * ahead_a)), side_b = sqrtf(fmaxf(0.0f, length2 - ahead_b * ahead_b));
    float side = 0.5f * (side_a + side_b), allowed = 0.25f * diameter + 0.2f * length;
    if (allowed > 0.5f * diameter) allowed = 0.5f * diameter;
    if (side > fmaxf(1.0f, allowed)) return INFINITY;
    return side / diameter + 0.3f * length / diameter + 0.5f * (1.0f - cosine);
}

static bool push_join(struct join_list *l, struct join j)
{
    if (l->n == l->capacity) {
        size_t n = l->capacity == 0 ? 1024 : 2 * l->capacity;
        struct join *bigger = realloc(l->join, n * sizeof *bigger);
        if (bigger == NULL) return false;
        l->join = bigger;
        l->capacity = n;
    }
    l->join[l->n++] = j;
    return true;
}

static int cheaper_first(const void *p, const void *q)
{
    const struct join *x = p, *y = q;
    if (x->cost != y->cost) return x->cost < y->cost ? -1 : 1;
    if (x->a != y->a) return x->a < y->a ? -1 : 1;
    return (x->b > y->b) - (x->b < y->b);
}

/* Pairs of ends that may be joined. Ends are filed in a grid through a polyline set with one "line" of 2 n vertices. */
static status find_joins(const struct line_end *end, size_t n_end, const struct volume *v, float diameter, float eps_d,
                         struct join_list *joins, struct error *err)
{
    struct polyline_set points;
    struct vertex_grid g = {0};
    float reach = fmaxf(4.0f, 1.5f * diameter);
    polyline_set_init(&points);
    status s = polyline_begin(&points, 0, err);
    for (size_t e = 0; e < n_end && s == STATUS_OK; e++) s = polyline_add(&points, end[e].x, err);
    if (s == STATUS_OK) s = vertex_grid_init(&g, &points, v->n, reach, err);
    for (size_t e = 0; e < n_end && s == STATUS_OK; e++) {
        size_t from[3], to[3], c[3];
        scratch_keep_within(v->space);
        vertex_grid_range(&g, end[e].x, reach, from, to);
        for (c[2] = from[2]; c[2] <= to[2]; c[2]++)
            for (c[1] = from[1]; c[1] <= to[1]; c[1]++)
                for (c[0] = from[0]; c[0] <= to[0]; c[0]++) {
                    size_t cell = (c[2] * g.n[1] + c[1]) * g.n[0] + c[0];
                    for (size_t k = g.first[cell]; k < g.first[cell + 1]; k++) {
                        size_t f = g.vertex[k];
                        if (f <= e || f / 2 == e / 2) continue;
                        float cost = join_cost(&end[e], &end[f], diameter);
                        if (!(cost < INFINITY) || density_between(v, end[e].x, end[f].x) < eps_d) continue;
                        if (!push_join(joins, (struct join){cost, (uint32_t)e, (uint32_t)f}))
                            s = error_set(err, STATUS_NO_MEMORY, "cannot join fibers: out of memory");
                    }
                }
    }
    vertex_grid_release(&g);
    polyline_set_release(&points);
    return s;
}

/* Union-find over lines, so that no line is joined into a ring. */
static uint32_t root_of(uint32_t *parent, uint32_t i)
{
    while (parent[i] != i) i = parent[i] = parent[parent[i]];
    return i;
}

static void accept_joins(const struct join_list *joins, const struct polyline_set *lines, uint32_t *partner, uint32_t *parent,
                         struct join_counts *counts)
{
    for (size_t i = 0; i < joins->n; i++) {
        uint32_t a = joins->join[i].a, b = joins->join[i].b;
        if (partner[a] != UINT32_MAX || partner[b] != UINT32_MAX) continue;
        uint32_t ra = root_of(parent, a / 2), rb = root_of(parent, b / 2);
        if (ra == rb) continue;
        parent[ra] = rb;
        partner[a] = b;
        partner[b] = a;
        if (lines->axis[a / 2] == lines->axis[b / 2])
            counts->n_gap_bridged++;
        else
            counts->n_joined++;
    }
}

/* Straight vertices about one voxel apart between the last vertex written and x. */
static status fill_gap(struct polyline_set *out, const float x[3], struct error *err)
{
    const float *last = out->vertex[out->n_vertex - 1];
    float from[3], length2 = 0.0f;
    for (int a = 0; a < 3; a++) {
        from[a] = last[a];
        length2 += (x[a] - last[a]) * (x[a] - last[a]);
    }
    int n = (int)lrintf(sqrtf(length2));
    status s = STATUS_OK;
    for (int i = 1; i < n && s == STATUS_OK; i++) {
        float f = (float)i / (float)n, y[3];
        for (int a = 0; a < 3; a++) y[a] = from[a] + f * (x[a] - from[a]);
        s = polyline_add(out, y, err);
    }
    return s;
}

/* Two pieces may overlap a little: vertices of the next piece that lie behind the end of what is written are skipped. */
static bool behind(const struct polyline_set *out, const float x[3])
{
    size_t n = out->n_vertex - out->first[out->n_line - 1], back = n < 4 ? n : 4;
    const float *last = out->vertex[out->n_vertex - 1], *before = out->vertex[out->n_vertex - back];
    float ahead = 0.0f;
    for (int a = 0; a < 3; a++) ahead += (x[a] - last[a]) * (last[a] - before[a]);
    return n > 1 && ahead < 0.0f;
}

static status append_line(const struct polyline_set *lines, size_t line, bool reversed, bool first_piece,
                          struct polyline_set *out, struct error *err)
{
    size_t n = polyline_length(lines, line), k = 0;
    status s = STATUS_OK;
    const float(*v)[3] = (const float(*)[3])lines->vertex + lines->first[line];
    if (!first_piece) {
        while (k + 2 < n && behind(out, v[reversed ? n - 1 - k : k])) k++;
        s = fill_gap(out, v[reversed ? n - 1 - k : k], err);
    }
    for (; k < n && s == STATUS_OK; k++) s = polyline_add(out, v[reversed ? n - 1 - k : k], err);
    return s;
}

/* Walk from every free end through partners to the other free end. */
static status emit_joined(const struct polyline_set *lines, const uint32_t *partner, bool *done, struct polyline_set *out,
                          struct error *err)
{
    status s = STATUS_OK;
    for (uint32_t e = 0; e < 2 * lines->n_line && s == STATUS_OK; e++) {
        if (partner[e] != UINT32_MAX || done[e / 2]) continue;
        s = polyline_begin(out, lines->axis[e / 2], err);
        bool first_piece = true;
        for (uint32_t at = e; at != UINT32_MAX && s == STATUS_OK; at = partner[at ^ 1u]) {
            s = append_line(lines, at / 2, (at & 1u) != 0, first_piece, out, err);
            done[at / 2] = true;
            first_piece = false;
        }
    }
    return s;
}

status polylines_join(const struct polyline_set *lines, const struct volume *v, double diameter_voxel, double eps_d,
                      struct polyline_set *result, struct join_counts *counts, struct error *err)
{
    size_t n = lines->n_line;
    struct join_list joins = {0};
    struct line_end *end = malloc((2 * n + 1) * sizeof *end);
    uint32_t *partner = malloc((2 * n + 1) * sizeof *partner), *parent = malloc((n + 1) * sizeof *parent);
    bool *done = calloc(n + 1, sizeof *done);
    status s = STATUS_OK;
    if (end == NULL || partner == NULL || parent == NULL || done == NULL) {
        s = error_set(err, STATUS_NO_MEMORY, "cannot join fibers: out of memory");
        goto out;
    }
    for (size_t l = 0; l < n; l++) {
        fit_end(lines, l, false, &end[2 * l]);
        fit_end(lines, l, true, &end[2 * l + 1]);
        partner[2 * l] = partner[2 * l + 1] = UINT32_MAX;
        parent[l] = (uint32_t)l;
    }
    s = find_joins(end, 2 * n, v, (float)diameter_voxel, (float)eps_d, &joins, err);
    if (s != STATUS_OK) goto out;
    if (joins.n > 0) qsort(joins.join, joins.n, sizeof *joins.join, cheaper_first);
    accept_joins(&joins, lines, partner, parent, counts);
    s = emit_joined(lines, partner, done, result, err);
out:
    free(joins.join);
    free(end);
    free(partner);
    free(parent);
    free(done);
    return s;
}
