#include "geometry/filter/line_bound.h"

#include <stdlib.h>
#include <string.h>

struct bound_job {
    struct volume blurred;
    struct line_bound *b;
    float least;
    size_t layer;
};

static bool any_above(const struct bound_job *job, const size_t from[3], const size_t to[3])
{
    for (size_t k = from[2]; k < to[2]; k++)
        for (size_t j = from[1]; j < to[1]; j++) {
            const float *row = job->blurred.density + volume_index(job->blurred.n, 0, j, k);
            int above = 0; /* no early exit, so that the loop over a row is vectorised */
            for (size_t i = from[0]; i < to[0]; i++) above |= row[i] >= job->least;
            if (above) return true;
        }
    return false;
}

static void mark_row(void *context, size_t y, size_t i_thread)
{
    (void)i_thread;
    const struct bound_job *job = context;
    struct line_bound *b = job->b;
    scratch_keep_within(job->blurred.space);
    for (size_t x = 0; x < b->n[0]; x++) {
        const size_t cell[3] = {x, y, job->layer};
        size_t from[3], to[3];
        for (int a = 0; a < 3; a++) {
            from[a] = cell[a] * LINE_BOUND_CELL;
            to[a] = from[a] + LINE_BOUND_CELL < job->blurred.n[a] ? from[a] + LINE_BOUND_CELL : job->blurred.n[a];
        }
        b->reaches[(job->layer * b->n[1] + y) * b->n[0] + x] = any_above(job, from, to);
    }
}

/* Marks the cells whose L is at least `least` somewhere. */
static status mark_cells(struct line_bound *b, struct line_blur *blur, float least, struct thread_pool *pool)
{
    struct bound_job job = {.b = b, .least = least};
    status s = STATUS_OK;
    for (job.layer = 0; job.layer < b->n[2] && s == STATUS_OK; job.layer++) {
        const size_t from = job.layer * LINE_BOUND_CELL, n = line_blur_volume(blur).n[2];
        s = line_blur_move(blur, from, from + LINE_BOUND_CELL < n ? from + LINE_BOUND_CELL : n, pool, NULL);
        job.blurred = line_blur_volume(blur);
        if (s == STATUS_OK) s = thread_pool_run(pool, b->n[1], mark_row, &job, NULL);
    }
    return s;
}

/* Sets a cell if one within `cells` of it along one axis is set. Applied along all three axes this dilates by a box. */
static void dilate(const struct line_bound *b, int axis, size_t cells, const bool *in, bool *out)
{
    size_t stride = axis == 0 ? 1 : axis == 1 ? b->n[0] : b->n[0] * b->n[1], n = b->n[0] * b->n[1] * b->n[2];
    memset(out, 0, n * sizeof *out);
    for (size_t i = 0; i < n; i++) {
        if (!in[i]) continue;
        size_t x = i / stride % b->n[axis], before = x < cells ? x : cells;
        size_t after = b->n[axis] - 1 - x < cells ? b->n[axis] - 1 - x : cells;
        for (size_t c = 0; c <= before + after; c++) out[i - before * stride + c * stride] = true;
    }
}

status line_bound_init(struct line_bound *b, struct line_blur *blur, size_t reach, double least,
                       struct thread_pool *pool, struct error *err)
{
    *b = (struct line_bound){0};
    const struct volume blurred = line_blur_volume(blur);
    for (int a = 0; a < 3; a++) b->n[a] = (blurred.n[a] + LINE_BOUND_CELL - 1) / LINE_BOUND_CELL;
    size_t n = b->n[0] * b->n[1] * b->n[2], cells = (reach + LINE_BOUND_CELL - 1) / LINE_BOUND_CELL;
    bool *other = malloc(n * sizeof *other);
    b->reaches = malloc(n * sizeof *b->reaches);
    if (other == NULL || b->reaches == NULL) {
        free(other);
        line_bound_release(b);
        return error_set(err, STATUS_NO_MEMORY, "cannot filter directions: out of memory");
    }
    /* the factor keeps rounding from excluding a voxel */
    status s = mark_cells(b, blur, (float)(0.999 * least), pool);
    for (int a = 0; a < 3; a++) {
        dilate(b, a, cells, b->reaches, other);
        bool *swap = b->reaches;
        b->reaches = other;
        other = swap;
    }
    free(other);
    return s;
}

void line_bound_release(struct line_bound *b)
{
    if (b == NULL) return;
    free(b->reaches);
    *b = (struct line_bound){0};
}
