/* The visibility of every segment, as signed distances in principal components and as weights of spherical Gaussians
 * (fabric thesis, section 6.4.1). Unlike there, segments that see nothing have no row, distances are kept on a grid
 * of half the picture's resolution, and the components follow from at most 2,048 segments. */
#include "renderer/fast/precompute/distance_components.h"
#include "renderer/fast/precompute/precompute_parts.h"
#include "renderer/fast/precompute/segment_picture.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { MOST_EXAMPLE = 2048, TASK_SEGMENTS = 64, N_AXIS = 2 * FAST_N_GAUSSIAN };

struct visibility_job {
    struct precompute_job *j;
    struct sphere_directions directions;
    uint8_t axis_of[SPHERE_PIXEL];  /* nearest axis of segment 0's, which are not turned */
    float axis_solid_angle[N_AXIS]; /* of the pixels nearest to it */
    uint32_t *segment;              /* of each row */
    float *example;                 /* n_example x SPHERE_GRID */
    size_t n_example;
    float *component; /* FAST_N_COMPONENT x SPHERE_GRID */
    float *mean;      /* SPHERE_GRID */
    float *number;    /* n_row x FAST_N_COMPONENT */
};

static void find_axes(struct visibility_job *v)
{
    float axis[N_AXIS][3];
    memset(v->axis_solid_angle, 0, sizeof v->axis_solid_angle);
    for (size_t q = 0; q < N_AXIS; q++) fast_tables_axis(0, q, axis[q]);
    for (size_t p = 0; p < SPHERE_PIXEL; p++) {
        const float *d = v->directions.direction[p];
        float best = -2;
        for (size_t q = 0; q < N_AXIS; q++) {
            float c = d[0] * axis[q][0] + d[1] * axis[q][1] + d[2] * axis[q][2];
            if (c <= best) continue;
            best = c;
            v->axis_of[p] = (uint8_t)q;
        }
        v->axis_solid_angle[v->axis_of[p]] += v->directions.solid_angle[p / FAST_N_PICTURE];
    }
}

static void look_for_open(void *context, size_t i_task, size_t i_thread)
{
    (void)i_thread;
    const struct visibility_job *v = context;
    struct fast_tables *t = v->j->t;
    for (size_t i = i_task * TASK_SEGMENTS; i < (i_task + 1) * TASK_SEGMENTS && i < t->n_segment; i++)
        t->segment_row[i] = segment_sees(v->j->q->scene, &v->directions, (uint32_t)i) ? 0 : FAST_NO_ROW;
}

static void take_example(void *context, size_t i_task, size_t i_thread)
{
    (void)i_thread;
    const struct visibility_job *v = context;
    uint8_t picture[SPHERE_PIXEL];
    size_t row = i_task * v->j->t->n_row / v->n_example;
    segment_picture(v->j->q->scene, &v->directions, v->segment[row], picture);
    sphere_distance(&v->directions, picture, v->example + i_task * SPHERE_GRID);
}

/* Columns of the picture by which the axes of a segment are turned. */
static size_t turned_columns(uint32_t i_segment)
{
    float axis[3], plain[3];
    fast_tables_axis(i_segment, 1, axis);
    fast_tables_axis(0, 1, plain);
    double turn = (double)(atan2f(axis[1], axis[0]) - atan2f(plain[1], plain[0])) / (2.0 * M_PI);
    return (size_t)lrint((turn + 2.0) * FAST_N_PICTURE) % FAST_N_PICTURE;
}

static void weigh(const struct visibility_job *v, uint32_t i_segment, const uint8_t *picture, uint8_t *weight)
{
    float seen[N_AXIS] = {0};
    size_t shift = FAST_N_PICTURE - turned_columns(i_segment);
    for (size_t p = 0; p < SPHERE_PIXEL; p++) {
        if (picture[p] == 0) continue;
        size_t row = p / FAST_N_PICTURE, column = (p + shift) % FAST_N_PICTURE;
        seen[v->axis_of[row * FAST_N_PICTURE + column]] += v->directions.solid_angle[row];
    }
    for (size_t q = 0; q < N_AXIS; q++) weight[q] = (uint8_t)lrintf(fminf(255, 255 * seen[q] / v->axis_solid_angle[q]));
}

static void fill_rows(void *context, size_t i_task, size_t i_thread)
{
    (void)i_thread;
    const struct visibility_job *v = context;
    const struct fast_tables *t = v->j->t;
    uint8_t picture[SPHERE_PIXEL];
    float distance[SPHERE_GRID];
    for (size_t row = i_task * TASK_SEGMENTS; row < (i_task + 1) * TASK_SEGMENTS && row < t->n_row; row++) {
        if (progress_cancelled(v->j->progress)) return;
        segment_picture(v->j->q->scene, &v->directions, v->segment[row], picture);
        weigh(v, v->segment[row], picture, t->gaussian + row * N_AXIS);
        sphere_distance(&v->directions, picture, distance);
        for (size_t p = 0; p < SPHERE_GRID; p++) distance[p] -= v->mean[p];
        for (size_t k = 0; k < FAST_N_COMPONENT; k++) {
            const float *c = v->component + k * SPHERE_GRID;
            float sum[8] = {0}, all = 0;
            for (size_t p = 0; p < SPHERE_GRID; p += 8)
                for (size_t l = 0; l < 8; l++) sum[l] += c[p + l] * distance[p + l];
            for (size_t l = 0; l < 8; l++) all += sum[l];
            v->number[row * FAST_N_COMPONENT + k] = all;
        }
    }
}

static void keep_numbers(const struct visibility_job *v)
{
    struct fast_tables *t = v->j->t;
    for (size_t k = 0; k < FAST_N_COMPONENT; k++) {
        float most = 0;
        for (size_t i = 0; i < t->n_row; i++) most = fmaxf(most, fabsf(v->number[i * FAST_N_COMPONENT + k]));
        t->component_scale[k] = most / 127;
        float inv = most > 0 ? 127 / most : 0;
        for (size_t i = 0; i < t->n_row; i++)
            t->component[i * FAST_N_COMPONENT + k] = (int8_t)lrintf(v->number[i * FAST_N_COMPONENT + k] * inv);
    }
    for (size_t p = 0; p < SPHERE_GRID; p++) {
        float *b = t->basis + p * (1 + FAST_N_COMPONENT);
        b[0] = v->mean[p];
        for (size_t k = 0; k < FAST_N_COMPONENT; k++) b[1 + k] = v->component[k * SPHERE_GRID + p];
    }
}

static status find_rows(struct visibility_job *v, struct error *err)
{
    struct fast_tables *t = v->j->t;
    struct progress silent = progress_silent(v->j->progress);
    t->n_segment = (uint32_t)scene_n_segment(v->j->q->scene);
    status s = fast_tables_reserve_segments(t, err);
    if (s != STATUS_OK || v->j->q->no_visibility) return s;
    const struct journal_part part = {
        JOURNAL_OPEN_SEGMENTS, t->n_segment, 1, {{t->segment_row, sizeof *t->segment_row}}};
    const struct journal_work work = {look_for_open, v, TASK_SEGMENTS};
    s = precompute_journal_run(v->j->journal, &part, &work, v->j->pool, &silent, err);
    v->segment = malloc((t->n_segment + 1u) * sizeof *v->segment);
    if (s == STATUS_OK && v->segment == NULL) s = error_set(err, STATUS_NO_MEMORY, "cannot make tables: out of memory");
    for (uint32_t i = 0; i < t->n_segment && s == STATUS_OK; i++) {
        if (t->segment_row[i] == FAST_NO_ROW) continue;
        v->segment[t->n_row] = i;
        t->segment_row[i] = t->n_row++;
    }
    return s;
}

static status find_components(struct visibility_job *v, struct error *err)
{
    const struct fast_tables *t = v->j->t;
    struct progress silent = progress_silent(v->j->progress);
    v->n_example = t->n_row < MOST_EXAMPLE ? t->n_row : MOST_EXAMPLE;
    v->example = malloc((v->n_example * SPHERE_GRID + 1) * sizeof *v->example);
    v->component = malloc(FAST_N_COMPONENT * SPHERE_GRID * sizeof *v->component);
    v->mean = calloc(SPHERE_GRID, sizeof *v->mean);
    v->number = malloc(((size_t)t->n_row * FAST_N_COMPONENT + 1) * sizeof *v->number);
    if (v->example == NULL || v->component == NULL || v->mean == NULL || v->number == NULL)
        return error_set(err, STATUS_NO_MEMORY, "cannot make tables: out of memory");
    const struct journal_part part = {JOURNAL_COMPONENTS,
                                      1,
                                      2,
                                      {{v->mean, SPHERE_GRID * sizeof *v->mean},
                                       {v->component, FAST_N_COMPONENT * SPHERE_GRID * sizeof *v->component}}};
    if (precompute_journal_has(v->j->journal, &part)) return STATUS_OK;
    status s = thread_pool_run(v->j->pool, v->n_example, take_example, v, &silent);
    if (s == STATUS_OK)
        s = distance_components(v->example, v->n_example, SPHERE_GRID, FAST_N_COMPONENT, v->j->pool, v->mean,
                                v->component, err);
    return s == STATUS_OK ? precompute_journal_keep(v->j->journal, &part, err) : s;
}

static status fill_all_rows(struct visibility_job *v, struct error *err)
{
    struct fast_tables *t = v->j->t;
    const struct journal_part part = {
        JOURNAL_SEGMENTS, t->n_row, 2, {{t->gaussian, N_AXIS}, {v->number, FAST_N_COMPONENT * sizeof *v->number}}};
    const struct journal_work work = {fill_rows, v, TASK_SEGMENTS};
    return precompute_journal_run(v->j->journal, &part, &work, v->j->pool, v->j->progress, err);
}

status precompute_visibility(struct precompute_job *j, struct error *err)
{
    struct visibility_job *v = calloc(1, sizeof *v);
    if (v == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot make tables: out of memory");
    v->j = j;
    sphere_directions_init(&v->directions);
    find_axes(v);
    status s = find_rows(v, err);
    if (s == STATUS_OK) s = fast_tables_reserve_rows(j->t, err);
    if (s == STATUS_OK && j->t->n_row > 0) {
        s = find_components(v, err);
        if (s == STATUS_OK) s = fill_all_rows(v, err);
        if (s == STATUS_OK) keep_numbers(v);
    }
    if (s == STATUS_CANCELLED) error_set(err, s, "cancelled");
    free(v->segment);
    free(v->example);
    free(v->component);
    free(v->mean);
    free(v->number);
    free(v);
    return s;
}
