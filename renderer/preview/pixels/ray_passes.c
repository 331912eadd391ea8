/* Sheared filtering in four passes of one dimension (equations 5.7 to 5.10): in blocks of pixels, along the first axis
 * into sums for each pixel and bin of the second axis, then along the second. Axes run across the screen in any
 * direction, differently at each pixel, so a pass's result at a pixel is kept for the pixels of a block around. */
#include "renderer/preview/pixels/ray_filter.h"
#include "renderer/preview/pixels/ray_kernel.h"

#include <stdint.h>
#include <stdlib.h>
#include <string.h>

/* BINS_A_RAY: bins over the window for each ray along its axis, as published. Centres of windows go one window further
 * to both sides: beyond that no ray has a weight. AROUND: edge of a block with the reach around it. */
enum { BINS_A_RAY = 4, MOST_BINS = BINS_A_RAY * RAY_MAX_SIDE, BLOCK = 64, AROUND = BLOCK + 2 * RAY_REACH };

struct block {
    struct ray_sum *made; /* [AROUND][AROUND][n_made]: results of a pass at a pixel */
    bool *is_made;        /* [AROUND][AROUND] */
};

struct run {
    const struct ray_field *f;
    const struct progress *progress;
    size_t n_bin, n_centre; /* over the window; over two windows, with one at the middle */
    size_t n_made[2];       /* sums that passes 1a and 2a make of a pixel */
    size_t n_block[2];
    struct ray_sum *between; /* [height][width][n_bin]: filtered along the first axis */
    struct block *scratch;   /* of each thread */
    float *mean;
};

/* Bin i of centres lies at 2 i / n_bin - 2. n_centre: it lies beyond all. */
static size_t bin_of_centre(const struct run *r, float centre)
{
    const float at = floorf(centre * 0.5f * (float)r->n_bin + (float)r->n_bin + 0.5f);
    return at >= 0 && at < (float)r->n_centre ? (size_t)at : r->n_centre;
}

/* n_bin: it lies beyond all. */
static size_t bin_of_y(const struct run *r, float y)
{
    const float at = floorf(0.5f * (y + 1) * (float)r->n_bin);
    return at >= 0 && at < (float)r->n_bin ? (size_t)at : r->n_bin;
}

/* The bin that ray j of a pixel goes to along an axis. */
static size_t bin_of_ray(const struct run *r, const struct ray_pixel *p, int axis, size_t j)
{
    const struct ray_field *f = r->f;
    if (f->window == RAY_ABOVE) return bin_of_y(r, ray_field_y(f, p, axis, j) / f->half);
    return BINS_A_RAY * j + (size_t)(BINS_A_RAY * p->jitter[axis]);
}

/* Weights along an axis of places that lie in the same part of all bins: weight[n_bin]. A place in bin j has
 * weight[m] in the window around the centre of bin j + n_bin - m, so one table serves all places and centres. */
static void weigh_bins(const struct run *r, const struct ray_kernel *k, int axis, float part, float *weight)
{
    for (size_t m = 0; m < r->n_bin; m++)
        weight[m] = ray_weight_y(k, axis, 2 * ((float)m + part) / (float)r->n_bin - 1);
}

/* Step 1a: out[n_centre][n_side]. */
static void convolve_rays(const struct run *r, size_t i, struct ray_sum *out)
{
    const struct ray_field *f = r->f;
    const struct ray_pixel *p = &f->pixel[i];
    float weight[MOST_BINS];
    struct ray_kernel k;
    ray_kernel_at(f, p, false, &k);
    weigh_bins(r, &k, 0, fmodf(BINS_A_RAY * p->jitter[0], 1), weight);
    for (size_t j2 = 0; j2 < f->n_side; j2++)
        for (size_t j1 = 0; j1 < f->n_side; j1++) {
            struct ray_sum ray = {0};
            struct ray_sum *to = out + (bin_of_ray(r, p, 0, j1) + r->n_bin) * f->n_side + j2;
            ray_sum_ray(&ray, f, ray_field_weight(f, p, j1, j2), ray_field_value(f, i, j1, j2));
            for (size_t m = 0; m < r->n_bin; m++) ray_sum_add(to - m * f->n_side, weight[m], &ray);
        }
}

/* Step 2a: out[n_centre]. */
static void convolve_bins(const struct run *r, size_t i, struct ray_sum *out)
{
    const struct ray_sum *bin = r->between + i * r->n_bin;
    float weight[MOST_BINS];
    struct ray_kernel k;
    ray_kernel_at(r->f, &r->f->pixel[i], false, &k);
    weigh_bins(r, &k, 1, 0.5f, weight);
    for (size_t j = 0; j < r->n_bin; j++)
        for (size_t m = 0; m < r->n_bin && bin[j].all > 0; m++) ray_sum_add(&out[j + r->n_bin - m], weight[m], &bin[j]);
}

/* The result of step 1a or 2a at pixel `at`, which lies around the block that starts at `corner`. */
static const struct ray_sum *made_of(const struct run *r, struct block *block, const long corner[2], size_t at,
                                     int pass)
{
    const long x = (long)(at % r->f->width) - corner[0] + RAY_REACH,
               y = (long)(at / r->f->width) - corner[1] + RAY_REACH;
    const size_t i = (size_t)(y * AROUND + x), n = r->n_made[pass];
    struct ray_sum *out = block->made + i * n;
    if (block->is_made[i]) return out;
    memset(out, 0, n * sizeof *out);
    if (pass == 0)
        convolve_rays(r, at, out);
    else
        convolve_bins(r, at, out);
    block->is_made[i] = true;
    return out;
}

/* Puts the rays of a pixel that is not filtered into bins of the second axis. */
static void keep_rays(const struct run *r, size_t i, struct ray_sum *out)
{
    const struct ray_field *f = r->f;
    const struct ray_pixel *p = &f->pixel[i];
    const struct ray_kernel plain = {.window = f->window};
    for (size_t j2 = 0; j2 < f->n_side; j2++) {
        const size_t bin = bin_of_ray(r, p, 1, j2);
        for (size_t j1 = 0; j1 < f->n_side && bin < r->n_bin; j1++)
            ray_sum_ray(&out[bin], f,
                        ray_weight_y(&plain, 0, ray_field_y(f, p, 0, j1) / f->half) * ray_field_weight(f, p, j1, j2),
                        ray_field_value(f, i, j1, j2));
    }
}

/* Step 1b. Rays of neighbours whose x along the second axis differs are moved along it, too. */
static void gather_first(const struct run *r, struct block *block, const long corner[2], size_t i)
{
    const struct ray_field *f = r->f;
    const struct ray_pixel *p = &f->pixel[i];
    struct ray_sum *out = r->between + i * r->n_bin;
    struct ray_kernel k;
    if (!ray_kernel_at(f, p, false, &k) || !k.sheared) {
        if (p->used) keep_rays(r, i, out);
        return;
    }
    for (int offset = -RAY_REACH; offset <= RAY_REACH; offset++) {
        const size_t at = ray_neighbour(f, i, 0, offset);
        if (at == SIZE_MAX) continue;
        const struct ray_pixel *q = &f->pixel[at];
        const float dx[2] = {ray_field_offset(f, p, q, 0), ray_field_offset(f, p, q, 1)};
        const size_t b = bin_of_centre(r, -k.shift[0] * dx[0]);
        if (b == r->n_centre) continue;
        const float weight = ray_weight_x(&k, 0, dx[0]);
        const struct ray_sum *made = made_of(r, block, corner, at, 0) + b * f->n_side;
        for (size_t j2 = 0; j2 < f->n_side; j2++) {
            const size_t bin = bin_of_y(r, ray_field_y(f, q, 1, j2) / f->half + k.shift[1] * dx[1]);
            if (bin < r->n_bin) ray_sum_add(&out[bin], weight, &made[j2]);
        }
    }
}

/* Step 2b. */
static void gather_second(const struct run *r, struct block *block, const long corner[2], size_t i)
{
    const struct ray_field *f = r->f;
    struct ray_kernel k;
    struct ray_sum sum = {0};
    const bool filtered = ray_kernel_at(f, &f->pixel[i], false, &k) && k.sheared;
    for (int offset = -RAY_REACH; offset <= RAY_REACH && filtered; offset++) {
        const size_t at = ray_neighbour(f, i, 1, offset);
        if (at == SIZE_MAX) continue;
        const float dx = ray_field_offset(f, &f->pixel[i], &f->pixel[at], 1);
        const size_t b = bin_of_centre(r, -k.shift[1] * dx);
        if (b < r->n_centre) ray_sum_add(&sum, ray_weight_x(&k, 1, dx), made_of(r, block, corner, at, 1) + b);
    }
    ray_sum_mean(f, i, &sum, r->mean);
}

static void run_block(struct run *r, size_t i_block, size_t i_thread, int pass)
{
    const size_t first[2] = {i_block % r->n_block[0] * BLOCK, i_block / r->n_block[0] * BLOCK};
    const long corner[2] = {(long)first[0], (long)first[1]};
    struct block *block = &r->scratch[i_thread];
    memset(block->is_made, 0, (size_t)AROUND * AROUND * sizeof *block->is_made);
    for (size_t y = first[1]; y < first[1] + BLOCK && y < r->f->height && !progress_cancelled(r->progress); y++)
        for (size_t x = first[0]; x < first[0] + BLOCK && x < r->f->width; x++) {
            if (pass == 0)
                gather_first(r, block, corner, y * r->f->width + x);
            else
                gather_second(r, block, corner, y * r->f->width + x);
        }
}

static void run_first(void *context, size_t i_block, size_t i_thread) { run_block(context, i_block, i_thread, 0); }

static void run_second(void *context, size_t i_block, size_t i_thread) { run_block(context, i_block, i_thread, 1); }

static status make_scratch(struct run *r, size_t n_thread, struct error *err)
{
    const size_t n_around = (size_t)AROUND * AROUND;
    r->between = calloc(r->f->width * r->f->height, r->n_bin * sizeof *r->between);
    r->scratch = calloc(n_thread, sizeof *r->scratch);
    bool enough = r->between != NULL && r->scratch != NULL;
    for (size_t i = 0; enough && i < n_thread; i++) {
        r->scratch[i].made = malloc(n_around * r->n_made[0] * sizeof *r->scratch[i].made);
        r->scratch[i].is_made = malloc(n_around * sizeof *r->scratch[i].is_made);
        enough = r->scratch[i].made != NULL && r->scratch[i].is_made != NULL;
    }
    return enough ? STATUS_OK : error_set(err, STATUS_NO_MEMORY, "cannot filter a picture: out of memory");
}

static void free_scratch(struct run *r, size_t n_thread)
{
    for (size_t i = 0; r->scratch != NULL && i < n_thread; i++) {
        free(r->scratch[i].made);
        free(r->scratch[i].is_made);
    }
    free(r->scratch);
    free(r->between);
}

status ray_filter_passes(const struct ray_field *f, struct thread_pool *pool, const struct progress *progress,
                         float *mean, struct error *err)
{
    struct run r = {.f = f, .progress = progress, .mean = mean};
    const size_t n_thread = pool != NULL ? thread_pool_n_thread(pool) : 1;
    r.n_bin = BINS_A_RAY * f->n_side;
    r.n_centre = 2 * r.n_bin + 1;
    r.n_made[0] = r.n_centre * f->n_side;
    r.n_made[1] = r.n_centre;
    r.n_block[0] = (f->width + BLOCK - 1) / BLOCK;
    r.n_block[1] = (f->height + BLOCK - 1) / BLOCK;
    status s = make_scratch(&r, n_thread, err);
    struct progress_part part[2] = {{progress, 0.0, 0.8}, {progress, 0.8, 0.2}};
    struct progress inner[2] = {progress_of_part(&part[0]), progress_of_part(&part[1])};
    if (s == STATUS_OK) {
        s = thread_pool_run(pool, r.n_block[0] * r.n_block[1], run_first, &r, &inner[0]);
        if (s == STATUS_OK) s = thread_pool_run(pool, r.n_block[0] * r.n_block[1], run_second, &r, &inner[1]);
        if (s == STATUS_OK && progress_cancelled(progress)) s = STATUS_CANCELLED;
        if (s == STATUS_CANCELLED) error_set(err, s, "filtering a picture was cancelled");
    }
    free_scratch(&r, n_thread);
    return s;
}
