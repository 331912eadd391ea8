#include "geometry/fibers/slices/slice_image.h"

#include "geometry/fibers/slices/subvolumes.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

enum { LINES = 16 }; /* lines of pixels in a task: whole bytes of bits */

struct fill_job {
    const struct slice_source *source;
    size_t first, n_slice;
    bool by_column; /* tasks are blocks of columns, if u runs through z, or else blocks of rows */
    int third;      /* the axis that runs along v */
    struct slice_pictures to;
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

/* A part of one picture. */
struct part {
    size_t i_slice, u0, u1, v0, v1;
    float *image;
    uint8_t *kept;
    struct pixel_range *own;
};

static void note_kept(const struct fill_job *job, struct part *p, size_t u, size_t v)
{
    p->kept[v * slice_row_bytes(job->source->frame) + u / 8] |= (uint8_t)(1u << u % 8);
    extend(p->own, u, v);
}

/* Density of a voxel where the frame shows it, 0 elsewhere. Without a branch, which would be guessed wrongly. */
static inline float shown(const float *density, unsigned mask, unsigned shift)
{
    uint32_t bits;
    float value;
    memcpy(&bits, density, sizeof bits);
    bits &= 0u - (mask >> shift & 1u);
    memcpy(&value, &bits, sizeof value);
    return value;
}

/* Fills the pixels of a column of the part. Inlined for each number of corners, so that their loop is unrolled. */
static inline void fill_column(const struct fill_job *job, struct part *p, size_t u, const struct corners *c,
                               size_t n_corner)
{
    const struct slice_source *s = job->source;
    const size_t third = (size_t)job->third, width = s->frame->width;
    const size_t step = third == 0 ? 1 : third == 1 ? s->v->n[0] : s->v->n[0] * s->v->n[1];
    const unsigned shift = (unsigned)s->frame->index;
    const float *density[4];
    const uint16_t *mask[4];
    for (size_t k = 0; k < n_corner; k++) {
        density[k] = s->v->density + c->at[k];
        mask[k] = s->mask + c->at[k];
    }
    for (size_t v = p->v0; v < p->v1; v++) {
        float sum = 0.0f;
        unsigned kept = 0;
        for (size_t k = 0; k < n_corner; k++) {
            const unsigned m = mask[k][v * step];
            sum += c->weight[k] * shown(density[k] + v * step, m, shift);
            kept |= m & (0u - (m >> shift & 1u));
        }
        p->image[v * width + u] = sum;
        if (kept >= CLASS_KEPT) note_kept(job, p, u, v);
    }
}

/* Fills the part of a picture that is not void. */
static void fill_part(const struct fill_job *job, struct part *p)
{
    const struct slice_source *s = job->source;
    const size_t third = (size_t)job->third;
    if (p->v0 < s->from[third]) p->v0 = s->from[third];
    if (p->v1 > s->to[third]) p->v1 = s->to[third];
    for (size_t u = p->u0; u < p->u1 && p->v0 < p->v1; u++) {
        struct corners c = {0};
        if (!find_corners(job, u, p->i_slice, &c)) continue;
        if (c.n == 1)
            fill_column(job, p, u, &c, 1);
        else
            fill_column(job, p, u, &c, 4);
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
        const size_t n_byte = slice_row_bytes(f);
        struct part p = {.i_slice = job->first + k,
                         .u0 = job->by_column ? first : 0,
                         .u1 = job->by_column ? last : f->width,
                         .v0 = job->by_column ? 0 : first,
                         .v1 = job->by_column ? f->height : last,
                         .image = job->to.image + k * f->width * f->height,
                         .kept = job->to.kept + k * n_byte * f->height,
                         .own = &job->own[i_task * job->n_slice + k]};
        for (size_t v = p.v0; v < p.v1; v++) {
            memset(p.image + v * f->width + p.u0, 0, (p.u1 - p.u0) * sizeof *p.image);
            memset(p.kept + v * n_byte + p.u0 / 8, 0, (p.u1 + 7) / 8 - p.u0 / 8);
        }
        fill_part(job, &p);
    }
}

status slice_images_fill(const struct slice_source *source, size_t first, size_t n_slice, struct thread_pool *pool,
                         const struct slice_pictures *pictures, struct error *err)
{
    const struct slice_frame *f = source->frame;
    struct fill_job job = {
        .source = source, .first = first, .n_slice = n_slice, .to = *pictures, .by_column = f->u[2] != 0.0f};
    for (int a = 0; a < 3; a++)
        if (f->v[a] != 0.0f) job.third = a;
    size_t n_task = ((job.by_column ? f->width : f->height) + LINES - 1) / LINES;
    job.own = calloc(n_task * n_slice, sizeof *job.own);
    if (job.own == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot find fiber centers: out of memory");
    status s = thread_pool_run(pool, n_task, fill_lines, &job, NULL);
    for (size_t k = 0; k < n_slice; k++) {
        struct pixel_range *own = &pictures->own[k];
        *own = (struct pixel_range){0};
        for (size_t t = 0; t < n_task; t++) {
            const struct pixel_range *r = &job.own[t * n_slice + k];
            if (r->u0 >= r->u1) continue;
            extend(own, r->u0, r->v0);
            extend(own, r->u1 - 1, r->v1 - 1);
        }
    }
    free(job.own);
    return s;
}
