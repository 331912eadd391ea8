#include "geometry/fibers/centers.h"

#include "geometry/fibers/center_refine.h"
#include "geometry/vision/vision.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

enum { N_SCALE = 4 };
static const double scale_factor[N_SCALE] = {0.70, 0.85, 1.03, 1.25}; /* of diameter / (2 sqrt 2) */

/* Lone disks answer 0.74, disks inside a dense bundle (neighbours fill the filter's surround) about 0.25. */
static const float MIN_STRENGTH = 0.12f;
/* Two centers are never nearer than this share of the diameter. */
static const float MIN_SPACING = 0.55f;

struct slice_result {
    struct center *center;
    size_t n, capacity;
    status failed;
};

struct detect_job {
    const struct volume *v;
    const struct direction_volume *d;
    const uint16_t *mask;
    const struct slice_frame *frame;
    size_t width, height;
    double sigma[N_SCALE];
    float min_distance;
    double diameter;
    float *scratch; /* per thread: image and N_SCALE responses */
    size_t scratch_per_thread;
    struct slice_result *slice;
    struct error *error; /* per thread */
};

void center_list_release(struct center_list *l)
{
    if (l == NULL) return;
    free(l->first);
    free(l->center);
    *l = (struct center_list){0};
}

struct mask_job {
    const struct direction_volume *d;
    uint16_t *mask;
    float normal[N_SLICE_FRAME][3];
    size_t (*count)[3]; /* per slice */
};

static void mask_slice(void *context, size_t k, size_t i_thread)
{
    (void)i_thread;
    const struct mask_job *job = context;
    size_t n = job->d->n[0] * job->d->n[1];
    for (size_t i = k * n; i < (k + 1) * n; i++) {
        job->mask[i] = 0;
        if (job->d->density[i] == 0) continue;
        float d[3];
        direction_volume_get(job->d, i, d);
        int nearest = 0;
        for (int a = 1; a < 3; a++)
            if (fabsf(d[a]) > fabsf(d[nearest])) nearest = a;
        unsigned bits = 1u << (12 + nearest);
        for (unsigned f = 0; f < N_SLICE_FRAME; f++) {
            const float *w = job->normal[f];
            if (fabsf(d[0] * w[0] + d[1] * w[1] + d[2] * w[2]) >= CLASS_COSINE) bits |= 1u << f;
        }
        job->mask[i] = (uint16_t)bits;
        job->count[k][nearest]++;
    }
}

/* An emptied voxel shows its density in a frame unless all its kept neighbours belong to others (it is then the rim of such a fiber). */
static void rim_slice(void *context, size_t k, size_t i_thread)
{
    (void)i_thread;
    const struct mask_job *job = context;
    const size_t *n = job->d->n, stride[3] = {1, n[0], n[0] * n[1]};
    size_t x[3] = {0, 0, k}, at = k * stride[2];
    for (x[1] = 0; x[1] < n[1]; x[1]++)
        for (x[0] = 0; x[0] < n[0]; x[0]++, at++) {
            if (job->d->density[at] > 0) continue;
            unsigned seen = 0;
            for (int a = 0; a < 3; a++) { /* kept neighbours only: their masks are not changed here */
                if (x[a] > 0 && job->d->density[at - stride[a]] > 0) seen |= job->mask[at - stride[a]];
                if (x[a] + 1 < n[a] && job->d->density[at + stride[a]] > 0) seen |= job->mask[at + stride[a]];
            }
            job->mask[at] = (uint16_t)((seen == 0 ? ~0u : seen) & ((1u << N_SLICE_FRAME) - 1u));
        }
}

status class_mask(const struct direction_volume *d, struct thread_pool *pool, uint16_t *mask, size_t n_class_voxel[3],
                  struct error *err)
{
    struct mask_job job = {.d = d, .mask = mask, .count = calloc(d->n[2], sizeof(size_t[3]))};
    if (job.count == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot separate the axes: out of memory");
    for (int f = 0; f < N_SLICE_FRAME; f++) slice_frame_normal(f, job.normal[f]);
    status s = thread_pool_run(pool, d->n[2], mask_slice, &job, NULL);
    if (s == STATUS_OK) s = thread_pool_run(pool, d->n[2], rim_slice, &job, NULL);
    for (int a = 0; a < 3; a++) {
        n_class_voxel[a] = 0;
        for (size_t k = 0; k < d->n[2]; k++) n_class_voxel[a] += job.count[k][a];
    }
    free(job.count);
    return s;
}

/* Voxel that holds point x; false (and the nearest voxel) when x lies outside of the volume. */
static bool voxel_at(const size_t n[3], const float x[3], size_t at[3])
{
    bool inside = true;
    for (int a = 0; a < 3; a++) {
        inside = inside && x[a] >= 0.0f && x[a] < (float)n[a];
        at[a] = x[a] <= 0.0f ? 0 : x[a] >= (float)n[a] - 1.0f ? n[a] - 1 : (size_t)x[a];
    }
    return inside;
}

/* Density of the subvolume at a voxel, 0 where it is emptied. */
static float class_density(const struct detect_job *job, const size_t x[3], bool *own)
{
    size_t at = volume_index(job->v->n, x[0], x[1], x[2]);
    uint16_t m = job->mask[at], visible = m >> job->frame->index & 1;
    *own = visible != 0 && m >= CLASS_KEPT;
    return visible != 0 ? job->v->density[at] : 0.0f;
}

/* Between voxels: bilinear in the plane of the two diagonal axes (the third stays on the grid). */
static float diagonal_density(const struct detect_job *job, const float x[3], bool *own)
{
    const struct slice_frame *f = job->frame;
    const size_t *n = job->v->n;
    float sum = 0.0f;
    *own = false;
    for (int corner = 0; corner < 4; corner++) {
        size_t at[3];
        float weight = 1.0f;
        for (int a = 0, bit = 0; a < 3; a++) {
            float c = x[a] - 0.5f, whole = floorf(c);
            if (f->w[a] == 0.0f) {
                whole = floorf(x[a]);
            } else {
                float fraction = c - whole;
                if (corner >> bit & 1) {
                    weight *= fraction;
                    whole += 1.0f;
                } else {
                    weight *= 1.0f - fraction;
                }
                bit++;
            }
            at[a] = whole <= 0.0f ? 0 : whole >= (float)n[a] - 1.0f ? n[a] - 1 : (size_t)whole;
        }
        bool own_corner;
        sum += weight * class_density(job, at, &own_corner);
        *own = *own || own_corner;
    }
    return sum;
}

/* The slice of the subvolume; false when nothing of the class is in it. Pixels beyond the faces repeat the face's densities. */
static bool fill_image(const struct detect_job *job, size_t i_slice, float *image)
{
    bool any = false;
    for (size_t v = 0; v < job->height; v++)
        for (size_t u = 0; u < job->width; u++, image++) {
            float x[3];
            bool own;
            size_t at[3];
            slice_frame_point(job->frame, (float)u + 0.5f, (float)v + 0.5f, (float)i_slice + 0.5f, x);
            bool inside = voxel_at(job->v->n, x, at);
            if (!inside && (fabsf(x[0] - (float)at[0]) > 6.0f || fabsf(x[1] - (float)at[1]) > 6.0f ||
                            fabsf(x[2] - (float)at[2]) > 6.0f)) {
                *image = 0.0f;
                continue;
            }
            *image = job->frame->index < 3 ? class_density(job, at, &own) : diagonal_density(job, x, &own);
            any = any || own;
        }
    return any;
}

static bool is_peak(const struct detect_job *job, const float *response, size_t u, size_t v)
{
    float c = response[v * job->width + u];
    for (size_t y = v > 0 ? v - 1 : 0; y <= v + 1 && y < job->height; y++)
        for (size_t x = u > 0 ? u - 1 : 0; x <= u + 1 && x < job->width; x++) {
            float r = response[y * job->width + x];
            if (r > c || (r == c && (y < v || (y == v && x < u)))) return false;
        }
    return true;
}

/* Offset of the maximum of the paraboloid through a 3 x 3 neighbourhood (least squares), at most one pixel. */
static void refine_position(const struct detect_job *job, const float *response, size_t u, size_t v, float offset[2])
{
    offset[0] = offset[1] = 0.0f;
    if (u == 0 || v == 0 || u + 1 >= job->width || v + 1 >= job->height) return;
    const float *p = response + v * job->width + u;
    size_t w = job->width;
    float gu = 0.0f, gv = 0.0f, uu = 0.0f, vv = 0.0f;
    for (ptrdiff_t r = -1; r <= 1; r++) {
        const float *q = p + r * (ptrdiff_t)w;
        gu += (q[1] - q[-1]) / 6.0f;
        uu += (q[1] - 2.0f * q[0] + q[-1]) / 3.0f;
        gv += (p[w + (size_t)(r + 1) - 1] - p[-(ptrdiff_t)w + r]) / 6.0f;
        vv += (p[(ptrdiff_t)w + r] - 2.0f * p[r] + p[-(ptrdiff_t)w + r]) / 3.0f;
    }
    float uv = (p[w + 1] - p[w - 1] - p[-(ptrdiff_t)w + 1] + p[-(ptrdiff_t)w - 1]) / 4.0f;
    float det = uu * vv - uv * uv;
    if (!(det > 0.0f) || !(uu < 0.0f)) return;
    offset[0] = fminf(1.0f, fmaxf(-1.0f, (uv * gv - vv * gu) / det));
    offset[1] = fminf(1.0f, fmaxf(-1.0f, (uv * gu - uu * gv) / det));
}

/* Mean direction of the class's voxels within one pixel of (u, v), as slopes. False when there is none, or the center lies
 * outside of the volume. */
static bool find_slope(const struct detect_job *job, size_t i_slice, struct center *c)
{
    const struct slice_frame *f = job->frame;
    float sum[3] = {0.0f, 0.0f, 0.0f}, x[3]; /* along u, v, w */
    size_t at[3];
    slice_frame_point(f, c->u, c->v, (float)i_slice + 0.5f, x);
    if (!voxel_at(job->v->n, x, at)) return false;
    for (int v = -1; v <= 1; v++)
        for (int u = -1; u <= 1; u++) {
            slice_frame_point(f, c->u + (float)u, c->v + (float)v, (float)i_slice + 0.5f, x);
            if (!voxel_at(job->v->n, x, at)) continue;
            size_t voxel = volume_index(job->v->n, at[0], at[1], at[2]);
            if ((job->mask[voxel] >> f->index & 1) == 0 || job->mask[voxel] < CLASS_KEPT) continue;
            float d[3], local[3] = {0.0f, 0.0f, 0.0f};
            direction_volume_get(job->d, voxel, d);
            for (int a = 0; a < 3; a++) {
                local[0] += d[a] * f->u[a];
                local[1] += d[a] * f->v[a];
                local[2] += d[a] * f->w[a];
            }
            float sign = local[2] < 0.0f ? -1.0f : 1.0f;
            for (int a = 0; a < 3; a++) sum[a] += sign * local[a];
        }
    if (!(sum[2] > 0.0f)) return false;
    c->slope_u = sum[0] / sum[2];
    c->slope_v = sum[1] / sum[2];
    return true;
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

static bool collect_peaks(const struct detect_job *job, size_t i_slice, const float *response, struct slice_result *r)
{
    size_t n_pixel = job->width * job->height;
    for (int s = 0; s < N_SCALE; s++)
        for (size_t v = 0; v < job->height; v++)
            for (size_t u = 0; u < job->width; u++) {
                const float *map = response + (size_t)s * n_pixel;
                size_t at = v * job->width + u;
                if (map[at] < MIN_STRENGTH) continue;
                if (!is_peak(job, map, u, v)) continue;
                if ((s > 0 && map[at - n_pixel] > map[at]) || (s + 1 < N_SCALE && map[at + n_pixel] > map[at])) continue;
                float offset[2];
                refine_position(job, map, u, v, offset);
                struct center c = {.u = (float)u + 0.5f + offset[0],
                                   .v = (float)v + 0.5f + offset[1],
                                   .sigma = (float)job->sigma[s],
                                   .strength = map[at]};
                if (find_slope(job, i_slice, &c) && !push(r, &c)) return false;
            }
    return true;
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

/* Of peaks nearer to each other than min_distance the strongest stays. */
static void thin_out(const struct detect_job *job, struct slice_result *r)
{
    size_t kept = 0;
    float limit = job->min_distance * job->min_distance;
    if (r->n == 0) return;
    qsort(r->center, r->n, sizeof *r->center, stronger_first);
    for (size_t i = 0; i < r->n; i++) {
        bool near = false;
        for (size_t j = 0; j < kept && !near; j++) {
            float du = r->center[i].u - r->center[j].u, dv = r->center[i].v - r->center[j].v;
            near = du * du + dv * dv < limit;
        }
        if (!near) r->center[kept++] = r->center[i];
    }
    r->n = kept;
}

static void detect_slice(void *context, size_t i_slice, size_t i_thread)
{
    struct detect_job *job = context;
    struct slice_result *r = &job->slice[i_slice];
    float *image = job->scratch + i_thread * job->scratch_per_thread;
    size_t n_pixel = job->width * job->height;
    float *response = image + n_pixel;
    if (!fill_image(job, i_slice, image)) return;
    for (int s = 0; s < N_SCALE && r->failed == STATUS_OK; s++)
        r->failed = vision_blob_response(image, job->width, job->height, job->sigma[s], response + (size_t)s * n_pixel,
                                         &job->error[i_thread]);
    if (r->failed != STATUS_OK) return;
    if (!collect_peaks(job, i_slice, response, r))
        r->failed = error_set(&job->error[i_thread], STATUS_NO_MEMORY, "cannot find fiber centers: out of memory");
    thin_out(job, r);
    centers_refine(image, job->width, job->height, job->diameter, r->center, r->n, response, response + n_pixel);
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

status centers_detect(const struct volume *v, const struct direction_volume *d, const uint16_t *mask,
                      const struct slice_frame *frame, double diameter_voxel, struct thread_pool *pool,
                      const struct progress *progress, struct center_list *list, struct error *err)
{
    struct detect_job job = {.v = v, .d = d, .mask = mask, .frame = frame, .width = frame->width, .height = frame->height};
    size_t n_slice = frame->n_slice, n_thread = thread_pool_n_thread(pool);
    *list = (struct center_list){0};
    status s = vision_init(err);
    if (s != STATUS_OK) return s;
    for (int i = 0; i < N_SCALE; i++) job.sigma[i] = fmax(0.6, scale_factor[i] * diameter_voxel / (2.0 * M_SQRT2));
    job.diameter = diameter_voxel;
    job.min_distance = MIN_SPACING * (float)diameter_voxel;
    job.scratch_per_thread = job.width * job.height * (N_SCALE + 1);
    job.scratch = malloc(n_thread * job.scratch_per_thread * sizeof *job.scratch);
    job.slice = calloc(n_slice, sizeof *job.slice);
    job.error = calloc(n_thread, sizeof *job.error);
    if (job.scratch == NULL || job.slice == NULL || job.error == NULL)
        s = error_set(err, STATUS_NO_MEMORY, "cannot find fiber centers: out of memory");
    if (s == STATUS_OK) {
        s = thread_pool_run(pool, n_slice, detect_slice, &job, progress);
        if (s != STATUS_OK) error_set(err, s, "finding fiber centers was cancelled");
        for (size_t t = 0; t < n_thread && s == STATUS_OK; t++)
            if (job.error[t].code != STATUS_OK) {
                s = job.error[t].code;
                if (err != NULL) *err = job.error[t];
            }
    }
    if (s == STATUS_OK) s = gather(&job, n_slice, list, err);
    for (size_t k = 0; job.slice != NULL && k < n_slice; k++) free(job.slice[k].center);
    free(job.scratch);
    free(job.slice);
    free(job.error);
    if (s != STATUS_OK) center_list_release(list);
    return s;
}
