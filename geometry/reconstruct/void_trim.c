#include "geometry/reconstruct/void_trim.h"

#include "geometry/volume/density_map.h"

#include <math.h>
#include <stdlib.h>

enum { MOST_SAMPLES = 1 << 22 };
/* Standard deviations by which the count of a layer exceeds the count of the emptiest ones, and counts that are
 * noise. */
static const double BEYOND_NOISE = 6.0, LEAST_COUNT = 3.0;

struct sampling {
    const size_t *n; /* columns, rows, slices */
    const struct scan_look *look;
    size_t stride;
    int axis;
    float *value;
    uint32_t *layer; /* of each value */
    size_t n_value, capacity;
};

static size_t n_layer(const struct sampling *s) { return (s->n[s->axis] + s->stride - 1) / s->stride; }

/* Mean of 3 x 3 voxels about (i, j) of a slice; not finite if one of them is. */
static float mean9(const float *slice, size_t n_row, size_t i, size_t j)
{
    float sum = 0.0f;
    for (size_t y = j - 1; y <= j + 1; y++)
        sum += slice[y * n_row + i - 1] + slice[y * n_row + i] + slice[y * n_row + i + 1];
    return sum / 9.0f;
}

static void sample_slice(struct sampling *s, const float *slice, size_t k)
{
    for (size_t j = 1; j + 1 < s->n[1]; j += s->stride)
        for (size_t i = 1; i + 1 < s->n[0] && s->n_value < s->capacity; i += s->stride) {
            const size_t at[3] = {i, j, k};
            const float mean = mean9(slice, s->n[0], i, j);
            if (!isfinite(mean) || fabsf(mean) > 1e30f) continue;
            s->layer[s->n_value] = (uint32_t)(at[s->axis] / s->stride);
            s->value[s->n_value++] = mean;
        }
}

static status sample(struct volume_source *source, struct sampling *s, const struct progress *progress,
                     struct error *err)
{
    float *slice = malloc(s->n[0] * s->n[1] * sizeof *slice);
    status st = slice != NULL ? STATUS_OK : error_set(err, STATUS_NO_MEMORY, "cannot read the volume: out of memory");
    for (size_t k = s->stride / 2; k < s->n[2] && st == STATUS_OK; k += s->stride) {
        if (progress_cancelled(progress))
            st = error_set(err, STATUS_CANCELLED, "reading the volume was cancelled");
        else
            st = volume_source_read(source, k, 1, slice, err);
        for (size_t i = 0; i < s->n[0] * s->n[1] && s->look->n_padding > 0 && st == STATUS_OK; i++)
            if (scan_look_is_padding(s->look, slice[i])) slice[i] = NAN;
        if (st == STATUS_OK) sample_slice(s, slice, k);
    }
    free(slice);
    return st;
}

static int compare_count(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* Counts that the layers without material may have. sorted: work of n values. */
static double most_of_noise(const double *count, double *sorted, size_t n)
{
    for (size_t i = 0; i < n; i++) sorted[i] = count[i];
    qsort(sorted, n, sizeof *sorted, compare_count);
    const double empty = sorted[n / 8]; /* median of the emptiest quarter */
    return empty + BEYOND_NOISE * sqrt(empty + 1.0) + LEAST_COUNT;
}

/* Finds the layers with material among the samples. */
static status find_layers(const struct sampling *s, size_t range[2], struct error *err)
{
    const size_t n = n_layer(s);
    double *count = calloc(2 * n, sizeof *count), threshold;
    if (count == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot read the volume: out of memory");
    if (density_threshold(s->value, s->n_value, &threshold)) {
        size_t first = n, last = 0;
        for (size_t i = 0; i < s->n_value; i++) count[s->layer[i]] += (double)s->value[i] > threshold;
        const double most = most_of_noise(count, count + n, n);
        for (size_t l = 0; l < n; l++) {
            if (!(count[l] > most)) continue;
            first = l < first ? l : first;
            last = l;
        }
        const size_t margin = VOID_TRIM_MARGIN + s->stride, low = first * s->stride, high = (last + 1) * s->stride;
        if (first < n) {
            range[0] = low > margin ? low - margin : 0;
            range[1] = high + margin < range[1] ? high + margin : range[1];
        }
    }
    free(count);
    return STATUS_OK;
}

status void_trim_find(struct volume_source *source, const struct scan_look *look, int axis,
                      const struct progress *progress, size_t range[2], struct error *err)
{
    struct sampling s = {.n = volume_source_describe(source)->n, .look = look, .axis = axis, .stride = 1};
    range[0] = 0;
    range[1] = s.n[axis];
    while (s.n[0] / s.stride * (s.n[1] / s.stride) * (s.n[2] / s.stride) > MOST_SAMPLES) s.stride++;
    s.capacity = (s.n[0] / s.stride + 1) * (s.n[1] / s.stride + 1) * (s.n[2] / s.stride + 1);
    s.value = malloc(s.capacity * sizeof *s.value);
    s.layer = malloc(s.capacity * sizeof *s.layer);
    status st = s.value != NULL && s.layer != NULL
                    ? sample(source, &s, progress, err)
                    : error_set(err, STATUS_NO_MEMORY, "cannot read the volume: out of memory");
    if (st == STATUS_OK) st = find_layers(&s, range, err);
    free(s.value);
    free(s.layer);
    return st;
}
