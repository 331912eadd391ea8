#include "geometry/volume/volume_unknown.h"

#include "geometry/volume/volume_align.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Writes the runs of voxels at VOLUME_OUTSIDE if `run` exists. Returns their number. */
static size_t find_runs(const struct volume *v, struct volume_run *run)
{
    const size_t n = volume_n_voxel(v->n), n_slice = v->n[0] * v->n[1];
    size_t count = 0;
    for (size_t i = 0; i < n; i++) {
        if (i % n_slice == 0) scratch_keep_within(v->space);
        if (v->density[i] != VOLUME_OUTSIDE) continue;
        if (i > 0 && v->density[i - 1] == VOLUME_OUTSIDE) {
            if (run != NULL) run[count - 1].end = i + 1;
            continue;
        }
        if (run != NULL) run[count] = (struct volume_run){i, i + 1};
        count++;
    }
    return count;
}

status volume_mark_unknown(struct volume *v, struct error *err)
{
    const size_t n = find_runs(v, NULL);
    void *run = NULL;
    if (n == 0) return STATUS_OK;
    status s = scratch_new(v->space, n * sizeof *v->unknown.run, "the voxels without a measurement", &run, err);
    if (s != STATUS_OK) return s;
    v->unknown = (struct volume_unknown){n, run};
    find_runs(v, v->unknown.run);
    return STATUS_OK;
}

/* Returns whether one of the voxels from first to end, excluded, is unknown. */
static bool has_unknown(const struct volume *v, size_t first, size_t end)
{
    size_t low = 0, high = v->unknown.n;
    while (low < high) {
        const size_t middle = low + (high - low) / 2;
        if (v->unknown.run[middle].end <= first)
            low = middle + 1;
        else
            high = middle;
    }
    return low < v->unknown.n && v->unknown.run[low].first < end;
}

bool volume_unknown_near(const struct volume *v, const float x[3], float reach)
{
    size_t from[3], to[3];
    if (v->unknown.n == 0) return false;
    for (int a = 0; a < 3; a++) {
        const float last = (float)(v->n[a] - 1);
        from[a] = (size_t)fminf(fmaxf(floorf(x[a] - reach), 0.0f), last);
        to[a] = (size_t)fminf(fmaxf(floorf(x[a] + reach), 0.0f), last) + 1;
    }
    for (size_t k = from[2]; k < to[2]; k++)
        for (size_t j = from[1]; j < to[1]; j++) {
            const size_t row = volume_index(v->n, 0, j, k);
            if (has_unknown(v, row + from[0], row + to[0])) return true;
        }
    return false;
}

/* ---- densities that continue outwards ---- */

/* Density of a voxel that has none yet, and of one that is in the next layer. */
static const float NONE = -1.0f, NEXT = -2.0f;

struct layer {
    size_t n, n_allocated, *voxel;
};

static status append(struct layer *l, size_t i, struct error *err)
{
    if (l->n == l->n_allocated) {
        const size_t n = l->n_allocated * 2 + 1024;
        size_t *grown = realloc(l->voxel, n * sizeof *grown);
        if (grown == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot continue densities: out of memory");
        l->voxel = grown;
        l->n_allocated = n;
    }
    l->voxel[l->n++] = i;
    return STATUS_OK;
}

/* The neighbours of a voxel with itself, from[] to to[] excluded. */
static void box_around(const size_t n[3], size_t i, size_t from[3], size_t to[3])
{
    const size_t at[3] = {i % n[0], i / n[0] % n[1], i / n[0] / n[1]};
    for (int a = 0; a < 3; a++) {
        from[a] = at[a] > 0 ? at[a] - 1 : 0;
        to[a] = at[a] + 2 < n[a] ? at[a] + 2 : n[a];
    }
}

static float mean_around(const struct volume *v, size_t i)
{
    size_t from[3], to[3], count = 0;
    float sum = 0.0f;
    box_around(v->n, i, from, to);
    for (size_t z = from[2]; z < to[2]; z++)
        for (size_t y = from[1]; y < to[1]; y++)
            for (size_t x = from[0]; x < to[0]; x++) {
                const float density = v->density[volume_index(v->n, x, y, z)];
                if (density < 0.0f) continue;
                sum += density;
                count++;
            }
    return sum / (float)count;
}

/* Enters the neighbours of a voxel that have no density in the next layer. */
static status add_around(struct volume *v, size_t i, struct layer *next, struct error *err)
{
    size_t from[3], to[3];
    status s = STATUS_OK;
    box_around(v->n, i, from, to);
    for (size_t z = from[2]; z < to[2]; z++)
        for (size_t y = from[1]; y < to[1]; y++)
            for (size_t x = from[0]; x < to[0] && s == STATUS_OK; x++) {
                const size_t at = volume_index(v->n, x, y, z);
                if (v->density[at] != NONE) continue;
                v->density[at] = NEXT;
                s = append(next, at, err);
            }
    return s;
}

/* The first layer: voxels without a density beside others. */
static status first_layer(const struct volume *v, struct volume *to, struct layer *layer, struct error *err)
{
    status s = STATUS_OK;
    for (size_t r = 0; r < v->unknown.n && s == STATUS_OK; r++)
        for (size_t i = v->unknown.run[r].first; i < v->unknown.run[r].end && s == STATUS_OK; i++) {
            size_t from[3], end[3];
            bool beside = false;
            box_around(to->n, i, from, end);
            for (size_t z = from[2]; z < end[2] && !beside; z++)
                for (size_t y = from[1]; y < end[1] && !beside; y++)
                    for (size_t x = from[0]; x < end[0] && !beside; x++)
                        beside = to->density[volume_index(to->n, x, y, z)] >= 0.0f;
            if (!beside) continue;
            to->density[i] = NEXT;
            s = append(layer, i, err);
        }
    return s;
}

/* Gives the voxels of a layer densities, all from the layers before, and finds the next layer. */
static status fill_layer(struct volume *to, const struct layer *layer, float *mean, struct layer *next,
                         struct error *err)
{
    status s = STATUS_OK;
    for (size_t k = 0; k < layer->n; k++) mean[k] = mean_around(to, layer->voxel[k]);
    for (size_t k = 0; k < layer->n; k++) to->density[layer->voxel[k]] = mean[k];
    next->n = 0;
    for (size_t k = 0; k < layer->n && s == STATUS_OK; k++) s = add_around(to, layer->voxel[k], next, err);
    return s;
}

static status fill_layers(const struct volume *v, struct volume *to, struct error *err)
{
    struct layer layer = {0}, next = {0};
    status s = first_layer(v, to, &layer, err);
    for (int k = 0; k < VOLUME_CONTINUED_VOXELS && layer.n > 0 && s == STATUS_OK; k++) {
        float *mean = malloc(layer.n * sizeof *mean);
        s = mean != NULL ? fill_layer(to, &layer, mean, &next, err)
                         : error_set(err, STATUS_NO_MEMORY, "cannot continue densities: out of memory");
        free(mean);
        const struct layer last = layer;
        layer = next;
        next = last;
        scratch_keep_within(to->space);
    }
    free(layer.voxel);
    free(next.voxel);
    return s;
}

status volume_continue(const struct volume *v, struct volume *to, struct error *err)
{
    const size_t n_slice = v->n[0] * v->n[1];
    status s = volume_init_in(to, v->n, v->voxel_size_m, v->space, err);
    for (size_t k = 0; k < v->n[2] && s == STATUS_OK; k++) {
        memcpy(to->density + k * n_slice, v->density + k * n_slice, n_slice * sizeof *v->density);
        scratch_keep_within(v->space);
    }
    if (s != STATUS_OK) return s;
    for (size_t r = 0; r < v->unknown.n; r++)
        for (size_t i = v->unknown.run[r].first; i < v->unknown.run[r].end; i++) to->density[i] = NONE;
    s = fill_layers(v, to, err);
    for (size_t r = 0; r < v->unknown.n; r++)
        for (size_t i = v->unknown.run[r].first; i < v->unknown.run[r].end; i++)
            to->density[i] = fmaxf(0.0f, to->density[i]);
    if (s != STATUS_OK) volume_release(to);
    return s;
}

/* ---- results in unknown voxels ---- */

void volume_unknown_empty(const struct volume *v, struct direction_volume *d)
{
    for (size_t r = 0; r < v->unknown.n; r++)
        memset(d->density + v->unknown.run[r].first, 0, v->unknown.run[r].end - v->unknown.run[r].first);
}

void volume_unknown_ignore(const struct volume *v, struct volume *to)
{
    for (size_t r = 0; r < v->unknown.n; r++)
        for (size_t i = v->unknown.run[r].first; i < v->unknown.run[r].end; i++) to->density[i] = VOLUME_IGNORED;
}
