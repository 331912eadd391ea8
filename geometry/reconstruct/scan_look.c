#include "geometry/reconstruct/scan_look.h"

#include <math.h>
#include <stdlib.h>

/* At most EDGE columns and rows of a slice are looked at; quantiles come from about N_QUANTILE values. */
enum { EDGE = 512, N_QUANTILE = 1 << 16 };
static const double LEAST_GAP = 0.02, MOST_NEAR = 0.001, LEAST_DISTANCE = 0.1, LEAST_SHARE = 0.005, MOST_SHARE = 0.95;
static const double MOST_BETWEEN = 0.02, MOST_BETWEEN_OTHERS = 0.005;

struct lattice {
    size_t n[3]; /* columns, rows, slices that are looked at */
    float *value;
    const struct scan_look *look; /* padding that was found before */
};

/* NaN equals NaN. */
static bool same(float a, float b) { return a == b || (isnan(a) && isnan(b)); }

bool scan_look_is_padding(const struct scan_look *look, float value)
{
    for (size_t i = 0; i < look->n_padding; i++)
        if (same(value, look->padding[i])) return true;
    return false;
}

static size_t n_all(const struct lattice *l) { return l->n[0] * l->n[1] * l->n[2]; }

/* Whether the voxel is padding, or has the value that may be. */
static bool is_code(const struct lattice *l, float value, float code)
{
    return same(value, code) || scan_look_is_padding(l->look, value);
}

/* Returns the voxels of a line of n, `step` apart, that are code and lie between others. */
static size_t between_of_line(const struct lattice *l, size_t first, size_t n, size_t step, float code)
{
    size_t low = 0, high = n, count = 0;
    while (low < n && is_code(l, l->value[first + low * step], code)) low++;
    while (high > low && is_code(l, l->value[first + (high - 1) * step], code)) high--;
    for (size_t i = low; i < high; i++) count += is_code(l, l->value[first + i * step], code);
    return count;
}

/* Returns the most voxels of code that lie between others along one of the three axes. */
static size_t between_others(const struct lattice *l, float code)
{
    const size_t step[3] = {1, l->n[0], l->n[0] * l->n[1]};
    size_t most = 0;
    for (int a = 0; a < 3; a++) {
        const int b = (a + 1) % 3, c = (a + 2) % 3;
        size_t count = 0;
        for (size_t i = 0; i < l->n[b]; i++)
            for (size_t j = 0; j < l->n[c]; j++)
                count += between_of_line(l, i * step[b] + j * step[c], l->n[a], step[a], code);
        most = count > most ? count : most;
    }
    return most;
}

static int compare_float(const void *a, const void *b)
{
    const float x = *(const float *)a, y = *(const float *)b;
    return (x > y) - (x < y);
}

/* The values besides code: their extremes, and the distance from the 1 % to the 99 % quantile. */
struct others {
    size_t n_code, n;
    double least, most, spread;
};

static status measure_others(const struct lattice *l, float code, struct others *o, struct error *err)
{
    const size_t n = n_all(l), step = n / N_QUANTILE + 1;
    size_t n_sorted = 0, i_other = 0;
    float *sorted = malloc((n / step + 1) * sizeof *sorted);
    if (sorted == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot look at the scan: out of memory");
    *o = (struct others){.least = INFINITY, .most = -INFINITY};
    for (size_t i = 0; i < n; i++) {
        const float v = l->value[i];
        o->n_code += same(v, code);
        if (is_code(l, v, code) || !isfinite(v)) continue;
        o->n++;
        o->least = fmin(o->least, (double)v);
        o->most = fmax(o->most, (double)v);
        if (i_other++ % step == 0) sorted[n_sorted++] = v;
    }
    if (n_sorted > 0) {
        qsort(sorted, n_sorted, sizeof *sorted, compare_float);
        o->spread = (double)sorted[n_sorted - 1 - n_sorted / 100] - (double)sorted[n_sorted / 100];
    }
    free(sorted);
    return STATUS_OK;
}

/* Returns whether a code is far from the other values: all of them, or all but a few in the tail of the noise. */
static bool is_apart(const struct lattice *l, float code, const struct others *o)
{
    const double distance = (double)code < o->least ? o->least - (double)code : (double)code - o->most;
    size_t n_near = 0;
    if (!(o->spread > 0.0) || !(distance >= LEAST_GAP * o->spread)) return false;
    for (size_t i = 0; i < n_all(l); i++)
        n_near += !is_code(l, l->value[i], code) && fabs((double)(l->value[i] - code)) < LEAST_DISTANCE * o->spread;
    return (double)n_near <= MOST_NEAR * (double)o->n;
}

static bool is_padding(const struct lattice *l, float code, const struct others *o, bool stated)
{
    const double n = (double)n_all(l), share = (double)o->n_code / n;
    if (share < LEAST_SHARE || share > MOST_SHARE || o->n == 0) return false;
    if (isfinite(code) && !stated && !is_apart(l, code, o)) return false;
    const double between = (double)between_others(l, code);
    return between <= MOST_BETWEEN * (double)o->n_code && between <= MOST_BETWEEN_OTHERS * (double)o->n;
}

/* Looks for one more value that is padding. */
static status find_padding(const struct lattice *l, double stated, struct scan_look *look, bool *found,
                           struct error *err)
{
    float candidate[5] = {NAN, (float)stated, INFINITY, -INFINITY, NAN};
    for (size_t i = 0; i < n_all(l); i++) {
        const float v = l->value[i];
        if (scan_look_is_padding(look, v) || isnan(v)) continue;
        candidate[2] = fminf(candidate[2], v);
        candidate[3] = fmaxf(candidate[3], v);
    }
    *found = false;
    for (int c = isnan(stated) ? 2 : 1; c < 5 && !*found; c++) { /* NaN comes last */
        struct others o = {0};
        if (scan_look_is_padding(look, candidate[c])) continue;
        status s = measure_others(l, candidate[c], &o, err);
        if (s != STATUS_OK) return s;
        *found = is_padding(l, candidate[c], &o, c == 1);
        if (!*found) continue;
        look->padding[look->n_padding] = candidate[c];
        look->share[look->n_padding++] = (double)o.n_code / (double)n_all(l);
    }
    return STATUS_OK;
}

static status read_lattice(struct volume_source *source, struct lattice *l, struct error *err)
{
    const size_t *n = volume_source_describe(source)->n;
    const size_t step[2] = {(n[0] + EDGE - 1) / EDGE, (n[1] + EDGE - 1) / EDGE};
    float *slice = malloc(n[0] * n[1] * sizeof *slice), *to;
    for (int a = 0; a < 2; a++) l->n[a] = (n[a] + step[a] - 1) / step[a];
    l->n[2] = n[2] < SCAN_LOOK_SLICES ? n[2] : SCAN_LOOK_SLICES;
    l->value = to = malloc(n_all(l) * sizeof *l->value);
    status s = slice != NULL && to != NULL ? STATUS_OK
                                           : error_set(err, STATUS_NO_MEMORY, "cannot look at the scan: out of memory");
    for (size_t k = 0; k < l->n[2] && s == STATUS_OK; k++) {
        const size_t i_slice = l->n[2] > 1 ? k * (n[2] - 1) / (l->n[2] - 1) : 0;
        s = volume_source_read(source, i_slice, 1, slice, err);
        for (size_t j = 0; j < n[1] && s == STATUS_OK; j += step[1])
            for (size_t i = 0; i < n[0]; i += step[0]) *to++ = slice[j * n[0] + i];
    }
    free(slice);
    return s;
}

status scan_look_take(struct volume_source *source, struct scan_look *look, struct error *err)
{
    struct lattice l = {.look = look};
    bool found = true;
    *look = (struct scan_look){.least = INFINITY, .most = -INFINITY};
    status s = read_lattice(source, &l, err);
    while (s == STATUS_OK && found && look->n_padding < SCAN_PADDING_MAX)
        s = find_padding(&l, volume_source_describe(source)->padding, look, &found, err);
    for (size_t i = 0; s == STATUS_OK && i < n_all(&l); i++) {
        if (scan_look_is_padding(look, l.value[i])) continue;
        look->has_unnumbered = look->has_unnumbered || !isfinite(l.value[i]);
        look->least = fmin(look->least, (double)l.value[i]);
        look->most = fmax(look->most, (double)l.value[i]);
    }
    free(l.value);
    return s;
}
