#include "geometry/fibers/lines/joining.h"

#include "geometry/fibers/lines/join/join_evidence.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

enum { MAX_TRIM = 6, TRIM_STEP = 3 };
/* Limits of a join. Lines stay within a tenth of a diameter of smooth curves; fibers bend with radii of about a
 * diameter or more. */
static const float FACE_STEPS = 1.5f;                              /* voxels along the fiber to a face */
static const double MAX_RMS = 0.13, MAX_BEND = 1.2, MAX_GAP = 1.5; /* diameters, per diameter, diameters */
/* Logarithm of the ratio of two radii that makes a join as unlikely as a curve of the largest bend. */
static const double UNLIKE = 0.3;
/* Where the scan judges joins: what one costs for which the scan is halfway between one fiber and two, and the most
 * that a join may cost. In plain weaves and velvets 1 of 50 joins within that was wrong, and 41 of 63 beyond
 * (geometry/NOTES.md). */
static const double NO_EVIDENCE = 0.8, MOST_JUDGED = 0.75;

struct join {
    double cost;
    uint32_t a, b; /* ends: 2 l is the first vertex of line l, 2 l + 1 the last */
    uint8_t trim[2];
};

struct join_list {
    struct join *join;
    size_t n, capacity;
};

struct join_job {
    const struct polyline_set *lines;
    const struct volume *v;
    double diameter, eps_d, blur; /* typical diameter; blur_voxel */
    float largest_radius;
    struct vertex_grid grid; /* of all vertices */
};

/* Mean density of the voxel at x and its six neighbours. */
static double density_at(const struct volume *v, const double x[3])
{
    double sum = 0.0;
    for (int k = 0; k < 7; k++) {
        size_t i[3];
        for (int a = 0; a < 3; a++) {
            double c = floor(x[a]) + (k == 2 * a + 1 ? 1.0 : k == 2 * a + 2 ? -1.0 : 0.0);
            i[a] = c <= 0.0 ? 0 : c >= (double)v->n[a] - 1.0 ? v->n[a] - 1 : (size_t)c;
        }
        sum += (double)v->density[volume_index(v->n, i[0], i[1], i[2])];
    }
    return sum / 7.0;
}

/* Radius of the fiber of line l. */
static float radius_of(const struct join_job *job, size_t l)
{
    return job->lines->radius[l] > 0.0f ? job->lines->radius[l] : (float)(0.5 * job->diameter);
}

/* Returns whether x lies inside of a third line. */
static bool is_claimed(const struct join_job *job, const float x[3], uint32_t a, uint32_t b)
{
    const struct vertex_grid *g = &job->grid;
    float near = job->largest_radius;
    size_t from[3], to[3], c[3];
    vertex_grid_range(g, x, near, from, to);
    for (c[2] = from[2]; c[2] <= to[2]; c[2]++)
        for (c[1] = from[1]; c[1] <= to[1]; c[1]++)
            for (c[0] = from[0]; c[0] <= to[0]; c[0]++) {
                size_t cell = (c[2] * g->n[1] + c[1]) * g->n[0] + c[0];
                for (size_t k = g->first[cell]; k < g->first[cell + 1]; k++) {
                    const float *y = job->lines->vertex[g->vertex[k]];
                    if (g->line_of[g->vertex[k]] == a / 2 || g->line_of[g->vertex[k]] == b / 2) continue;
                    float d2 = 0.0f;
                    for (int e = 0; e < 3; e++) d2 += (x[e] - y[e]) * (x[e] - y[e]);
                    float inside = radius_of(job, g->line_of[g->vertex[k]]);
                    if (d2 < inside * inside) return true;
                }
            }
    return false;
}

/* Returns whether the way over the gap lies in material without a hole, and no other line passes there. */
static bool is_way_free(const struct join_job *job, const struct join_curve *j, uint32_t a, uint32_t b)
{
    double sum = 0.0, last[2] = {1.0, 1.0};
    int n = 2 + (int)j->gap;
    for (int i = 0; i <= n; i++) {
        double y[3], density;
        join_curve_at(j, j->from + (j->to - j->from) * i / n, y);
        const float x[3] = {(float)y[0], (float)y[1], (float)y[2]};
        density = density_at(job->v, y);
        if (density + last[0] + last[1] < 1.5 * job->eps_d) return false;
        last[1] = last[0];
        last[0] = density;
        sum += density;
        if (i > 0 && i < n && is_claimed(job, x, a, b)) return false;
    }
    return sum >= job->eps_d * (n + 1);
}

/* Outward tangent of an end. */
static void end_tangent(const struct polyline_set *p, uint32_t end, float t[3])
{
    size_t length = polyline_length(p, end / 2);
    const float *x = line_end_vertex(p, end, 0), *before = line_end_vertex(p, end, length < 7 ? length - 1 : 6);
    float norm = 0.0f;
    for (int a = 0; a < 3; a++) norm += (x[a] - before[a]) * (x[a] - before[a]);
    for (int a = 0; a < 3; a++) t[a] = norm > 0.0f ? (x[a] - before[a]) / sqrtf(norm) : 0.0f;
}

/* A fast test that excludes most pairs before they are fitted: ends that do not face each other, even if they are
 * trimmed and the fiber bends strongly. */
static bool may_face(const struct join_job *job, uint32_t a, uint32_t b)
{
    const float *x = line_end_vertex(job->lines, a, 0), *y = line_end_vertex(job->lines, b, 0);
    float ta[3], tb[3], cosine = 0.0f, ahead = 0.0f, length2 = 0.0f;
    end_tangent(job->lines, a, ta);
    end_tangent(job->lines, b, tb);
    for (int c = 0; c < 3; c++) {
        cosine -= ta[c] * tb[c];
        ahead += 0.5f * (y[c] - x[c]) * (ta[c] - tb[c]);
        length2 += (y[c] - x[c]) * (y[c] - x[c]);
    }
    float side2 = fmaxf(0.0f, length2 - ahead * ahead), free_way = fmaxf(0.0f, ahead) + (float)MAX_TRIM,
          wide = 0.4f * (float)job->diameter;
    return cosine > -0.2f && ahead > -(float)MAX_TRIM && side2 < (wide + 0.4f * free_way) * (wide + 0.4f * free_way);
}

/* What a join costs because the scan does not show one fiber. */
static double lack_of_evidence(const struct join_job *job, const struct join_curve *j, uint32_t a, uint32_t b)
{
    if (!(job->blur > 0.0)) return 0.0;
    const struct join_scene scene = {job->lines, &job->grid, job->v, job->diameter, job->blur, job->largest_radius};
    return NO_EVIDENCE * fmax(0.0, 1.0 - join_evidence(&scene, j, a, b));
}

/* Finds the best way to join two ends; its cost is INFINITY if they do not belong together. */
static struct join best_join(const struct join_job *job, uint32_t a, uint32_t b)
{
    struct join best = {.cost = INFINITY, .a = a, .b = b};
    if (!may_face(job, a, b)) return best;
    const double ra = (double)radius_of(job, a / 2), rb = (double)radius_of(job, b / 2), diameter = ra + rb;
    const double unlike = log(ra / rb) / UNLIKE;
    size_t longest[2] = {polyline_length(job->lines, a / 2) / 4, polyline_length(job->lines, b / 2) / 4};
    uint8_t trim[2];
    for (trim[0] = 0; trim[0] <= MAX_TRIM && trim[0] <= longest[0]; trim[0] = (uint8_t)(trim[0] + TRIM_STEP))
        for (trim[1] = 0; trim[1] <= MAX_TRIM && trim[1] <= longest[1]; trim[1] = (uint8_t)(trim[1] + TRIM_STEP)) {
            struct join_curve j;
            if (!join_curve_fit(job->lines, a, b, trim, &j)) continue;
            double rms = j.rms / diameter, bend = j.bend * diameter, gap = j.gap / diameter;
            if (rms > MAX_RMS || bend > MAX_BEND || gap > MAX_GAP + 0.15 * (trim[0] + trim[1])) continue;
            double cost = (rms / MAX_RMS) * (rms / MAX_RMS) + 0.5 * (bend / MAX_BEND) * (bend / MAX_BEND) + 0.3 * gap +
                          0.04 * (trim[0] + trim[1]) + 0.5 * unlike * unlike;
            if (cost >= best.cost || !is_way_free(job, &j, a, b)) continue;
            cost += lack_of_evidence(job, &j, a, b);
            if (cost >= best.cost || (job->blur > 0.0 && cost > MOST_JUDGED)) continue;
            best.cost = cost;
            memcpy(best.trim, trim, sizeof trim);
        }
    return best;
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

/* An end at a face: the fiber leaves the volume there. */
static bool is_at_face(const struct join_job *job, uint32_t end)
{
    size_t length = polyline_length(job->lines, end / 2);
    const float *x = line_end_vertex(job->lines, end, 0),
                *before = line_end_vertex(job->lines, end, length < 6 ? length - 1 : 5);
    float norm = 0.0f;
    for (int a = 0; a < 3; a++) norm += (x[a] - before[a]) * (x[a] - before[a]);
    for (int a = 0; a < 3; a++) {
        float out = (x[a] - before[a]) / sqrtf(norm), room = out > 0.0f ? (float)job->v->n[a] - x[a] : x[a];
        if (fabsf(out) > 0.2f && room < FACE_STEPS * fabsf(out)) return true;
    }
    return false;
}

/* Finds pairs of ends that may be joined. The ends are put into a grid as a polyline set with one "line" of 2 n
 * vertices. */
static status find_joins(const struct join_job *job, struct join_list *joins, struct error *err)
{
    struct polyline_set points;
    struct vertex_grid g = {0};
    float reach = (float)fmax(4.0, MAX_GAP * job->diameter);
    uint32_t n_end = (uint32_t)(2 * job->lines->n_line);
    polyline_set_init(&points);
    status s = polyline_begin(&points, 0, err);
    for (uint32_t e = 0; e < n_end && s == STATUS_OK; e++)
        s = polyline_add(&points, line_end_vertex(job->lines, e, 0), err);
    if (s == STATUS_OK) s = vertex_grid_init(&g, &points, job->v->n, reach, err);
    for (uint32_t e = 0; e < n_end && s == STATUS_OK; e++) {
        if (is_at_face(job, e)) continue;
        size_t from[3], to[3], c[3];
        scratch_keep_within(job->v->space);
        const float *x = points.vertex[e];
        vertex_grid_range(&g, x, reach, from, to);
        for (c[2] = from[2]; c[2] <= to[2]; c[2]++)
            for (c[1] = from[1]; c[1] <= to[1]; c[1]++)
                for (c[0] = from[0]; c[0] <= to[0]; c[0]++) {
                    size_t cell = (c[2] * g.n[1] + c[1]) * g.n[0] + c[0];
                    for (size_t k = g.first[cell]; k < g.first[cell + 1]; k++) {
                        uint32_t f = g.vertex[k];
                        const float *y = points.vertex[f];
                        float d2 = (x[0] - y[0]) * (x[0] - y[0]) + (x[1] - y[1]) * (x[1] - y[1]) +
                                   (x[2] - y[2]) * (x[2] - y[2]);
                        if (f <= e || f / 2 == e / 2 || d2 > reach * reach || is_at_face(job, f)) continue;
                        struct join join = best_join(job, e, f);
                        if (join.cost < INFINITY && !push_join(joins, join))
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

static void accept_joins(const struct join_list *joins, const struct polyline_set *lines, uint32_t *partner,
                         uint8_t *trim, uint32_t *parent, struct join_counts *counts)
{
    for (size_t i = 0; i < joins->n; i++) {
        uint32_t a = joins->join[i].a, b = joins->join[i].b;
        if (partner[a] != UINT32_MAX || partner[b] != UINT32_MAX) continue;
        uint32_t ra = root_of(parent, a / 2), rb = root_of(parent, b / 2);
        if (ra == rb) continue;
        parent[ra] = rb;
        partner[a] = b;
        partner[b] = a;
        trim[a] = joins->join[i].trim[0];
        trim[b] = joins->join[i].trim[1];
        if (lines->axis[a / 2] == lines->axis[b / 2])
            counts->n_gap_bridged++;
        else
            counts->n_joined++;
    }
}

/* The section at a share of the way from one end of a gap to the other. */
static struct fiber_shape shape_between(const struct fiber_shape *a, const struct fiber_shape *b, float share)
{
    struct fiber_shape s = share < 0.5f ? *a : *b;
    s.radius = a->radius + share * (b->radius - a->radius);
    s.radius_se = fmaxf(a->radius_se, b->radius_se);
    s.ratio = a->ratio + share * (b->ratio - a->ratio);
    s.ratio_se = fmaxf(a->ratio_se, b->ratio_se);
    return s;
}

/* Index of vertex k from an end. */
static size_t end_index(const struct polyline_set *p, uint32_t end, size_t k)
{
    return (end & 1u) != 0 ? p->first[end / 2 + 1] - 1 - k : p->first[end / 2] + k;
}

/* Adds vertices about one voxel apart on the curve over a gap. */
static status fill_gap(const struct polyline_set *lines, uint32_t a, uint32_t b, const uint8_t *trim,
                       struct polyline_set *out, struct error *err)
{
    struct join_curve j;
    const uint8_t own_trim[2] = {trim[a], trim[b]};
    status s = STATUS_OK;
    if (!join_curve_fit(lines, a, b, own_trim, &j))
        return error_set(err, STATUS_INTERNAL, "cannot join fibers: an accepted join cannot be fitted again");
    int n = (int)lrint(j.gap);
    for (int i = 1; i < n && s == STATUS_OK; i++) {
        double y[3];
        join_curve_at(&j, j.from + (j.to - j.from) * i / n, y);
        s = polyline_add(out, (const float[3]){(float)y[0], (float)y[1], (float)y[2]}, err);
        if (s == STATUS_OK && lines->shape != NULL)
            out->shape[out->n_vertex - 1] =
                shape_between(&lines->shape[end_index(lines, a, trim[a])], &lines->shape[end_index(lines, b, trim[b])],
                              (float)i / (float)n);
    }
    return s;
}

/* Appends the vertices of a line from end e on, without those that are trimmed. */
static status append_line(const struct polyline_set *lines, uint32_t e, const uint8_t *trim, struct polyline_set *out,
                          struct error *err)
{
    size_t n = polyline_length(lines, e / 2);
    status s = STATUS_OK;
    for (size_t k = trim[e]; k + trim[e ^ 1u] < n && s == STATUS_OK; k++) {
        s = polyline_add(out, line_end_vertex(lines, e, k), err);
        if (s == STATUS_OK && lines->shape != NULL)
            out->shape[out->n_vertex - 1] = lines->shape[end_index(lines, e, k)];
    }
    return s;
}

/* Goes from every free end through partners to the other free end. */
static status emit_joined(const struct polyline_set *lines, const uint32_t *partner, const uint8_t *trim, bool *done,
                          struct polyline_set *out, struct error *err)
{
    status s = lines->shape != NULL ? polyline_shapes_init(out, err) : STATUS_OK;
    for (uint32_t e = 0; e < 2 * lines->n_line && s == STATUS_OK; e++) {
        if (partner[e] != UINT32_MAX || done[e / 2]) continue;
        double sum = 0.0, weight = 0.0;
        s = polyline_begin_like(out, lines, e / 2, err);
        for (uint32_t at = e; at != UINT32_MAX && s == STATUS_OK; at = partner[at ^ 1u]) {
            double length = lines->radius[at / 2] > 0.0f ? (double)polyline_length(lines, at / 2) : 0.0;
            sum += length * (double)lines->radius[at / 2];
            weight += length;
            if (at != e) s = fill_gap(lines, partner[at], at, trim, out, err);
            if (s == STATUS_OK) s = append_line(lines, at, trim, out, err);
            done[at / 2] = true;
        }
        if (s == STATUS_OK && weight > 0.0) out->radius[out->n_line - 1] = (float)(sum / weight);
    }
    polyline_shapes_follow(out, false);
    return s;
}

status polylines_join(const struct polyline_set *lines, const struct volume *v, const struct join_option *o,
                      struct polyline_set *result, struct join_counts *counts, struct error *err)
{
    size_t n = lines->n_line;
    struct join_list joins = {0};
    struct join_job job = {
        .lines = lines, .v = v, .diameter = o->diameter_voxel, .eps_d = o->eps_d, .blur = o->blur_voxel};
    uint32_t *partner = malloc((2 * n + 1) * sizeof *partner), *parent = malloc((n + 1) * sizeof *parent);
    uint8_t *trim = calloc(2 * n + 1, sizeof *trim);
    bool *done = calloc(n + 1, sizeof *done);
    status s = STATUS_OK;
    if (trim == NULL || partner == NULL || parent == NULL || done == NULL) {
        s = error_set(err, STATUS_NO_MEMORY, "cannot join fibers: out of memory");
        goto out;
    }
    for (size_t l = 0; l < n; l++) {
        partner[2 * l] = partner[2 * l + 1] = UINT32_MAX;
        parent[l] = (uint32_t)l;
    }
    job.largest_radius = (float)(0.5 * o->diameter_voxel);
    for (size_t l = 0; l < n; l++) job.largest_radius = fmaxf(job.largest_radius, lines->radius[l]);
    s = vertex_grid_init(&job.grid, lines, v->n, (float)fmax(3.0, o->diameter_voxel), err);
    if (s == STATUS_OK) s = find_joins(&job, &joins, err);
    if (s != STATUS_OK) goto out;
    if (joins.n > 0) qsort(joins.join, joins.n, sizeof *joins.join, cheaper_first);
    accept_joins(&joins, lines, partner, trim, parent, counts);
    s = emit_joined(lines, partner, trim, done, result, err);
out:
    vertex_grid_release(&job.grid);
    free(joins.join);
    free(trim);
    free(partner);
    free(parent);
    free(done);
    return s;
}
