#include "geometry/fibers/axes/axis_round.h"

#include <stdlib.h>

static const float ROUNDING = 0.01f; /* voxels added to the reach of segments */

status axis_batch_init(struct axis_batch *b, size_t n_thread, struct error *err)
{
    axis_table_init(&b->model.table);
    b->scratch = malloc(n_thread * sizeof *b->scratch);
    b->failed = calloc(n_thread, sizeof *b->failed);
    for (size_t t = 0; t < n_thread && b->scratch != NULL; t++) axis_scratch_init(&b->scratch[t]);
    return b->scratch != NULL && b->failed != NULL
               ? STATUS_OK
               : error_set(err, STATUS_NO_MEMORY, "cannot fit fibers: out of memory");
}

void axis_batch_release(struct axis_batch *b, size_t n_thread)
{
    for (size_t t = 0; t < n_thread && b->scratch != NULL; t++) axis_scratch_release(&b->scratch[t]);
    free(b->scratch);
    free(b->failed);
}

status axis_batch_start(struct axis_batch *b, struct error *err)
{
    b->sum = calloc(b->n_brick, sizeof *b->sum);
    return b->sum != NULL ? STATUS_OK : error_set(err, STATUS_NO_MEMORY, "cannot fit fibers: out of memory");
}

void axis_brick_sum_release(struct axis_brick_sum *sum)
{
    free(sum->equation);
    free(sum->section);
    free(sum->lumen);
    *sum = (struct axis_brick_sum){0};
}

void axis_batch_end(struct axis_batch *b)
{
    for (size_t i = 0; b->sum != NULL && i < b->n_brick; i++) axis_brick_sum_release(&b->sum[i]);
    free(b->sum);
    b->sum = NULL;
}

void axis_batch_fit(void *batch, size_t i_brick, size_t i_thread)
{
    struct axis_batch *b = batch;
    scratch_keep_within(b->model.v->space);
    if (!axis_brick_fit(&b->model, b->first_brick + i_brick, &b->scratch[i_thread], &b->sum[i_brick]))
        b->failed[i_thread] = true;
}

/* Finds how far each segment's fiber reaches in the model. view: NULL for discs. */
static void find_reach(const struct polyline_set *lines, const struct section_view *view, float tail, float *reach)
{
    for (size_t l = 0, n = 0; l < lines->n_line; l++)
        for (size_t i = lines->first[l]; i + 1 < lines->first[l + 1]; i++, n++)
            reach[n] = (view != NULL ? view[n].stretch : 1.0f) * polyline_segment_radius(lines, l, i) + tail + ROUNDING;
}

/* Prepares the sections of all segments. */
static void view_sections(const struct polyline_set *lines, struct fiber_section *section, struct section_view *view)
{
    fiber_sections_turn(lines, section);
    for (size_t l = 0; l < lines->n_line; l++)
        for (size_t i = lines->first[l]; i + 1 < lines->first[l + 1]; i++)
            *view++ = fiber_section_view(&section[i], &section[i + 1], lines->vertex[i], lines->vertex[i + 1]);
}

static void prepare_profile(struct axis_model *m)
{
    m->tail = (float)(AXIS_TAIL * m->profile.blur);
    m->inverse_blur = (float)(1.0 / m->profile.blur);
}

status axis_round_prepare(struct axis_model *m, const struct polyline_set *lines, const size_t n[3],
                          struct section_view *view, float *reach, struct segment_bricks *bricks, struct error *err)
{
    prepare_profile(m);
    if (view != NULL) view_sections(lines, m->profile.section, view);
    find_reach(lines, view, m->tail, reach);
    m->section = view;
    m->bricks = bricks;
    m->nearest_of = NULL;
    m->nearest_tail = m->tail;
    return segment_bricks_init_each(bricks, lines, n, AXIS_BRICK, reach, err);
}

status axis_round_follow(struct axis_model *m, const struct polyline_set *lines, struct segment_bricks *bricks,
                         struct segment **nearest_of, struct error *err)
{
    prepare_profile(m);
    status s = segment_bricks_move(bricks, lines, nearest_of, err);
    m->section = NULL;
    m->bricks = bricks;
    m->nearest_of = *nearest_of;
    return s;
}
