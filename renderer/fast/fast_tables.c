#include "renderer/fast/fast_tables.h"

#include <math.h>
#include <stdlib.h>

static status take(void **p, size_t n, size_t size, struct error *err)
{
    free(*p);
    *p = calloc(n > 0 ? n : 1, size);
    return *p != NULL ? STATUS_OK
                      : error_set(err, STATUS_NO_MEMORY, "cannot make tables: no memory for %zu numbers", n);
}

status fast_tables_reserve_cells(struct fast_tables *t, struct error *err)
{
    return take((void **)&t->cell, fast_n_cell(t), sizeof *t->cell, err);
}

status fast_tables_reserve_transfer(struct fast_tables *t, struct error *err)
{
    size_t n = fast_n_harmonic(t);
    return take((void **)&t->transfer, t->n_transfer * 3 * n * n, sizeof *t->transfer, err);
}

status fast_tables_reserve_scatter(struct fast_tables *t, struct error *err)
{
    return take((void **)&t->scatter, (size_t)t->n_set * FAST_N_THETA * 3 * fast_n_harmonic(t), sizeof *t->scatter,
                err);
}

status fast_tables_reserve_segments(struct fast_tables *t, struct error *err)
{
    status s = take((void **)&t->segment_row, t->n_segment, sizeof *t->segment_row, err);
    for (size_t i = 0; i < t->n_segment && s == STATUS_OK; i++) t->segment_row[i] = FAST_NO_ROW;
    return s;
}

status fast_tables_reserve_rows(struct fast_tables *t, struct error *err)
{
    status s = take((void **)&t->basis, FAST_N_GRID * FAST_N_GRID * (1 + FAST_N_COMPONENT), sizeof *t->basis, err);
    if (s == STATUS_OK) s = take((void **)&t->component_scale, FAST_N_COMPONENT, sizeof *t->component_scale, err);
    if (s == STATUS_OK)
        s = take((void **)&t->component, (size_t)t->n_row * FAST_N_COMPONENT, sizeof *t->component, err);
    return s == STATUS_OK ? take((void **)&t->gaussian, (size_t)t->n_row * 2 * FAST_N_GAUSSIAN, 1, err) : s;
}

status fast_tables_reserve_deep(struct fast_tables *t, struct error *err)
{
    status s = take((void **)&t->deep.value, deep_light_n_value(&t->deep), sizeof *t->deep.value, err);
    return s == STATUS_OK ? take((void **)&t->deep.shift, deep_light_n_shift(&t->deep), sizeof *t->deep.shift, err) : s;
}

void fast_tables_release(struct fast_tables *t)
{
    free(t->cell);
    free(t->transfer);
    free(t->scatter);
    free(t->segment_row);
    free(t->basis);
    free(t->component_scale);
    free(t->component);
    free(t->gaussian);
    free(t->deep.value);
    free(t->deep.shift);
    *t = (struct fast_tables){0};
}

static size_t cell_along(double share, uint32_t n)
{
    return share <= 0.0 ? 0 : share >= 1.0 ? n - 1 : (size_t)(share * n);
}

uint32_t fast_tables_cell_at(const struct fast_tables *t, const float p[3])
{
    size_t x = cell_along((double)p[0] / t->tile_mm[0], t->n_cell[0]),
           y = cell_along((double)p[1] / t->tile_mm[1], t->n_cell[1]),
           z = cell_along((double)p[2] / t->bottom_mm, t->n_cell[2]);
    return t->cell[(z * t->n_cell[1] + y) * t->n_cell[0] + x];
}

static float at_point(const struct fast_tables *t, const int8_t *component, size_t i_theta, size_t i_phi)
{
    const float *b = t->basis + (i_theta * FAST_N_GRID + i_phi) * (1 + FAST_N_COMPONENT);
    float sum = b[0];
    for (size_t k = 0; k < FAST_N_COMPONENT; k++) sum += (float)component[k] * t->component_scale[k] * b[1 + k];
    return sum;
}

float fast_tables_distance(const struct fast_tables *t, uint32_t row, const float d[3])
{
    const int8_t *component = t->component + (size_t)row * FAST_N_COMPONENT;
    float theta = acosf(fminf(fmaxf(d[2], -1), 1)), phi = atan2f(d[1], d[0]);
    if (phi < 0) phi += (float)(2 * M_PI);
    float u = theta * (float)(FAST_N_GRID * M_1_PI) - 0.5f, v = phi * (float)(FAST_N_GRID * 0.5 * M_1_PI) - 0.5f;
    u = fminf(fmaxf(u, 0), FAST_N_GRID - 1); /* constant beyond the rows around the poles */
    size_t i = u < FAST_N_GRID - 2 ? (size_t)u : FAST_N_GRID - 2;
    float j_floor = floorf(v), a = u - (float)i, b = v - j_floor;
    size_t j = (size_t)((int)j_floor + FAST_N_GRID) % FAST_N_GRID, k = (j + 1) % FAST_N_GRID;
    float near = (1 - b) * at_point(t, component, i, j) + b * at_point(t, component, i, k);
    float far = (1 - b) * at_point(t, component, i + 1, j) + b * at_point(t, component, i + 1, k);
    return (1 - a) * near + a * far;
}

void fast_tables_axis(uint32_t i_segment, size_t q, float axis[3])
{
    size_t k = q % FAST_N_GAUSSIAN; /* from 0, so that the point at the pole counts as well */
    double turn = floor(FAST_N_PICTURE * fmod(i_segment * 0.61803398874989485, 1.0)) / FAST_N_PICTURE,
           z = 1.0 - ((double)k + 0.5) / FAST_N_GAUSSIAN;
    double phi = 4.0 * M_PI * (double)(k + 1) / (1.0 + sqrt(5.0)) + 2.0 * M_PI * turn, r = sqrt(1.0 - z * z);
    axis[0] = (float)(r * cos(phi));
    axis[1] = (float)(r * sin(phi));
    axis[2] = (float)(q < FAST_N_GAUSSIAN ? z : -z);
}
