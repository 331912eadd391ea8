#include "geometry/fibers/axes/axis_fit.h"
#include "base/small_matrix.h"
#include "geometry/fibers/axes/axis_error.h"
#include "geometry/fibers/axes/axis_round.h"
#include "geometry/fibers/axes/axis_share.h"
#include "geometry/fibers/axes/axis_solve.h"
#include "geometry/fibers/axes/model/nearest_rounds.h"
#include "geometry/fibers/axes/shape_measure.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { MAX_BATCH = 1 << 16 };                /* segments, of 128 bytes each, and of 200 with sections */
static const double SECTION_DIAMETERS = 1.0; /* length over which sections are smoothed */
/* Standard deviation of the flatness of fibers (fiber_section.h) that holds sections to discs. */
static const double FLATNESS_SD = 0.3;
static const double PIECE_DIAMETERS = 2.0; /* length of the pieces that show the error of a radius */

static void add_shared(struct shared_sum *to, const struct shared_sum *from)
{
    to->square += from->square;
    to->weight += from->weight;
    to->slope += from->slope;
    to->edge_slope += from->edge_slope;
    for (int a = 0; a < AXIS_N_SHARED; a++) {
        to->gradient[a] += from->gradient[a];
        for (int c = 0; c < AXIS_N_SHARED; c++) to->normal[a][c] += from->normal[a][c];
    }
}

/* Data that a fit keeps from round to round. */
struct fit_work {
    uint32_t *first_vertex_of;        /* per segment */
    struct axis_equation *total;      /* per vertex */
    float *reach;                     /* per segment */
    double *stiffness;                /* per vertex */
    struct section_view *view;        /* per segment; NULL for discs, as the next */
    struct section_equation *section; /* per vertex */
    struct lumen_view *lumen_view;    /* per segment; NULL for solid fibers, as the next two */
    struct lumen_equation *lumen;     /* per vertex: of the segment after it */
    struct lumen_table *lumen_table;
    struct radius_sum *radius; /* per line */
    double *length;
    struct segment_bricks bricks; /* of the round */
    struct segment *nearest_of;   /* segments of the round whose nearest segments are used; NULL: this one */
    struct nearest_cache store;
    struct nearest_rounds rounds;
    struct shared_sum shared;
    double hold;        /* of the sections to discs */
    double last_square; /* mean square of the residuals in the round before */
};

static void release_round(struct fit_work *w)
{
    free(w->nearest_of);
    w->nearest_of = NULL;
    nearest_cache_release(&w->store);
    segment_bricks_release(&w->bricks);
}

static void release_work(struct fit_work *w)
{
    release_round(w);
    free(w->first_vertex_of);
    free(w->total);
    free(w->reach);
    free(w->stiffness);
    free(w->view);
    free(w->section);
    free(w->lumen_view);
    free(w->lumen);
    free(w->lumen_table);
    free(w->radius);
    free(w->length);
    nearest_rounds_release(&w->rounds);
}

static bool init_work(struct fit_work *w, const struct polyline_set *lines, bool with_sections, bool with_lumens)
{
    size_t n_segment = 0;
    *w = (struct fit_work){.first_vertex_of = malloc((lines->n_vertex + 1) * sizeof *w->first_vertex_of),
                           .total = malloc((lines->n_vertex + 1) * sizeof *w->total),
                           .reach = malloc((lines->n_vertex + 1) * sizeof *w->reach),
                           .stiffness = malloc((lines->n_vertex + 1) * sizeof *w->stiffness),
                           .radius = malloc((lines->n_line + 1) * sizeof *w->radius),
                           .length = malloc((lines->n_line + 1) * sizeof *w->length)};
    if (w->first_vertex_of == NULL || w->total == NULL || w->reach == NULL || w->stiffness == NULL ||
        w->radius == NULL || w->length == NULL)
        return false;
    if (with_sections) {
        w->view = malloc((lines->n_vertex + 1) * sizeof *w->view);
        w->section = malloc((lines->n_vertex + 1) * sizeof *w->section);
        if (w->view == NULL || w->section == NULL) return false;
    }
    if (with_lumens) {
        w->lumen_view = malloc((lines->n_vertex + 1) * sizeof *w->lumen_view);
        w->lumen = malloc((lines->n_vertex + 1) * sizeof *w->lumen);
        w->lumen_table = malloc(sizeof *w->lumen_table);
        if (w->lumen_view == NULL || w->lumen == NULL || w->lumen_table == NULL) return false;
        lumen_table_init(w->lumen_table);
    }
    for (size_t l = 0; l < lines->n_line; l++) {
        for (size_t i = lines->first[l]; i + 1 < lines->first[l + 1]; i++)
            w->first_vertex_of[n_segment++] = (uint32_t)i;
        w->length[l] = (double)polyline_length(lines, l);
    }
    return true;
}

/* Adds the terms of a segment to the sections at its ends. */
static void add_section(struct section_equation *ends, const struct section_equation *q)
{
    for (int end = 0; end < 2; end++) {
        for (int i = 0; i < 3; i++) ends[end].normal[i] += 0.5f * q->normal[i];
        for (int i = 0; i < 2; i++) ends[end].gradient[i] += 0.5f * q->gradient[i];
    }
}

/* Adds the terms of a segment to the lumen of its line, and keeps them at its first vertex. */
static void add_lumen(struct fit_work *w, uint32_t segment, const struct lumen_equation *q, struct radius_sum *r)
{
    lumen_equation_add(&w->lumen[w->first_vertex_of[segment]], q);
    r->area_normal += (double)q->normal;
    r->area_gradient += (double)q->gradient;
    r->area_by_radius += (double)q->by_radius;
    for (int a = 0; a < AXIS_N_SHARED; a++) r->area_cross[a] += (double)q->cross[a];
    r->cross[4] += (double)q->radius_shared;
}

/* The sums of a batch, added in PARTS parts of whole lines. */
enum { PARTS = 16 };
struct batch_sums {
    const struct axis_batch *job;
    struct fit_work *work;
};

/* First segment of part i, which begins a line. */
static uint32_t part_begin(const struct segment_bricks *bricks, size_t i)
{
    size_t s = bricks->n_segment * i / PARTS;
    while (s > 0 && s < bricks->n_segment && bricks->segment[s].line == bricks->segment[s - 1].line) s++;
    return (uint32_t)s;
}

/* Place of the first of n rising segments of a brick's list that is not before one. */
static size_t first_from(const uint32_t *index, size_t n, uint32_t segment)
{
    size_t low = 0, high = n;
    while (low < high) {
        const size_t middle = (low + high) / 2;
        if (index[middle] < segment)
            low = middle + 1;
        else
            high = middle;
    }
    return low;
}

/* Adds a segment of a brick, number e of its list. */
static void add_segment(struct fit_work *w, const struct axis_brick_sum *sum, size_t e, uint32_t line)
{
    struct radius_sum *r = &w->radius[line];
    const uint32_t segment = sum->equation[2 * e].segment, vertex = w->first_vertex_of[segment];
    for (uint32_t end = 0; end < 2; end++) {
        const struct axis_equation *q = &sum->equation[2 * e + end];
        axis_equation_add(&w->total[vertex + end], q);
        r->normal += (double)q->radius_normal;
        r->gradient += (double)q->radius_gradient;
        for (int a = 0; a < 4; a++) r->cross[a] += (double)q->radius_cross[a];
    }
    if (sum->section != NULL) add_section(&w->section[vertex], &sum->section[e]);
    if (sum->lumen != NULL) add_lumen(w, segment, &sum->lumen[e], r);
}

static void add_part(void *context, size_t i_part, size_t i_thread)
{
    (void)i_thread;
    const struct batch_sums *sums = context;
    const struct axis_batch *job = sums->job;
    const struct segment_bricks *bricks = job->model.bricks;
    const uint32_t begin = part_begin(bricks, i_part), end = part_begin(bricks, i_part + 1);
    for (size_t b = 0; b < job->n_brick; b++) {
        const size_t *first = &bricks->first[job->first_brick + b];
        const uint32_t *index = bricks->index + first[0];
        const size_t n = first[1] - first[0];
        for (size_t e = first_from(index, n, begin); e < n && index[e] < end; e++)
            add_segment(sums->work, &job->sum[b], e, bricks->segment[index[e]].line);
    }
}

/* Adds the bricks of a batch, for each line in order, so that sums do not depend on the number of threads. */
static void add_batch(const struct axis_batch *job, struct fit_work *w, struct thread_pool *pool)
{
    struct batch_sums sums = {job, w};
    thread_pool_run(pool, PARTS, add_part, &sums, NULL);
    for (size_t b = 0; b < job->n_brick; b++) add_shared(&w->shared, &job->sum[b].shared);
}

/* Damps the steps more where the last one was too long, and less where it was not. */
static void damp(struct fit_work *w, struct axis_profile *p)
{
    const double square = w->shared.weight > 0.0 ? w->shared.square / w->shared.weight : 0.0;
    if (w->last_square > 0.0) p->damping *= square > w->last_square ? 4.0 : 0.5;
    w->last_square = square;
}

/* States the errors of the axes after the last step. */
static void state_errors(const struct fit_work *w, size_t n_vertex, double diameter, struct axis_profile *p)
{
    const bool measured = p->section != NULL && p->measure != NULL;
    const double slope = axis_edge_slope(&w->shared), mean_slope = axis_mean_slope(&w->shared);
    const struct axis_data data = {.information = axis_information(w->total, n_vertex),
                                   .slope = slope,
                                   .residual = w->shared.square / w->shared.weight / p->independent,
                                   /* measured per information with the mean slope */
                                   .noise = measured ? p->measure->axis_noise * mean_slope / slope : 0.0,
                                   .correlation = p->measured_curvature ? axis_bend_correlation(diameter) : 0.0};
    if (w->shared.weight > 0.0) axis_errors(&data, w->stiffness, n_vertex, &p->position_se, &p->direction_se_rad);
}

/* Steps all vertices, radii and the profile from the sums of all bricks. */
static status make_step(struct axis_batch *job, struct polyline_set *lines, struct fit_work *w, double diameter,
                        struct thread_pool *pool, struct error *err)
{
    struct axis_profile *profile = &job->model.profile;
    struct shared_sum shared = w->shared;
    shared.square /= profile->independent;
    for (size_t l = 0; l < lines->n_line; l++)
        w->radius[l].scatter =
            axis_scatter(&w->total[lines->first[l]].radius_gradient, sizeof *w->total / sizeof(float),
                         polyline_length(lines, l), (size_t)fmax(2.0, PIECE_DIAMETERS * diameter));
    if (profile->lumen != NULL) damp(w, profile);
    axis_profile_step(profile, &shared, w->radius, w->length, lines->n_line, diameter, lines->radius);
    polyline_shapes_follow(lines, false);
    const double variance = shared.weight > 0.0 ? shared.square / shared.weight : 1.0,
                 sd = AXIS_CURVATURE_MOST / diameter,
                 correlation = profile->measured_curvature ? axis_bend_correlation(diameter) : 0.0;
    if (profile->measured_curvature)
        axis_local_stiffness(lines, diameter, variance, w->stiffness);
    else
        for (size_t i = 0; i < lines->n_vertex; i++) w->stiffness[i] = variance / (sd * sd);
    status s = STATUS_OK;
    w->hold = variance / (FLATNESS_SD * FLATNESS_SD);
    if (w->section != NULL)
        s = fiber_sections_solve(lines, w->section, SECTION_DIAMETERS * diameter, w->hold, profile->section, pool, err);
    nearest_rounds_before_step(&w->rounds, lines);
    if (s == STATUS_OK) s = axis_solve_lines(lines, w->total, w->stiffness, correlation, pool, err);
    nearest_rounds_after_step(&w->rounds, lines);
    return s;
}

static void view_lumens(const struct polyline_set *lines, const struct axis_profile *p,
                        const struct section_view *section, struct lumen_view *view)
{
    for (size_t l = 0; l < lines->n_line; l++)
        for (size_t i = lines->first[l]; i + 1 < lines->first[l + 1]; i++)
            *view++ = lumen_view_make(section++, polyline_segment_radius(lines, l, i), p->lumen[l], (float)p->blur);
}

/* Number of bricks from job->first_brick on that are fitted before their sums are added: at least one layer of bricks,
 * and more while they have at most MAX_BATCH segments. */
static size_t batch_size(const struct axis_batch *job)
{
    const struct segment_bricks *b = job->model.bricks;
    size_t layer = b->n_brick[0] * b->n_brick[1], end = job->first_brick + layer;
    while (end < segment_n_brick(b) && b->first[end + layer] - b->first[job->first_brick] <= MAX_BATCH) end += layer;
    return end - job->first_brick;
}

/* Fits a batch of bricks, with the other ranks where they have the volume, and adds their sums to the work. */
static status fit_batch(struct axis_batch *job, struct fit_work *w, struct thread_pool *pool,
                        const struct progress *progress, struct error *err)
{
    const struct progress quiet = progress_silent(progress);
    bool failed = false;
    status s = axis_batch_start(job, err);
    if (s != STATUS_OK) return s;
    if (axis_share_can(job))
        s = axis_share_bricks(job, pool, &quiet, err);
    else
        s = thread_pool_run(pool, job->n_brick, axis_batch_fit, job, &quiet);
    for (size_t t = 0; t < thread_pool_n_thread(pool); t++) failed = failed || job->failed[t];
    if (s == STATUS_CANCELLED)
        error_set(err, s, "fitting fibers was cancelled");
    else if (s == STATUS_OK && failed)
        s = error_set(err, STATUS_NO_MEMORY, "cannot fit fibers: out of memory");
    else if (s == STATUS_OK)
        add_batch(job, w, pool);
    axis_batch_end(job);
    return s;
}

/* Prepares the model. kind.follows: this round uses the nearest segments of an earlier one; kind.is_followed: the next
 * round uses the nearest segments of this one. */
static status start_round(struct axis_model *m, const struct polyline_set *lines, struct fit_work *w,
                          struct round_kind kind, struct error *err)
{
    status s = STATUS_OK;
    if (m->v->slabs != NULL && m->profile.lumen == NULL) s = axis_share_round(m, lines, kind.follows, err);
    if (s != STATUS_OK) return s;
    if (kind.follows) return axis_round_follow(m, lines, &w->bricks, &w->nearest_of, err);
    release_round(w);
    s = axis_round_prepare(m, lines, m->v->n, w->view, w->reach, &w->bricks, err);
    m->store = NULL;
    if (s != STATUS_OK || !kind.is_followed) return s;
    if (!nearest_cache_init(&w->store, segment_n_brick(&w->bricks), scratch_buffer_bytes(m->v->space)))
        return error_set(err, STATUS_NO_MEMORY, "cannot fit fibers: out of memory");
    m->store = &w->store;
    return s;
}

static status one_round(struct axis_batch *job, struct polyline_set *lines, struct fit_work *w, double diameter,
                        struct thread_pool *pool, const struct progress *progress, struct error *err)
{
    struct axis_model *m = &job->model;
    status s = STATUS_OK;
    if (w->view != NULL) memset(w->section, 0, lines->n_vertex * sizeof *w->section);
    if (w->lumen_view != NULL) {
        view_lumens(lines, &m->profile, w->view, w->lumen_view);
        memset(w->lumen, 0, lines->n_vertex * sizeof *w->lumen);
    }
    m->lumen = w->lumen_view;
    m->lumen_table = w->lumen_table;
    const size_t n_brick = segment_n_brick(&w->bricks);
    memset(w->total, 0, lines->n_vertex * sizeof *w->total);
    memset(w->radius, 0, lines->n_line * sizeof *w->radius);
    w->shared = (struct shared_sum){0};
    for (job->first_brick = 0; job->first_brick < n_brick && s == STATUS_OK; job->first_brick += job->n_brick) {
        job->n_brick = batch_size(job);
        s = fit_batch(job, w, pool, progress, err);
        progress_report(progress, (double)(job->first_brick + job->n_brick) / (double)n_brick);
    }
    if (s == STATUS_OK) s = make_step(job, lines, w, diameter, pool, err);
    return s;
}

/* Variances of a change of all radii, and of the areas of all lumens, together, for a noise of 1. n: of the shared
 * numbers that the fit has, 4 without lumens. */
static void shared_variances(const struct shared_sum *shared, size_t n, double *radius, double *area)
{
    double m[AXIS_N_SHARED * AXIS_N_SHARED], inverse[AXIS_N_SHARED * AXIS_N_SHARED];
    for (size_t a = 0; a < n; a++)
        for (size_t b = 0; b < n; b++) m[n * a + b] = shared->normal[a][b];
    const bool known = small_invert(m, n, inverse);
    *radius = known ? inverse[0] : INFINITY;
    *area = known && n == AXIS_N_SHARED ? inverse[n * n - 1] : INFINITY;
}

status polylines_fit(struct polyline_set *lines, const struct volume *v, double diameter_voxel, int n_round,
                     struct axis_profile *profile, struct thread_pool *pool, const struct progress *progress,
                     struct error *err)
{
    const size_t n_thread = thread_pool_n_thread(pool);
    struct axis_batch *job = calloc(1, sizeof *job);
    struct fit_work work = {0};
    if (job == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot fit fibers: out of memory");
    job->model.v = v;
    job->model.profile = *profile;
    status s = axis_batch_init(job, n_thread, err);
    if (s == STATUS_OK &&
        !init_work(&work, lines, profile->section != NULL, profile->section != NULL && profile->lumen != NULL))
        s = error_set(err, STATUS_NO_MEMORY, "cannot fit fibers: out of memory");
    /* sections are left out, because their outlines change */
    if (s == STATUS_OK && profile->at_rest && profile->section == NULL &&
        !nearest_rounds_start(&work.rounds, lines->n_vertex))
        s = error_set(err, STATUS_NO_MEMORY, "cannot fit fibers: out of memory");
    for (size_t l = 0; l < lines->n_line; l++)
        if (!(lines->radius[l] > 0.0f)) lines->radius[l] = (float)(0.5 * diameter_voxel);
    for (int round = 0; round < n_round && s == STATUS_OK; round++) {
        struct progress_part part = {progress, (double)round / n_round, 1.0 / n_round};
        const struct progress inner = progress_of_part(&part);
        s = start_round(&job->model, lines, &work, nearest_rounds_next(&work.rounds, round + 1 == n_round), err);
        if (s == STATUS_OK) s = one_round(job, lines, &work, diameter_voxel, pool, &inner, err);
    }
    if (s == STATUS_OK) *profile = job->model.profile;
    if (s == STATUS_OK && n_round > 0 && profile->section != NULL && profile->measure != NULL) {
        struct shape_sums sums = {.equation = work.total,
                                  .section = work.section,
                                  .sections = profile->section,
                                  .lumen = work.lumen,
                                  .area = profile->lumen,
                                  .diameter = diameter_voxel,
                                  .section_length = SECTION_DIAMETERS * diameter_voxel,
                                  .section_hold = work.hold,
                                  .slope = axis_mean_slope(&work.shared)};
        shared_variances(&work.shared, profile->lumen != NULL ? AXIS_N_SHARED : AXIS_N_SHARED - 1, &sums.shared_radius,
                         &sums.shared_area);
        sums.model_square = profile->model_error * profile->model_error * work.shared.weight;
        fiber_sections_turn(lines, profile->section);
        s = fiber_shapes_measure(lines, &sums, profile->measure, err);
    }
    if (s == STATUS_OK && n_round > 0) state_errors(&work, lines->n_vertex, diameter_voxel, profile);
    release_work(&work);
    axis_batch_release(job, n_thread);
    free(job);
    return s;
}
