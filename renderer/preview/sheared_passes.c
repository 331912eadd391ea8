/* The sheared filter in four passes of one dimension (equations 5.7 to 5.10 and footnote 7). Rows are filtered along
 * the first edge of the lamp into sums for each receiver and bin of the second edge, then columns along the second. */
#include "renderer/preview/sheared_kernel.h"

#include <stdlib.h>
#include <string.h>

/* Bins over the lamp for each sample along its edge, as published. Centres of w_y go one lamp further to both sides:
 * beyond that the square lamp has no weight. */
enum { BINS_A_SAMPLE = 4 };

struct sum {
    float lit, all;
};

struct run {
    const struct light_field *f;
    enum sheared_lamp lamp;
    const struct progress *progress;
    size_t n_bin;        /* over the lamp */
    size_t n_centre;     /* over two lamps' widths, with one at the middle */
    struct sum *between; /* [height][width][n_bin]: filtered along the first edge */
    struct sum *scratch; /* of each thread: scratch_length */
    size_t scratch_length;
    float *visibility;
};

/* The centre of w_y of bin i. */
static float centre_of(const struct run *r, size_t i) { return 2 * ((float)i - (float)r->n_bin) / (float)r->n_bin; }

/* The bin of a centre, one of them at 0; n_centre: it lies beyond all. */
static size_t bin_of_centre(const struct run *r, float centre)
{
    float at = floorf(centre * 0.5f * (float)r->n_bin + (float)r->n_bin + 0.5f);
    return at >= 0 && at < (float)r->n_centre ? (size_t)at : r->n_centre;
}

/* The bin of a place on the lamp, in half sides. A place just below 1 may round to 1. */
static size_t bin_of_place(const struct run *r, float place)
{
    const size_t bin = (size_t)(0.5f * (place + 1) * (float)r->n_bin);
    return bin < r->n_bin ? bin : r->n_bin - 1;
}

/* Step 1a: convolves the rays of a receiver along y of the first edge. out[n_centre][n_side]. */
static void convolve_rays(const struct run *r, size_t i, struct sum *out)
{
    const struct light_field *f = r->f;
    const size_t l = f->n_side;
    struct sheared_kernel k;
    sheared_kernel_at(f, r->lamp, i, &k);
    memset(out, 0, r->n_centre * l * sizeof *out);
    for (size_t b = 0; b < r->n_centre; b++)
        for (size_t j1 = 0; j1 < l; j1++) {
            float weight = sheared_weight_y(&k, 0, sheared_place(f, i, 0, j1) - centre_of(r, b));
            for (size_t j2 = 0; j2 < l && weight > 0; j2++) {
                out[b * l + j2].all += weight;
                if (f->lit[(i * l + j2) * l + j1]) out[b * l + j2].lit += weight;
            }
        }
}

/* Step 1b: gathers what step 1a has made of the receivers of a row, and puts it into the bins of their places along
 * the second edge. */
static void gather_row(const struct run *r, size_t y, size_t x, const struct sum *convolved, struct sum *out)
{
    const struct light_field *f = r->f;
    const size_t l = f->n_side;
    struct sheared_kernel k;
    if (!sheared_kernel_at(f, r->lamp, y * f->width + x, &k)) k.over_var[0] = INFINITY; /* only its own rays */
    for (long offset = -SHEARED_REACH; offset <= SHEARED_REACH; offset++) {
        long u = (long)x + offset;
        if (u < 0 || u >= (long)f->width || (offset != 0 && isinf(k.over_var[0]))) continue;
        float weight = offset == 0 ? 1 : sheared_weight_x(&k, 0, (float)offset);
        size_t i = y * f->width + (size_t)u, b = bin_of_centre(r, -k.shift[0] * (float)offset);
        if (b == r->n_centre) continue;
        for (size_t j2 = 0; j2 < l; j2++) {
            const struct sum *s = convolved + ((size_t)u * r->n_centre + b) * l + j2;
            struct sum *to = out + bin_of_place(r, sheared_place(f, i, 1, j2));
            to->lit += weight * s->lit;
            to->all += weight * s->all;
        }
    }
}

static void run_row(void *context, size_t y, size_t i_thread)
{
    const struct run *r = context;
    const size_t width = r->f->width;
    struct sum *convolved = r->scratch + i_thread * r->scratch_length;
    if (progress_cancelled(r->progress)) return;
    for (size_t x = 0; x < width; x++) convolve_rays(r, y * width + x, convolved + x * r->n_centre * r->f->n_side);
    for (size_t x = 0; x < width; x++) gather_row(r, y, x, convolved, r->between + (y * width + x) * r->n_bin);
}

/* Step 2a: convolves the bins of a receiver along y of the second edge. out[n_centre]. */
static void convolve_bins(const struct run *r, size_t i, struct sum *out)
{
    const struct sum *bin = r->between + i * r->n_bin;
    struct sheared_kernel k;
    sheared_kernel_at(r->f, r->lamp, i, &k);
    memset(out, 0, r->n_centre * sizeof *out);
    for (size_t b = 0; b < r->n_centre; b++)
        for (size_t j = 0; j < r->n_bin; j++) {
            if (!(bin[j].all > 0)) continue;
            float place = 2 * ((float)j + 0.5f) / (float)r->n_bin - 1;
            float weight = sheared_weight_y(&k, 1, place - centre_of(r, b));
            out[b].lit += weight * bin[j].lit;
            out[b].all += weight * bin[j].all;
        }
}

/* Step 2b: gathers what step 2a has made of the receivers of a column. */
static float gather_column(const struct run *r, size_t x, size_t y, const struct sum *convolved)
{
    const struct light_field *f = r->f;
    struct sheared_kernel k;
    struct sum total = {0, 0};
    size_t at = y * f->width + x;
    if (!sheared_kernel_at(f, r->lamp, at, &k)) return sheared_own(f, at);
    for (long offset = -SHEARED_REACH; offset <= SHEARED_REACH; offset++) {
        long v = (long)y + offset;
        size_t b = bin_of_centre(r, -k.shift[1] * (float)offset);
        if (v < 0 || v >= (long)f->height || b == r->n_centre) continue;
        float weight = sheared_weight_x(&k, 1, (float)offset);
        total.lit += weight * convolved[(size_t)v * r->n_centre + b].lit;
        total.all += weight * convolved[(size_t)v * r->n_centre + b].all;
    }
    return total.all > 0 ? total.lit / total.all : sheared_own(f, at);
}

static void run_column(void *context, size_t x, size_t i_thread)
{
    const struct run *r = context;
    const size_t width = r->f->width, height = r->f->height;
    struct sum *convolved = r->scratch + i_thread * r->scratch_length;
    if (progress_cancelled(r->progress)) return;
    for (size_t y = 0; y < height; y++) convolve_bins(r, y * width + x, convolved + y * r->n_centre);
    for (size_t y = 0; y < height; y++) r->visibility[y * width + x] = gather_column(r, x, y, convolved);
}

status sheared_filter_passes(const struct light_field *f, enum sheared_lamp lamp, struct thread_pool *pool,
                             const struct progress *progress, float *visibility, struct error *err)
{
    struct run r = {.f = f, .lamp = lamp, .progress = progress, .visibility = visibility};
    size_t n_thread = pool != NULL ? thread_pool_n_thread(pool) : 1,
           longer = f->width > f->height ? f->width : f->height;
    r.n_bin = BINS_A_SAMPLE * f->n_side;
    r.n_centre = 2 * r.n_bin + 1;
    r.scratch_length = longer * r.n_centre * f->n_side;
    r.between = calloc(f->width * f->height * r.n_bin, sizeof *r.between);
    r.scratch = malloc(n_thread * r.scratch_length * sizeof *r.scratch);
    status s = r.between != NULL && r.scratch != NULL
                   ? STATUS_OK
                   : error_set(err, STATUS_NO_MEMORY, "cannot filter a shadow: out of memory");
    struct progress_part part[2] = {{progress, 0.0, 0.8}, {progress, 0.8, 0.2}};
    struct progress inner[2] = {progress_of_part(&part[0]), progress_of_part(&part[1])};
    if (s == STATUS_OK) {
        s = thread_pool_run(pool, f->height, run_row, &r, &inner[0]);
        if (s == STATUS_OK) s = thread_pool_run(pool, f->width, run_column, &r, &inner[1]);
        if (s == STATUS_OK && progress_cancelled(progress)) s = STATUS_CANCELLED;
        if (s != STATUS_OK) error_set(err, s, "filtering a shadow was cancelled");
    }
    free(r.between);
    free(r.scratch);
    return s;
}
