#include "geometry/fibers/fiber_set.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

void fiber_set_init(struct fiber_set *f) { *f = (struct fiber_set){0}; }

void fiber_set_release(struct fiber_set *f)
{
    if (f == NULL) return;
    free(f->first_vertex);
    free(f->position_m);
    free(f->radius_m);
    free(f->axis_class);
    free(f->group);
    free(f->shape);
    *f = (struct fiber_set){.tile_size_m = {f->tile_size_m[0], f->tile_size_m[1]}};
}

status fiber_set_reserve(struct fiber_set *f, size_t n_fiber, size_t n_vertex, struct error *err)
{
    fiber_set_release(f);
    if (n_fiber < SIZE_MAX / 64 && n_vertex < SIZE_MAX / 64) {
        f->first_vertex = calloc(n_fiber + 1, sizeof *f->first_vertex);
        f->position_m = malloc((n_vertex > 0 ? n_vertex : 1) * 3 * sizeof *f->position_m);
        f->radius_m = malloc((n_fiber > 0 ? n_fiber : 1) * sizeof *f->radius_m);
        f->axis_class = calloc(n_fiber > 0 ? n_fiber : 1, sizeof *f->axis_class);
        f->group = calloc(n_fiber > 0 ? n_fiber : 1, sizeof *f->group);
    }
    if (f->first_vertex == NULL || f->position_m == NULL || f->radius_m == NULL || f->axis_class == NULL ||
        f->group == NULL) {
        fiber_set_release(f);
        return error_set(err, STATUS_NO_MEMORY, "cannot hold %zu fibers with %zu vertices: out of memory", n_fiber,
                         n_vertex);
    }
    f->n_fiber = n_fiber;
    f->n_vertex = n_vertex;
    return STATUS_OK;
}

status fiber_set_add_shapes(struct fiber_set *f, struct error *err)
{
    if (f->shape != NULL) return STATUS_OK;
    f->shape = malloc((f->n_vertex > 0 ? f->n_vertex : 1) * sizeof *f->shape);
    if (f->shape == NULL)
        return error_set(err, STATUS_NO_MEMORY, "cannot hold the sections of %zu vertices: out of memory", f->n_vertex);
    for (size_t i = 0; i < f->n_fiber; i++)
        for (size_t k = f->first_vertex[i]; k < f->first_vertex[i + 1]; k++)
            f->shape[k] = fiber_shape_disc(f->radius_m[i]);
    return STATUS_OK;
}

void fiber_set_scale_radius(struct fiber_set *f, size_t i_fiber, double factor)
{
    f->radius_m[i_fiber] = (float)((double)f->radius_m[i_fiber] * factor);
    if (f->shape == NULL) return;
    for (size_t k = f->first_vertex[i_fiber]; k < f->first_vertex[i_fiber + 1]; k++) {
        f->shape[k].radius = (float)((double)f->shape[k].radius * factor);
        f->shape[k].radius_se = (float)((double)f->shape[k].radius_se * factor);
    }
}

status fiber_set_copy(const struct fiber_set *from, struct fiber_set *to, struct error *err)
{
    status s = fiber_set_reserve(to, from->n_fiber, from->n_vertex, err);
    if (s != STATUS_OK) return s;
    if (from->shape != NULL) {
        s = fiber_set_add_shapes(to, err);
        if (s != STATUS_OK) return s;
        memcpy(to->shape, from->shape, from->n_vertex * sizeof *to->shape);
    }
    memcpy(to->first_vertex, from->first_vertex, (from->n_fiber + 1) * sizeof *to->first_vertex);
    memcpy(to->position_m, from->position_m, 3 * from->n_vertex * sizeof *to->position_m);
    memcpy(to->radius_m, from->radius_m, from->n_fiber * sizeof *to->radius_m);
    memcpy(to->axis_class, from->axis_class, from->n_fiber);
    memcpy(to->group, from->group, from->n_fiber);
    memcpy(to->tile_size_m, from->tile_size_m, sizeof to->tile_size_m);
    return STATUS_OK;
}

void fiber_shape_numbers(const struct fiber_shape *s, float value[FIBER_SHAPE_WITH_LUMEN])
{
    const float number[FIBER_SHAPE_WITH_LUMEN] = {1000.0f * s->radius_se, s->ratio,        s->ratio_se,
                                                  s->angle_se_rad,        s->long_axis[0], s->long_axis[1],
                                                  s->long_axis[2],        s->lumen,        s->lumen_se};
    memcpy(value, number, sizeof number);
}

bool fiber_shape_set(struct fiber_shape *s, const float *value, int n)
{
    const float *axis = value + 4, length = sqrtf(axis[0] * axis[0] + axis[1] * axis[1] + axis[2] * axis[2]);
    for (int i = 0; i < n; i++)
        if (!isfinite(value[i]) || ((i < 4 || i > 6) && !(value[i] >= 0.0f))) return false;
    if (!(value[1] >= 1.0f && value[1] <= FIBER_RATIO_MOST) || (length > 0.0f && !(fabsf(length - 1.0f) < 0.01f)))
        return false;
    if (n == FIBER_SHAPE_WITH_LUMEN && value[7] > FIBER_LUMEN_MOST) return false;
    s->radius_se = 1e-3f * value[0];
    s->ratio = value[1];
    s->ratio_se = value[2];
    s->angle_se_rad = value[3];
    for (int a = 0; a < 3; a++) s->long_axis[a] = length > 0.0f ? axis[a] / length : 0.0f;
    s->lumen = n == FIBER_SHAPE_WITH_LUMEN ? value[7] : 0.0f;
    s->lumen_se = n == FIBER_SHAPE_WITH_LUMEN ? value[8] : 0.0f;
    return true;
}

bool fiber_set_has_lumens(const struct fiber_set *f)
{
    for (size_t k = 0; k < f->n_vertex && f->shape != NULL; k++)
        if (f->shape[k].lumen > 0.0f || f->shape[k].lumen_se > 0.0f) return true;
    return false;
}

static status validate_shape(const struct fiber_set *f, size_t i, struct error *err)
{
    for (size_t k = f->first_vertex[i]; k < f->first_vertex[i + 1]; k++) {
        const struct fiber_shape *s = &f->shape[k];
        const size_t at = k - f->first_vertex[i];
        if (!(s->radius > 0.0f) || !isfinite(s->radius))
            return error_set(err, STATUS_INVALID, "vertex %zu of fiber %zu has radius %g m, it must be positive", at, i,
                             (double)s->radius);
        if (!(s->ratio >= 1.0f && s->ratio <= FIBER_RATIO_MOST))
            return error_set(err, STATUS_INVALID,
                             "vertex %zu of fiber %zu has a section with axes of the ratio %g, it must be 1 to %g", at,
                             i, (double)s->ratio, (double)FIBER_RATIO_MOST);
        if (!(s->lumen >= 0.0f && s->lumen <= FIBER_LUMEN_MOST))
            return error_set(err, STATUS_INVALID,
                             "vertex %zu of fiber %zu has a lumen of %g of its width, it must be 0 to %g", at, i,
                             (double)s->lumen, (double)FIBER_LUMEN_MOST);
    }
    return STATUS_OK;
}

static status validate_fiber(const struct fiber_set *f, size_t i, struct error *err)
{
    size_t first = f->first_vertex[i], end = f->first_vertex[i + 1];
    if (end > f->n_vertex || end < first || end - first < 2)
        return error_set(err, STATUS_INVALID, "fiber %zu has fewer than two vertices", i);
    if (!(f->radius_m[i] > 0.0f) || !isfinite(f->radius_m[i]))
        return error_set(err, STATUS_INVALID, "fiber %zu has radius %g m, it must be positive", i,
                         (double)f->radius_m[i]);
    if (f->axis_class[i] > 2)
        return error_set(err, STATUS_INVALID, "fiber %zu has axis class %u, it must be 0, 1 or 2", i,
                         (unsigned)f->axis_class[i]);
    if (f->group[i] >= FIBER_MAX_GROUP)
        return error_set(err, STATUS_INVALID, "fiber %zu has group %u, allowed are 0 to %d", i, (unsigned)f->group[i],
                         FIBER_MAX_GROUP - 1);
    for (size_t k = 3 * first; k < 3 * end; k++)
        if (!isfinite(f->position_m[k]))
            return error_set(err, STATUS_INVALID, "vertex %zu of fiber %zu is not a finite point", k / 3 - first, i);
    return f->shape != NULL ? validate_shape(f, i, err) : STATUS_OK;
}

status fiber_set_validate(const struct fiber_set *f, struct error *err)
{
    if (f->n_fiber == 0) return error_set(err, STATUS_INVALID, "the cloth has no fiber");
    for (int a = 0; a < 2; a++)
        if (!(f->tile_size_m[a] > 0.0) || !isfinite(f->tile_size_m[a]))
            return error_set(err, STATUS_INVALID, "the tile size in %c is %g m, it must be positive", "xy"[a],
                             f -> tile_size_m[a]);
    if (f->first_vertex[0] != 0 || f->first_vertex[f->n_fiber] != f->n_vertex)
        return error_set(err, STATUS_INVALID, "the fibers use %zu vertices, the set has %zu",
                         f->first_vertex[f->n_fiber] - f->first_vertex[0], f->n_vertex);
    for (size_t i = 0; i < f->n_fiber; i++) {
        status s = validate_fiber(f, i, err);
        if (s != STATUS_OK) return s;
    }
    return STATUS_OK;
}

size_t fiber_set_n_group(const struct fiber_set *f)
{
    size_t n = 1;
    for (size_t i = 0; i < f->n_fiber; i++)
        if (f->group[i] >= n) n = (size_t)f->group[i] + 1;
    return n;
}

double fiber_set_length_m(const struct fiber_set *f)
{
    double length = 0.0;
    for (size_t i = 0; i < f->n_fiber; i++)
        for (size_t k = f->first_vertex[i]; k + 1 < f->first_vertex[i + 1]; k++) {
            const float *a = f->position_m + 3 * k, *b = a + 3;
            double d[3] = {(double)b[0] - a[0], (double)b[1] - a[1], (double)b[2] - a[2]};
            length += sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
        }
    return length;
}

void fiber_set_z_range_m(const struct fiber_set *f, double *z_min_m, double *z_max_m)
{
    double low = INFINITY, high = -INFINITY;
    for (size_t i = 0; i < f->n_fiber; i++)
        for (size_t k = f->first_vertex[i]; k < f->first_vertex[i + 1]; k++) {
            double z = f->position_m[3 * k + 2], r = fiber_radius_m(f, i, k);
            if (z - r < low) low = z - r;
            if (z + r > high) high = z + r;
        }
    *z_min_m = low;
    *z_max_m = high;
}

void fiber_set_classify(struct fiber_set *f)
{
    for (size_t i = 0; i < f->n_fiber; i++) {
        double sum[3] = {0.0, 0.0, 0.0};
        for (size_t k = f->first_vertex[i]; k + 1 < f->first_vertex[i + 1]; k++)
            for (size_t a = 0; a < 3; a++)
                sum[a] += fabs((double)f->position_m[3 * k + 3 + a] - (double)f->position_m[3 * k + a]);
        uint8_t best = sum[1] > sum[0] ? 1 : 0;
        if (sum[2] > sum[best]) best = 2;
        f->axis_class[i] = best;
    }
}
