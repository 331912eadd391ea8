#include "geometry/fibers/lines/joining.h"

#include "geometry/fibers/lines/join_emit.h"
#include "geometry/fibers/lines/join_evidence.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

enum { MAX_TRIM = 6, TRIM_STEP = 3, ENDS = 64 };
/* Limits of a join. Lines stay within a tenth of a diameter of smooth curves; fibers bend with radii of about a
 * diameter or more. */
static const float FACE_STEPS = 1.5f;                              /* voxels along the fiber to a face */
static const double MAX_RMS = 0.13, MAX_BEND = 1.2, MAX_GAP = 1.5; /* diameters, per diameter, diameters */
/* Logarithm of the ratio of two radii that makes a join as unlikely as a curve of the largest bend. */
static const double UNLIKE = 0.3;
/* Where the scan judges joins: the cost of a join for which the scan is halfway between one fiber and two, and the most
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
static bool is_in_third_line(const struct join_job *job, const float x[3], uint32_t a, uint32_t b)
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
        if (i > 0 && i < n && is_in_third_line(job, x, a, b)) return false;
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

/* Returns the cost of a join for lack of evidence that the scan shows one fiber. */
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

/* The search for pairs of ends in tasks of ENDS ends. */
struct end_search {
    const struct join_job *job;
    struct polyline_set points; /* one "line" of all ends */
    struct vertex_grid grid;    /* of the points */
    float reach;
    struct join_list *found; /* per task */
    bool *failed;            /* per task: memory was out */
};

/* Finds the ends of a cell that end e may be joined to, of later ones only. */
static bool search_cell(const struct end_search *q, uint32_t e, size_t cell, struct join_list *found)
{
    const float *x = q->points.vertex[e];
    for (size_t k = q->grid.first[cell]; k < q->grid.first[cell + 1]; k++) {
        const uint32_t f = q->grid.vertex[k];
        const float *y = q->points.vertex[f];
        float d2 = 0.0f;
        for (int a = 0; a < 3; a++) d2 += (x[a] - y[a]) * (x[a] - y[a]);
        if (f <= e || f / 2 == e / 2 || d2 > q->reach * q->reach || is_at_face(q->job, f)) continue;
        struct join join = best_join(q->job, e, f);
        if (join.cost < INFINITY && !push_join(found, join)) return false;
    }
    return true;
}

static void search_ends(void *context, size_t i_task, size_t i_thread)
{
    (void)i_thread;
    const struct end_search *q = context;
    scratch_keep_within(q->job->v->space);
    for (size_t e = i_task * ENDS; e < q->points.n_vertex && e < (i_task + 1) * ENDS; e++) {
        size_t from[3], to[3], c[3];
        if (is_at_face(q->job, (uint32_t)e)) continue;
        vertex_grid_range(&q->grid, q->points.vertex[e], q->reach, from, to);
        for (c[2] = from[2]; c[2] <= to[2]; c[2]++)
            for (c[1] = from[1]; c[1] <= to[1]; c[1]++)
                for (c[0] = from[0]; c[0] <= to[0]; c[0]++)
                    if (!search_cell(q, (uint32_t)e, (c[2] * q->grid.n[1] + c[1]) * q->grid.n[0] + c[0],
                                     &q->found[i_task]))
                        q->failed[i_task] = true;
    }
}

/* Adds the joins of all tasks in order. Returns false when memory is, or was, out. */
static bool gather_joins(const struct end_search *q, size_t n_task, struct join_list *joins)
{
    bool fits = true;
    for (size_t t = 0; t < n_task; t++) {
        fits = fits && !q->failed[t];
        for (size_t i = 0; i < q->found[t].n && fits; i++) fits = push_join(joins, q->found[t].join[i]);
        free(q->found[t].join);
    }
    return fits;
}

/* Finds pairs of ends that may be joined. */
static status find_joins(const struct join_job *job, struct thread_pool *pool, struct join_list *joins,
                         struct error *err)
{
    struct end_search q = {.job = job, .reach = (float)fmax(4.0, MAX_GAP * job->diameter)};
    const size_t n_end = 2 * job->lines->n_line, n_task = (n_end + ENDS - 1) / ENDS;
    polyline_set_init(&q.points);
    status s = polyline_begin(&q.points, 0, err);
    for (uint32_t e = 0; e < n_end && s == STATUS_OK; e++)
        s = polyline_add(&q.points, line_end_vertex(job->lines, e, 0), err);
    if (s == STATUS_OK) s = vertex_grid_init(&q.grid, &q.points, job->v->n, q.reach, err);
    q.found = calloc(n_task + 1, sizeof *q.found);
    q.failed = calloc(n_task + 1, sizeof *q.failed);
    bool fits = q.found != NULL && q.failed != NULL;
    if (s == STATUS_OK && fits) s = thread_pool_run(pool, n_task, search_ends, &q, NULL);
    fits = fits && gather_joins(&q, n_task, joins);
    if (s == STATUS_OK && !fits) s = error_set(err, STATUS_NO_MEMORY, "cannot join fibers: out of memory");
    free(q.found);
    free(q.failed);
    vertex_grid_release(&q.grid);
    polyline_set_release(&q.points);
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
    if (s == STATUS_OK) s = find_joins(&job, o->pool, &joins, err);
    if (s != STATUS_OK) goto out;
    if (joins.n > 0) qsort(joins.join, joins.n, sizeof *joins.join, cheaper_first);
    accept_joins(&joins, lines, partner, trim, parent, counts);
    s = joins_emit(lines, &(struct join_partners){partner, trim}, done, result, err);
out:
    vertex_grid_release(&job.grid);
    free(joins.join);
    free(trim);
    free(partner);
    free(parent);
    free(done);
    return s;
}
