#include "geometry/fibers/shape/axis_fit.h"
#include "base/small_matrix.h"
#include "geometry/fibers/lines/segment_bricks.h"
#include "geometry/fibers/shape/axis_solve.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { BRICK = 32, N_CELL = BRICK * BRICK * BRICK };
static const float OUTLIER = 0.6f; /* difference of densities beyond which a residual comes from another fiber */
static const double PIECE_DIAMETERS = 2.0; /* length of the pieces that show the error of a radius */

/* Sums over one brick: for the vertices of its segments, and for the profile. */
struct brick_sum {
    struct axis_pull *pull; /* two for each segment of the brick */
    struct shared_sum shared;
    bool failed;
};

struct fit_job {
    const struct volume *v;
    const struct segment_bricks *bricks;
    struct axis_profile profile;
    struct axis_table table;
    float tail, inverse_blur; /* voxels beyond the radius up to which a fiber is modelled */
    struct brick_scratch {
        float model[N_CELL], own2[N_CELL], by_radius[N_CELL], by_blur[N_CELL];
        uint32_t own[N_CELL], touched[N_CELL];
    } * scratch;           /* one per thread */
    struct brick_sum *sum; /* one per brick */
};

/* Finds the point of the segment nearest to p (relative to a): *t is its position along the segment in [0, 1].
 * Returns false if p lies beyond an end of the line. */
static bool foot_of(const struct segment *g, const float p[3], float *t, float offset[3], float *d2)
{
    float u[3], along = 0.0f, length2 = 0.0f;
    for (int a = 0; a < 3; a++) {
        u[a] = g->b[a] - g->a[a];
        along += u[a] * p[a];
        length2 += u[a] * u[a];
    }
    *t = length2 > 0.0f ? along / length2 : 0.0f;
    if ((g->is_first && *t < 0.0f) || (g->is_last && *t > 1.0f)) return false;
    /* comparisons here and below, because fminf would be a function call */
    *t = *t < 0.0f ? 0.0f : *t > 1.0f ? 1.0f : *t;
    *d2 = 0.0f;
    for (int a = 0; a < 3; a++) {
        offset[a] = p[a] - *t * u[a];
        *d2 += offset[a] * offset[a];
    }
    return true;
}

/* Finds the part of a row of n voxel centres, from p on relative to the segment's begin, whose nearest points lie
 * within a voxel of the segment. */
static void row_range(const float u[3], float length2, const float p[3], size_t n, size_t *from, size_t *to)
{
    float margin = sqrtf(length2), x = p[0], fixed = p[1] * u[1] + p[2] * u[2];
    *from = 0;
    *to = n;
    if (fabsf(u[0]) < 0.2f * margin) {
        float wide = (float)n * fabsf(u[0]) + fabsf(x * u[0]);
        if (fixed < -margin - wide || fixed > length2 + margin + wide) *to = 0;
        return;
    }
    float x0 = (-margin - fixed) / u[0] - x, x1 = (length2 + margin - fixed) / u[0] - x;
    float lo = ceilf(fminf(x0, x1)), hi = floorf(fmaxf(x0, x1)) + 1.0f;
    *from = lo <= 0.0f ? 0 : lo >= (float)n ? n : (size_t)lo;
    *to = hi <= 0.0f ? 0 : hi >= (float)n ? n : (size_t)hi;
}

/* Lists the voxels of the brick for which this segment is the nearest of its line so far. */
static size_t stamp(const struct fit_job *job, struct brick_scratch *s, const size_t from[3], const size_t n[3],
                    uint32_t segment, size_t n_touched)
{
    const struct segment *g = &job->bricks->segment[segment];
    size_t lo[3], hi[3];
    float u[3], length2 = 0.0f, reach = g->radius + job->tail;
    for (int a = 0; a < 3; a++) {
        float l = ceilf(fminf(g->a[a], g->b[a]) - reach - 0.5f),
              h = floorf(fmaxf(g->a[a], g->b[a]) + reach - 0.5f) + 1.0f;
        float first = (float)from[a], end = (float)(from[a] + n[a]);
        if (h <= first || l >= end) return n_touched;
        lo[a] = l <= first ? 0 : (size_t)(l - first);
        hi[a] = h >= end ? n[a] : (size_t)(h - first);
        u[a] = g->b[a] - g->a[a];
        length2 += u[a] * u[a];
    }
    for (size_t k = lo[2]; k < hi[2]; k++)
        for (size_t j = lo[1]; j < hi[1]; j++) {
            size_t i0, i1;
            float p[3] = {(float)(from[0] + lo[0]) + 0.5f - g->a[0], (float)(from[1] + j) + 0.5f - g->a[1],
                          (float)(from[2] + k) + 0.5f - g->a[2]};
            row_range(u, length2, p, hi[0] - lo[0], &i0, &i1);
            p[0] += (float)i0;
            for (size_t i = lo[0] + i0; i < lo[0] + i1; i++, p[0] += 1.0f) {
                float t, offset[3], d2;
                size_t at = (k * BRICK + j) * BRICK + i;
                if (!foot_of(g, p, &t, offset, &d2) || d2 >= reach * reach || d2 >= s->own2[at]) continue;
                if (s->own[at] == UINT32_MAX) s->touched[n_touched++] = (uint32_t)at;
                s->own2[at] = d2;
                s->own[at] = segment;
            }
        }
    return n_touched;
}

static void add_to_model(const struct fit_job *job, struct brick_scratch *s, float radius, size_t n_touched)
{
    for (size_t i = 0; i < n_touched; i++) {
        uint32_t cell = s->touched[i];
        float depth = (sqrtf(s->own2[cell]) - radius) * job->inverse_blur;
        float at = axis_table_place(&job->table, depth);
        s->model[cell] += axis_table_look_up(job->table.share, at);
        float slope = axis_table_look_up(job->table.slope, at) * job->inverse_blur;
        s->by_radius[cell] -= slope;
        s->by_blur[cell] -= slope * depth;
    }
}

/* Residual and weight of a voxel. */
static float residual(const struct fit_job *job, const struct brick_scratch *s, const size_t from[3], uint32_t at,
                      float *weight)
{
    size_t i = from[0] + at % BRICK, j = from[1] + at / BRICK % BRICK, k = from[2] + at / (BRICK * BRICK);
    float low = (float)job->profile.low, high = (float)job->profile.high,
          share = s->model[at] < 1.0f ? s->model[at] : 1.0f;
    float e = job->v->density[volume_index(job->v->n, i, j, k)] - low - (high - low) * share;
    float q = 1.0f / (1.0f + e * e / (OUTLIER * OUTLIER));
    *weight = q * q;
    return e;
}

/* Adds a voxel to the normal equation of its line's radius. by: derivative of the model by the radius. */
static void add_radius(const struct brick_scratch *s, uint32_t at, float amplitude, float by, float e, float weight,
                       struct axis_pull *q)
{
    float share = s->model[at] < 1.0f ? s->model[at] : 1.0f;
    q->radius_normal += weight * by * by;
    q->radius_gradient += weight * e * by;
    q->radius_cross[0] += weight * by * amplitude * s->by_radius[at];
    q->radius_cross[1] += weight * by * amplitude * s->by_blur[at];
    q->radius_cross[2] += weight * by * (1.0f - share);
    q->radius_cross[3] += weight * by * share;
}

static void add_pulls(const struct fit_job *job, struct brick_scratch *s, const size_t from[3], size_t n_touched,
                      uint32_t first_segment, const uint32_t *slot, struct brick_sum *sum)
{
    float amplitude = (float)(job->profile.high - job->profile.low);
    for (size_t i = 0; i < n_touched; i++) {
        uint32_t at = s->touched[i];
        const struct segment *g = &job->bricks->segment[s->own[at]];
        float p[3] = {(float)(from[0] + at % BRICK) + 0.5f - g->a[0],
                      (float)(from[1] + at / BRICK % BRICK) + 0.5f - g->a[1],
                      (float)(from[2] + at / (BRICK * BRICK)) + 0.5f - g->a[2]};
        float t, offset[3], d2, weight;
        if (!foot_of(g, p, &t, offset, &d2) || !(d2 > 1e-6f)) continue;
        float d = sqrtf(d2), e = residual(job, s, from, at, &weight);
        float place = axis_table_place(&job->table, (d - g->radius) * job->inverse_blur);
        float slope = -amplitude * job->inverse_blur * axis_table_look_up(job->table.slope, place);
        struct axis_pull *pull = &sum->pull[2 * slot[s->own[at] - first_segment]];
        add_radius(s, at, amplitude, slope, e, weight, pull);
        for (int end = 0; end < 2; end++) {
            struct axis_pull *q = pull + end;
            float w = weight * (end == 0 ? 1.0f - t : t) * slope / d;
            for (int a = 0, c = 0; a < 3; a++) {
                q->gradient[a] += w * e * offset[a];
                for (int b = 0; b <= a; b++, c++) q->normal[c] += w * slope / d * offset[a] * offset[b];
            }
        }
    }
}

/* Visits all lines of a brick in turn: adds either their densities to the model or their normal equations. */
static void each_line(const struct fit_job *job, struct brick_scratch *s, size_t i_brick, const size_t from[3],
                      const size_t n[3], uint32_t *slot, struct brick_sum *sum)
{
    const struct segment_bricks *b = job->bricks;
    for (size_t e = b->first[i_brick], end; e < b->first[i_brick + 1]; e = end) {
        uint32_t line = b->segment[b->index[e]].line, lowest = UINT32_MAX;
        size_t n_touched = 0;
        for (end = e; end < b->first[i_brick + 1] && b->segment[b->index[end]].line == line; end++) {
            n_touched = stamp(job, s, from, n, b->index[end], n_touched);
            if (b->index[end] < lowest) lowest = b->index[end];
        }
        if (slot != NULL) {
            for (size_t i = e; i < end; i++) slot[b->index[i] - lowest] = (uint32_t)(i - b->first[i_brick]);
            add_pulls(job, s, from, n_touched, lowest, slot, sum);
        } else {
            add_to_model(job, s, b->segment[lowest].radius, n_touched);
        }
        for (size_t i = 0; i < n_touched; i++) {
            s->own2[s->touched[i]] = INFINITY;
            s->own[s->touched[i]] = UINT32_MAX;
        }
    }
}

/* Adds to the normal equations of what fibers share: a change of all radii, blur, low, high. */
static void add_shared(const struct fit_job *job, const struct brick_scratch *s, const size_t from[3],
                       const size_t n[3], struct shared_sum *sum)
{
    double amplitude = job->profile.high - job->profile.low;
    for (size_t k = 0; k < n[2]; k++)
        for (size_t j = 0; j < n[1]; j++)
            for (size_t i = 0; i < n[0]; i++) {
                uint32_t at = (uint32_t)((k * BRICK + j) * BRICK + i);
                float weight;
                if (!(s->model[at] > 0.0f)) continue;
                double e = (double)residual(job, s, from, at, &weight), share = fmin(1.0, (double)s->model[at]);
                sum->square += (double)weight * e * e;
                sum->weight += (double)weight;
                double by[4] = {amplitude * (double)s->by_radius[at], amplitude * (double)s->by_blur[at], 1.0 - share,
                                share};
                for (int a = 0; a < 4; a++) {
                    sum->gradient[a] += (double)weight * e * by[a];
                    for (int c = 0; c < 4; c++) sum->normal[a][c] += (double)weight * by[a] * by[c];
                }
            }
}

static void fit_brick(void *context, size_t i_brick, size_t i_thread)
{
    struct fit_job *job = context;
    const struct segment_bricks *b = job->bricks;
    size_t n_segment = b->first[i_brick + 1] - b->first[i_brick], from[3], n[3], longest = 0;
    if (n_segment == 0) return;
    scratch_keep_within(job->v->space);
    struct brick_scratch *s = &job->scratch[i_thread];
    struct brick_sum *sum = &job->sum[i_brick];
    for (size_t e = b->first[i_brick], start = e; e < b->first[i_brick + 1];
         e++) { /* range of the numbers of a line's segments */
        if (b->segment[b->index[e]].line != b->segment[b->index[start]].line) start = e;
        size_t apart = b->index[e] - b->index[start] + 1;
        longest = apart > longest ? apart : longest;
    }
    uint32_t *slot = malloc(longest * sizeof *slot);
    sum->pull = calloc(2 * n_segment, sizeof *sum->pull);
    sum->failed = sum->pull == NULL || slot == NULL;
    if (!sum->failed) {
        for (size_t e = 0; e < 2 * n_segment; e++) sum->pull[e].segment = b->index[b->first[i_brick] + e / 2];
        for (size_t i = 0; i < N_CELL; i++) {
            s->model[i] = s->by_radius[i] = s->by_blur[i] = 0.0f;
            s->own2[i] = INFINITY;
            s->own[i] = UINT32_MAX;
        }
        segment_brick_box(b, i_brick, from, n);
        each_line(job, s, i_brick, from, n, NULL, sum);
        each_line(job, s, i_brick, from, n, slot, sum);
        add_shared(job, s, from, n, &sum->shared);
    }
    free(slot);
}

/* Adds the bricks in order, so that sums do not depend on the number of threads. */
static void add_bricks(const struct fit_job *job, const uint32_t *first_vertex_of, struct axis_pull *total,
                       struct shared_sum *shared, struct radius_sum *line)
{
    for (size_t b = 0; b < segment_n_brick(job->bricks); b++) {
        const struct brick_sum *sum = &job->sum[b];
        for (size_t e = 0; e < 2 * (job->bricks->first[b + 1] - job->bricks->first[b]); e++) {
            const struct axis_pull *q = &sum->pull[e];
            struct radius_sum *r = &line[job->bricks->segment[q->segment].line];
            axis_pull_add(&total[first_vertex_of[q->segment] + e % 2], q);
            r->normal += (double)q->radius_normal;
            r->gradient += (double)q->radius_gradient;
            for (int a = 0; a < 4; a++) r->cross[a] += (double)q->radius_cross[a];
        }
        shared->square += sum->shared.square;
        shared->weight += sum->shared.weight;
        for (int a = 0; a < 4; a++) {
            shared->gradient[a] += sum->shared.gradient[a];
            for (int c = 0; c < 4; c++) shared->normal[a][c] += sum->shared.normal[a][c];
        }
    }
}

/* States the errors of the axes that the step has made (axis_fit.h). */
static void state_error(double information, double variance, double stiffness, struct axis_profile *p)
{
    double length = pow(stiffness / information, 0.25);
    p->position_se = sqrt(variance / (2.0 * M_SQRT2 * information * length));
    p->direction_se_rad = p->position_se / length;
}

/* What a fit keeps from round to round. */
struct fit_work {
    uint32_t *first_vertex_of; /* per segment */
    struct axis_pull *total;   /* per vertex */
    struct radius_sum *radius; /* per line */
    double *length;
};

static void release_work(struct fit_work *w)
{
    free(w->first_vertex_of);
    free(w->total);
    free(w->radius);
    free(w->length);
}

static bool init_work(struct fit_work *w, const struct polyline_set *lines)
{
    size_t n_segment = 0;
    *w = (struct fit_work){.first_vertex_of = malloc((lines->n_vertex + 1) * sizeof *w->first_vertex_of),
                           .total = malloc((lines->n_vertex + 1) * sizeof *w->total),
                           .radius = malloc((lines->n_line + 1) * sizeof *w->radius),
                           .length = malloc((lines->n_line + 1) * sizeof *w->length)};
    if (w->first_vertex_of == NULL || w->total == NULL || w->radius == NULL || w->length == NULL) return false;
    for (size_t l = 0; l < lines->n_line; l++) {
        for (size_t i = lines->first[l]; i + 1 < lines->first[l + 1]; i++)
            w->first_vertex_of[n_segment++] = (uint32_t)i;
        w->length[l] = (double)polyline_length(lines, l);
    }
    return true;
}

/* Steps all vertices, radii and the profile from the sums of all bricks. */
static status make_step(struct fit_job *job, struct polyline_set *lines, struct fit_work *w, double diameter,
                        struct thread_pool *pool, struct error *err)
{
    struct shared_sum shared = {0};
    memset(w->total, 0, lines->n_vertex * sizeof *w->total);
    memset(w->radius, 0, lines->n_line * sizeof *w->radius);
    add_bricks(job, w->first_vertex_of, w->total, &shared, w->radius);
    shared.square /= job->profile.independent;
    for (size_t l = 0; l < lines->n_line; l++)
        w->radius[l].scatter =
            axis_scatter(&w->total[lines->first[l]].radius_gradient, sizeof *w->total / sizeof(float),
                         polyline_length(lines, l), (size_t)fmax(2.0, PIECE_DIAMETERS * diameter));
    axis_profile_step(&job->profile, &shared, w->radius, w->length, lines->n_line, diameter, lines->radius);
    double sd = job->profile.measured_curvature ? axis_curvature_sd(lines, diameter) : AXIS_CURVATURE_MOST / diameter;
    double variance = shared.weight > 0.0 ? shared.square / shared.weight : 1.0, stiffness = variance / (sd * sd);
    state_error(axis_information(w->total, lines->n_vertex), variance, stiffness, &job->profile);
    return axis_solve_lines(lines, w->total, stiffness, pool, err);
}

static float largest_radius(const struct polyline_set *lines)
{
    float most = 0.0f;
    for (size_t l = 0; l < lines->n_line; l++) most = fmaxf(most, lines->radius[l]);
    return most;
}

static status one_round(struct fit_job *job, struct polyline_set *lines, struct fit_work *w, double diameter,
                        struct thread_pool *pool, const struct progress *progress, struct error *err)
{
    struct segment_bricks bricks = {0};
    job->tail = (float)(AXIS_TAIL * job->profile.blur);
    job->inverse_blur = (float)(1.0 / job->profile.blur);
    status s = segment_bricks_init(&bricks, lines, job->v->n, BRICK, largest_radius(lines) + job->tail + 1.0f, err);
    if (s != STATUS_OK) return s;
    size_t n_brick = segment_n_brick(&bricks);
    job->bricks = &bricks;
    job->sum = calloc(n_brick, sizeof *job->sum);
    if (job->sum == NULL) s = error_set(err, STATUS_NO_MEMORY, "cannot fit fibers: out of memory");
    if (s == STATUS_OK) {
        s = thread_pool_run(pool, n_brick, fit_brick, job, progress);
        if (s != STATUS_OK) error_set(err, s, "fitting fibers was cancelled");
        for (size_t b = 0; b < n_brick && s == STATUS_OK; b++)
            if (job->sum[b].failed) s = error_set(err, STATUS_NO_MEMORY, "cannot fit fibers: out of memory");
    }
    if (s == STATUS_OK) s = make_step(job, lines, w, diameter, pool, err);
    for (size_t b = 0; job->sum != NULL && b < n_brick; b++) free(job->sum[b].pull);
    free(job->sum);
    job->sum = NULL;
    job->bricks = NULL;
    segment_bricks_release(&bricks);
    return s;
}

status polylines_fit(struct polyline_set *lines, const struct volume *v, double diameter_voxel, int n_round,
                     struct axis_profile *profile, struct thread_pool *pool, const struct progress *progress,
                     struct error *err)
{
    struct fit_job *job = calloc(1, sizeof *job);
    struct fit_work work = {0};
    status s = STATUS_OK;
    if (job != NULL) job->scratch = malloc(thread_pool_n_thread(pool) * sizeof *job->scratch);
    if (job == NULL || job->scratch == NULL || !init_work(&work, lines)) {
        s = error_set(err, STATUS_NO_MEMORY, "cannot fit fibers: out of memory");
        goto out;
    }
    job->v = v;
    job->profile = *profile;
    axis_table_init(&job->table);
    for (size_t l = 0; l < lines->n_line; l++)
        if (!(lines->radius[l] > 0.0f)) lines->radius[l] = (float)(0.5 * diameter_voxel);
    for (int round = 0; round < n_round && s == STATUS_OK; round++)
        s = one_round(job, lines, &work, diameter_voxel, pool, progress, err);
    if (s == STATUS_OK) *profile = job->profile;
out:
    release_work(&work);
    if (job != NULL) free(job->scratch);
    free(job);
    return s;
}
