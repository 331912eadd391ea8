#include "geometry/fibers/slices/centers.h"

#include "base/lanes.h"
#include "geometry/fibers/slices/blob_response.h"
#include "geometry/fibers/slices/center_refine.h"
#include "geometry/fibers/slices/center_slope.h"
#include "geometry/fibers/slices/pixel_bits.h"
#include "geometry/fibers/slices/slice_image.h"
#include "geometry/fibers/slices/slice_peaks.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

enum {
    LEAST_SLAB = 32, /* slices that are filled together in ample memory */
    N_SCALE = 5,
    PEAK_REACH = 2, /* pixels to a kept voxel's from a peak that has a slope (center_slope.h) */
    N_BYTES = 3     /* sets of pixels in the work of a thread */
};
static const double scale_factor[N_SCALE] = {0.58, 0.70, 0.85, 1.03, 1.25}; /* of diameter / (2 sqrt 2) */

/* An isolated disk has response 0.74; a disk inside a dense bundle, whose neighbours fill the surround of the
 * filter, about 0.25. */
static const float MIN_STRENGTH = 0.12f;
/* Least distance of two centers as a share of the mean of their diameters. */
static const float MIN_SPACING = 0.55f;
/* Radius of a fiber in a bundle over the scale of its strongest response (sqrt 2 for an isolated disk), and its bounds
 * as shares of half the typical diameter. */
static const double RADIUS_OVER_SIGMA = 1.7, LEAST_RADIUS = 0.55, MOST_RADIUS = 1.5;

struct slice_result {
    struct center *center;
    size_t n, capacity;
    bool failed; /* memory was out */
};

struct detect_job {
    const struct center_search *search;
    const struct volume *v;
    const struct slice_frame *frame;
    size_t first;                   /* slice of task 0 of the slab */
    struct slice_pictures pictures; /* of the slab */
    size_t margin;                  /* pixels that a picture needs around its own */
    double sigma[N_SCALE];
    struct blob_kernel kernel[N_SCALE];
    float min_distance;
    double diameter;
    float *scratch; /* per thread: a part of the picture, N_SCALE responses and the work of blob_response */
    uint8_t *bytes; /* per thread: N_BYTES sets of pixels */
    size_t scratch_per_thread, bytes_per_thread;
    struct slice_result *slice;
};

/* The part of a slice's picture that is used. */
struct view {
    size_t i_slice, width, height;
    float origin[2]; /* position of pixel (0, 0) in the whole picture */
    float *image, *response, *work;
    uint8_t *candidate; /* pixels where peaks may be */
};

void center_list_release(struct center_list *l)
{
    if (l == NULL) return;
    free(l->first);
    free(l->center);
    *l = (struct center_list){0};
}

/* Finds the slopes of the centers, and leaves out those without one. */
static void find_slopes(const struct detect_job *job, size_t i_slice, struct slice_result *r)
{
    size_t kept = 0;
    for (size_t i = 0; i < r->n; i++)
        if (center_find_slope(job->search, i_slice, &r->center[i])) r->center[kept++] = r->center[i];
    r->n = kept;
}

static bool push(struct slice_result *r, const struct center *c)
{
    if (r->n == r->capacity) {
        size_t n = r->capacity == 0 ? 64 : 2 * r->capacity;
        struct center *bigger = realloc(r->center, n * sizeof *bigger);
        if (bigger == NULL) return false;
        r->center = bigger;
        r->capacity = n;
    }
    r->center[r->n++] = *c;
    return true;
}

/* Returns the radius of the fiber, by a parabola in log sigma through the responses at and beside a peak's scale. */
static float radius_at(const struct detect_job *job, const float *peak, size_t n_pixel, int s)
{
    double shift = 0.0, half = 0.5 * job->diameter;
    if (s > 0 && s + 1 < N_SCALE) {
        double l = (double)peak[-(ptrdiff_t)n_pixel], c = (double)peak[0], r = (double)peak[n_pixel];
        if (l - 2.0 * c + r < 0.0) shift = fmin(0.5, fmax(-0.5, 0.5 * (l - r) / (l - 2.0 * c + r)));
    }
    double r = RADIUS_OVER_SIGMA * job->sigma[s] * pow(scale_factor[1] / scale_factor[0], shift);
    return (float)fmin(MOST_RADIUS * half, fmax(LEAST_RADIUS * half, r));
}

/* The peaks of one scale. */
struct scale_peaks {
    const struct detect_job *job;
    const struct view *view;
    struct peak_search search;
    int s;
    struct slice_result *result;
};

/* Adds the center of the peak at a pixel, if it is a peak among the scales too. */
static bool add_peak(void *context, size_t u, size_t v)
{
    const struct scale_peaks *p = context;
    const struct view *w = p->view;
    const size_t n_pixel = w->width * w->height, at = v * w->width + u;
    const float *map = p->search.response;
    if ((p->s > 0 && map[at - n_pixel] > map[at]) || (p->s + 1 < N_SCALE && map[at + n_pixel] > map[at])) return true;
    float offset[2];
    peak_offset(&p->search, u, v, offset);
    struct center c = {.u = w->origin[0] + (float)u + 0.5f + offset[0],
                       .v = w->origin[1] + (float)v + 0.5f + offset[1],
                       .radius = radius_at(p->job, map + at, n_pixel, p->s),
                       .strength = map[at]};
    return !center_has_voxel(p->job->search, w->i_slice, &c) || push(p->result, &c);
}

static bool collect_peaks(const struct detect_job *job, const struct view *w, struct slice_result *r)
{
    bool fits = true;
    for (int s = 0; s < N_SCALE && fits; s++) {
        const float *response = w->response + (size_t)s * w->width * w->height;
        struct scale_peaks peaks = {job, w, {response, w->width, w->height, w->candidate, MIN_STRENGTH}, s, r};
        fits = peaks_visit(&peaks.search, add_peak, &peaks);
    }
    return fits;
}

static int stronger_first(const void *a, const void *b)
{
    const struct center *x = a, *y = b;
    if (x->strength != y->strength) return x->strength < y->strength ? 1 : -1;
    if (x->v != y->v) return x->v < y->v ? -1 : 1;
    return (x->u > y->u) - (x->u < y->u);
}

static int lower_v_first(const void *a, const void *b)
{
    const struct center *x = a, *y = b;
    if (x->v != y->v) return x->v < y->v ? -1 : 1;
    return (x->u > y->u) - (x->u < y->u);
}

/* Keeps the strongest of peaks nearer to each other than their radii allow. Kept peaks are sorted into cells of edge
 * min_distance, the largest of these limits. */
static bool thin_out(const struct detect_job *job, const struct view *w, struct slice_result *r)
{
    size_t kept = 0, n_cell[2] = {(size_t)((float)w->width / job->min_distance) + 3,
                                  (size_t)((float)w->height / job->min_distance) + 3};
    if (r->n == 0) return true;
    uint32_t *head = calloc(n_cell[0] * n_cell[1], sizeof *head), *next = malloc(r->n * sizeof *next);
    if (head == NULL || next == NULL) {
        free(head);
        free(next);
        return false;
    }
    qsort(r->center, r->n, sizeof *r->center, stronger_first);
    for (size_t i = 0; i < r->n; i++) {
        const struct center *c = &r->center[i];
        size_t cu = (size_t)fmaxf(0.0f, (c->u - w->origin[0]) / job->min_distance) + 1;
        size_t cv = (size_t)fmaxf(0.0f, (c->v - w->origin[1]) / job->min_distance) + 1;
        bool near = false;
        for (size_t y = cv - 1; y <= cv + 1 && y < n_cell[1]; y++)
            for (size_t x = cu - 1; x <= cu + 1 && x < n_cell[0]; x++)
                for (uint32_t at = head[y * n_cell[0] + x]; at != 0 && !near; at = next[at - 1]) {
                    float du = c->u - r->center[at - 1].u, dv = c->v - r->center[at - 1].v;
                    float limit = MIN_SPACING * (c->radius + r->center[at - 1].radius);
                    near = du * du + dv * dv < limit * limit;
                }
        if (near) continue;
        size_t cell = (cv < n_cell[1] ? cv : n_cell[1] - 1) * n_cell[0] + (cu < n_cell[0] ? cu : n_cell[0] - 1);
        r->center[kept] = *c;
        next[kept] = head[cell];
        head[cell] = (uint32_t)++kept;
    }
    r->n = kept;
    free(head);
    free(next);
    return true;
}

/* Copies the slice's own pixels and a margin around them from the slab, from a whole byte of bits on. */
static struct view cut_view(const struct detect_job *job, size_t i_task, float *scratch)
{
    const struct slice_frame *f = job->frame;
    const struct pixel_range *own = &job->pictures.own[i_task];
    const size_t m = job->margin, u0 = own->u0 > m ? (own->u0 - m) / 8 * 8 : 0, v0 = own->v0 > m ? own->v0 - m : 0;
    size_t u1 = own->u1 + m < f->width ? own->u1 + m : f->width, v1 = own->v1 + m < f->height ? own->v1 + m : f->height;
    struct view w = {.i_slice = job->first + i_task,
                     .width = u1 - u0,
                     .height = v1 - v0,
                     .origin = {(float)u0, (float)v0},
                     .image = scratch,
                     .response = scratch + (u1 - u0) * (v1 - v0),
                     .work = scratch + (N_SCALE + 1) * (u1 - u0) * (v1 - v0)};
    const float *from = job->pictures.image + i_task * f->width * f->height;
    for (size_t v = 0; v < w.height; v++)
        memcpy(w.image + v * w.width, from + (v0 + v) * f->width + u0, w.width * sizeof *from);
    return w;
}

/* Finds the pixels where peaks may be, and computes the responses there and beside them. bytes: work of the thread. */
static void respond(const struct detect_job *job, size_t i_task, struct view *w, uint8_t *bytes)
{
    const size_t pitch = slice_row_bytes(job->frame), n_byte = blob_n_block(w->width), n = n_byte * w->height;
    const uint8_t *kept =
        job->pictures.kept + (i_task * job->frame->height + (size_t)w->origin[1]) * pitch + (size_t)w->origin[0] / 8;
    uint8_t *work = bytes, *asked = bytes + n;
    w->candidate = bytes + 2 * n;
    pixel_bits_near(kept, pitch, n_byte, w->height, PEAK_REACH, work, w->candidate);
    pixel_bits_near(kept, pitch, n_byte, w->height, PEAK_REACH + 1, work, asked);
    for (size_t b = 0; b < n; b++) asked[b] = asked[b] != 0;
    const struct blob_picture picture = {w->image, w->width, w->height, asked};
    for (int s = 0; s < N_SCALE; s++)
        blob_response(&job->kernel[s], &picture, w->work, work, w->response + (size_t)s * w->width * w->height);
}

static void move_centers(struct slice_result *r, float du, float dv)
{
    for (size_t i = 0; i < r->n; i++) {
        r->center[i].u += du;
        r->center[i].v += dv;
    }
}

static void detect_slice(void *context, size_t i_task, size_t i_thread)
{
    struct detect_job *job = context;
    scratch_keep_within(job->v->space);
    if (job->pictures.own[i_task].u0 >= job->pictures.own[i_task].u1) return; /* no voxel of the class */
    struct view w = cut_view(job, i_task, job->scratch + i_thread * job->scratch_per_thread);
    struct slice_result *r = &job->slice[w.i_slice];
    respond(job, i_task, &w, job->bytes + i_thread * job->bytes_per_thread);
    bool fits = collect_peaks(job, &w, r) && thin_out(job, &w, r);
    find_slopes(job, w.i_slice, r);
    move_centers(r, -w.origin[0], -w.origin[1]);
    const struct refine_slice slice = {w.image, w.width, w.height, w.response, w.response + w.width * w.height};
    r->failed = !fits || !centers_refine(&slice, r->center, r->n);
    move_centers(r, w.origin[0], w.origin[1]);
    if (r->n > 0) qsort(r->center, r->n, sizeof *r->center, lower_v_first);
}

static status gather(struct detect_job *job, size_t n_slice, struct center_list *list, struct error *err)
{
    size_t total = 0;
    for (size_t k = 0; k < n_slice; k++) total += job->slice[k].n;
    list->first = calloc(n_slice + 1, sizeof *list->first);
    list->center = malloc((total + 1) * sizeof *list->center);
    if (list->first == NULL || list->center == NULL)
        return error_set(err, STATUS_NO_MEMORY, "cannot find fiber centers: out of memory");
    list->n_slice = n_slice;
    for (size_t k = 0; k < n_slice; k++) {
        if (job->slice[k].n > 0)
            memcpy(list->center + list->first[k], job->slice[k].center, job->slice[k].n * sizeof *list->center);
        list->first[k + 1] = list->first[k] + job->slice[k].n;
    }
    return STATUS_OK;
}

/* Processes slabs of slices: fills their pictures, then finds the centers in them. */
static status detect_slabs(struct detect_job *job, const struct slice_source *source, size_t n_slab,
                           struct thread_pool *pool, const struct progress *progress, struct error *err)
{
    size_t n = job->frame->n_slice;
    const struct progress quiet = progress_silent(progress);
    status s = STATUS_OK;
    for (job->first = 0; job->first < n && s == STATUS_OK; job->first += n_slab) {
        size_t n_here = job->first + n_slab < n ? n_slab : n - job->first;
        s = slice_images_fill(source, job->first, n_here, pool, &job->pictures, err);
        if (s == STATUS_OK) s = thread_pool_run(pool, n_here, detect_slice, job, &quiet);
        if (s == STATUS_CANCELLED) error_set(err, s, "finding fiber centers was cancelled");
        progress_report(progress, (double)(job->first + n_here) / (double)n);
    }
    for (size_t k = 0; k < n && s == STATUS_OK; k++)
        if (job->slice[k].failed) s = error_set(err, STATUS_NO_MEMORY, "cannot find fiber centers: out of memory");
    return s;
}

/* The margin covers the reach of the filters, the moves of centers, and their window stretched by the slope. */
static size_t picture_margin(double largest_sigma, double diameter)
{
    return (size_t)ceil(4.0 * largest_sigma + MOST_RADIUS * diameter) + 8;
}

/* Chooses the scales of the filters from the diameter, and their margin. */
static bool scales_init(struct detect_job *job)
{
    for (int i = 0; i < N_SCALE; i++) {
        job->sigma[i] = fmax(0.6, scale_factor[i] * job->diameter / (2.0 * M_SQRT2));
        if (!blob_kernel_init(&job->kernel[i], job->sigma[i])) return false;
    }
    job->margin = picture_margin(job->sigma[N_SCALE - 1], job->diameter);
    return true;
}

status centers_detect(const struct center_search *search, struct thread_pool *pool, const struct progress *progress,
                      struct center_list *list, struct error *err)
{
    const struct volume *v = search->v;
    const struct subvolumes *sub = search->sub;
    const struct slice_frame *frame = search->frame;
    const double diameter_voxel = search->diameter_voxel;
    struct detect_job job = {.search = search, .v = v, .frame = frame};
    struct slice_source source = {.v = v, .mask = sub->mask, .frame = frame};
    size_t n_slice = frame->n_slice, n_thread = thread_pool_n_thread(pool), n_pixel = frame->width * frame->height;
    size_t n_slab = scratch_buffer_bytes(v->space) / (n_pixel * sizeof(float));
    status s = STATUS_OK;
    *list = (struct center_list){0};
    const size_t enough = 2 * n_thread > LEAST_SLAB ? 2 * n_thread : LEAST_SLAB;
    n_slab = n_slab > enough ? enough : n_slab;
    n_slab = n_slab < n_thread ? n_thread : n_slab > n_slice ? n_slice : n_slab;
    job.diameter = diameter_voxel;
    job.min_distance = MIN_SPACING * (float)(MOST_RADIUS * diameter_voxel);
    if (!scales_init(&job)) return error_set(err, STATUS_INVALID, "cannot find fibers %g voxels thick", diameter_voxel);
    for (int a = 0; a < 3; a++) { /* pictures are void beyond this; diagonals need 3/2 of the margin */
        size_t reach = job.margin * 3 / 2;
        source.from[a] = sub->from[a] > reach ? sub->from[a] - reach : 0;
        source.to[a] = sub->to[a] + reach < v->n[a] ? sub->to[a] + reach : v->n[a];
    }
    const size_t n_byte = slice_row_bytes(frame) * frame->height;
    job.scratch_per_thread = n_pixel * (N_SCALE + 1) + blob_scratch(frame->width, job.kernel[N_SCALE - 1].reach);
    job.bytes_per_thread = N_BYTES * n_byte;
    job.scratch = malloc(n_thread * job.scratch_per_thread * sizeof *job.scratch);
    job.bytes = malloc(n_thread * job.bytes_per_thread);
    job.pictures.image = malloc(n_slab * n_pixel * sizeof *job.pictures.image);
    job.pictures.kept = malloc(n_slab * n_byte);
    job.pictures.own = malloc(n_slab * sizeof *job.pictures.own);
    job.slice = calloc(n_slice, sizeof *job.slice);
    if (job.scratch == NULL || job.bytes == NULL || job.pictures.image == NULL || job.pictures.kept == NULL ||
        job.pictures.own == NULL || job.slice == NULL)
        s = error_set(err, STATUS_NO_MEMORY, "cannot find fiber centers: out of memory");
    if (s == STATUS_OK) s = detect_slabs(&job, &source, n_slab, pool, progress, err);
    if (s == STATUS_OK) s = gather(&job, n_slice, list, err);
    for (size_t k = 0; job.slice != NULL && k < n_slice; k++) free(job.slice[k].center);
    free(job.scratch);
    free(job.bytes);
    free(job.pictures.image);
    free(job.pictures.kept);
    free(job.pictures.own);
    free(job.slice);
    if (s != STATUS_OK) center_list_release(list);
    return s;
}
