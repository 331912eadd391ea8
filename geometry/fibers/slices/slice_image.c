#include "geometry/fibers/slices/slice_image.h"

#include "geometry/fibers/slices/centers.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

enum { LINES = 16 }; /* lines of pixels in a task */

struct fill_job {
    const struct slice_source *source;
    size_t first, n_slice;
    bool by_column; /* tasks are blocks of columns, if u runs through z, or else blocks of rows */
    int third;      /* the axis that runs along v */
    float *image;
    struct pixel_range *own; /* per task and slice */
};

/* The voxels around a point in the two in-plane axes, with their weights; the caller adds the third axis. */
struct corners {
    size_t n, at[4];
    float weight[4];
};

static size_t clamped(float whole, size_t n)
{
    return whole <= 0.0f ? 0 : whole >= (float)n - 1.0f ? n - 1 : (size_t)whole;
}

/* Returns false if the point lies too far outside of the volume, or where nothing is shown. */
static bool find_corners(const struct fill_job *job, size_t u, size_t i_slice, struct corners *c)
{
    const struct slice_source *s = job->source;
    const size_t *n = s->v->n, stride[3] = {1, n[0], n[0] * n[1]};
    float x[3];
    slice_frame_point(s->frame, (float)u + 0.5f, 0.5f, (float)i_slice + 0.5f, x);
    *c = (struct corners){.n = 1, .weight = {1.0f}};
    for (int a = 0; a < 3; a++) {
        if (a == job->third) continue;
        size_t nearest = clamped(floorf(x[a]), n[a]);
        if (fabsf(x[a] - (float)nearest) > SLICE_OUTSIDE && (x[a] < 0.0f || x[a] >= (float)n[a])) return false;
        if (nearest < s->from[a] || nearest >= s->to[a]) return false;
        if (s->frame->index < 3) {
            c->at[0] += nearest * stride[a];
            continue;
        }
        float whole = floorf(x[a] - 0.5f), fraction = x[a] - 0.5f - whole;
        size_t low = clamped(whole, n[a]) * stride[a], high = clamped(whole + 1.0f, n[a]) * stride[a];
        for (size_t k = 0; k < c->n && k < 2; k++) { /* one corner, then two */
            c->at[c->n + k] = c->at[k] + high;
            c->weight[c->n + k] = c->weight[k] * fraction;
            c->at[k] += low;
            c->weight[k] *= 1.0f - fraction;
        }
        c->n *= 2;
    }
    return true;
}

static void extend(struct pixel_range *r, size_t u, size_t v)
{
    if (r->u0 >= r->u1) {
        *r = (struct pixel_range){u, u + 1, v, v + 1};
        return;
    }
    if (u < r->u0) r->u0 = u;
    if (u >= r->u1) r->u1 = u + 1;
    if (v < r->v0) r->v0 = v;
    if (v >= r->v1) r->v1 = v + 1;
}

/* Fills pixels (u, v0 .. v1 - 1) of one picture. */
static void fill_column(const struct fill_job *job, size_t u, size_t v0, size_t v1, size_t i_slice, float *image,
                        struct pixel_range *own)
{
    const struct slice_source *s = job->source;
    size_t third = (size_t)job->third, step = third == 0 ? 1 : third == 1 ? s->v->n[0] : s->v->n[0] * s->v->n[1];
    struct corners c = {0};
    if (v0 < s->from[third]) v0 = s->from[third];
    if (v1 > s->to[third]) v1 = s->to[third];
    if (v0 >= v1 || !find_corners(job, u, i_slice, &c)) return;
    unsigned shift = (unsigned)s->frame->index;
    for (size_t v = v0; v < v1; v++) {
        float sum = 0.0f;
        bool any = false;
        for (size_t k = 0; k < c.n; k++) {
            size_t at = c.at[k] + v * step;
            unsigned m = s->mask[at], visible = m >> shift & 1u;
            if (visible == 0) continue;
            sum += c.weight[k] * s->v->density[at];
            any = any || m >= CLASS_KEPT;
        }
        image[v * s->frame->width + u] = sum;
        if (any) extend(own, u, v);
    }
}

static void fill_lines(void *context, size_t i_task, size_t i_thread)
{
    (void)i_thread;
    const struct fill_job *job = context;
    const struct slice_frame *f = job->source->frame;
    size_t first = i_task * LINES, end = job->by_column ? f->width : f->height,
           last = first + LINES < end ? first + LINES : end;
    scratch_keep_within(job->source->v->space);
    for (size_t k = 0; k < job->n_slice; k++) {
        float *image = job->image + k * f->width * f->height;
        struct pixel_range *own = &job->own[i_task * job->n_slice + k];
        size_t u0 = job->by_column ? first : 0, u1 = job->by_column ? last : f->width;
        size_t v0 = job->by_column ? 0 : first, v1 = job->by_column ? f->height : last;
        for (size_t v = v0; v < v1; v++) memset(image + v * f->width + u0, 0, (u1 - u0) * sizeof *image);
        for (size_t u = u0; u < u1; u++) fill_column(job, u, v0, v1, job->first + k, image, own);
    }
}

status slice_images_fill(const struct slice_source *source, size_t first, size_t n_slice, struct thread_pool *pool,
                         float *image, struct pixel_range *own, struct error *err)
{
    const struct slice_frame *f = source->frame;
    struct fill_job job = {
        .source = source, .first = first, .n_slice = n_slice, .image = image, .by_column = f->u[2] != 0.0f};
    for (int a = 0; a < 3; a++)
        if (f->v[a] != 0.0f) job.third = a;
    size_t n_task = ((job.by_column ? f->width : f->height) + LINES - 1) / LINES;
    job.own = calloc(n_task * n_slice, sizeof *job.own);
    if (job.own == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot find fiber centers: out of memory");
    status s = thread_pool_run(pool, n_task, fill_lines, &job, NULL);
    for (size_t k = 0; k < n_slice; k++) {
        own[k] = (struct pixel_range){0};
        for (size_t t = 0; t < n_task; t++) {
            const struct pixel_range *r = &job.own[t * n_slice + k];
            if (r->u0 >= r->u1) continue;
            extend(&own[k], r->u0, r->v0);
            extend(&own[k], r->u1 - 1, r->v1 - 1);
        }
    }
    free(job.own);
    return s;
}
