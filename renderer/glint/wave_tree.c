#include "renderer/glint/wave_tree.h"

#include "renderer/glint/wave_lanes.h"

#include <stdlib.h>
#include <string.h>

/* of the window, in its standard deviations */
#define WINDOW_REACH 3.0

static void add_range(struct wave_range *to, const struct wave_range *r)
{
    to->low_u = fminf(to->low_u, r->low_u);
    to->high_u = fmaxf(to->high_u, r->high_u);
    to->low_v = fminf(to->low_v, r->low_v);
    to->high_v = fmaxf(to->high_v, r->high_v);
    to->most2 = fmaxf(to->most2, r->most2);
}

static const struct wave_range no_range = {INFINITY, -INFINITY, INFINITY, -INFINITY, 0};

static void fill_leaf(struct wave_tree *t, const struct wave_height *h, size_t i, size_t j)
{
    const size_t n_leaf = t->n / WAVE_LEAF, stride = h->n / t->n;
    struct wave_range *range = &t->range[0][j * n_leaf + i];
    *range = no_range;
    for (size_t r = 0; r < WAVE_LEAF; r++) {
        struct wave_row *row = &t->row[(j * n_leaf + i) * WAVE_LEAF + r];
        for (size_t l = 0; l < LANES; l++) {
            const size_t at = ((j * WAVE_LEAF + r) * h->n + i * WAVE_LEAF + l) * stride;
            row->height_um[l] = h->height_um[at];
            row->slope_u[l] = h->slope_u[at];
            row->slope_v[l] = h->slope_v[at];
            const float uu = h->curve_uu != NULL ? h->curve_uu[at] : 0, uv = h->curve_uu != NULL ? h->curve_uv[at] : 0,
                        vv = h->curve_uu != NULL ? h->curve_vv[at] : 0;
            row->curve_uu[l] = uu;
            row->curve_uv[l] = uv;
            row->curve_vv[l] = vv;
            row->third2[l] = h->curve_uu != NULL ? h->third2[at] * powf(0.5F * t->step_um, 6) : 0;
            const float most = 0.5F * fabsf(uu + vv) + sqrtf(0.25F * (uu - vv) * (uu - vv) + uv * uv);
            row->most2[l] = most * most;
            const struct wave_range one = {row->slope_u[l], row->slope_u[l], row->slope_v[l], row->slope_v[l],
                                           row->most2[l]};
            add_range(range, &one);
        }
    }
}

static void fill_level(struct wave_tree *t, size_t level)
{
    const size_t side = t->n / WAVE_LEAF >> level;
    for (size_t j = 0; j < side; j++)
        for (size_t i = 0; i < side; i++) {
            struct wave_range *range = &t->range[level][j * side + i];
            *range = no_range;
            for (size_t k = 0; k < 4; k++)
                add_range(range, &t->range[level - 1][(2 * j + k / 2) * 2 * side + 2 * i + k % 2]);
        }
}

status wave_tree_init(struct wave_tree *t, const struct wave_height *h, size_t stride, struct error *err)
{
    const size_t n_leaf = h->n / stride / WAVE_LEAF;
    *t = (struct wave_tree){.n = h->n / stride,
                            .step_um = h->texel_um * (float)stride,
                            .first_um = 0.5F * h->texel_um,
                            .is_curved = h->curve_uu != NULL};
    t->row = malloc(n_leaf * n_leaf * WAVE_LEAF * sizeof *t->row);
    bool whole = t->row != NULL;
    for (size_t side = n_leaf; side > 0; side /= 2) {
        struct wave_range *range = malloc(side * side * sizeof *range);
        t->range[t->n_level++] = range;
        whole &= range != NULL;
    }
    if (!whole) {
        wave_tree_release(t);
        return error_set(err, STATUS_NO_MEMORY, "cannot make Gabor kernels: out of memory");
    }
    for (size_t j = 0; j < n_leaf; j++)
        for (size_t i = 0; i < n_leaf; i++) fill_leaf(t, h, i, j);
    for (size_t level = 1; level < t->n_level; level++) fill_level(t, level);
    return STATUS_OK;
}

void wave_tree_release(struct wave_tree *t)
{
    free(t->row);
    for (size_t i = 0; i < t->n_level; i++) free(t->range[i]);
    *t = (struct wave_tree){0};
}

/* Distance of 0 from an interval. */
static float off_interval(float low, float high) { return fmaxf(fmaxf(low, -high), 0); }

/* Returns whether a node can hold a kernel that reaches the direction: the least |xi_3 H' + psi| over its slopes. */
static bool reaches(const struct wave_range *r, const struct wave_direction *d)
{
    const float u = off_interval(d->xi_3 * r->low_u + d->psi[0], d->xi_3 * r->high_u + d->psi[0]),
                v = off_interval(d->xi_3 * r->low_v + d->psi[1], d->xi_3 * r->high_v + d->psi[1]);
    return u * u + v * v <= d->reach2 + d->widening * r->most2;
}

/* A query: the middle of the window and its radius, in distances of kernels from kernel 0. */
struct gathering {
    const struct wave_tree *t;
    const struct wave_direction *d;
    struct wave_gathered *to;
    size_t n;                         /* kernels so far */
    float center[2], radius, per_sd2; /* per_sd2: 1 / (2 sd^2) */
};

/* Returns whether the square of kernels from (i, j) meets the window. */
static bool is_near(const struct gathering *g, long i, long j, long side)
{
    const float u = off_interval((float)i - g->center[0], (float)(i + side - 1) - g->center[0]),
                v = off_interval((float)j - g->center[1], (float)(j + side - 1) - g->center[1]);
    return u * u + v * v <= g->radius * g->radius;
}

/* Appends the lanes of `in`, a bit each, to a column of n numbers. */
static inline void append(lanes *column, size_t n, unsigned in, lanes value)
{
    float *to = (float *)column + n;
    if (in == (1U << LANES) - 1)
        *(lanes *)to = value;
    else
        for (; in != 0; in &= in - 1) *to++ = value[__builtin_ctz(in)];
}

static void gather_leaf(struct gathering *g, size_t i_leaf, long i, long j)
{
    const struct wave_direction *d = g->d;
    const float step = g->t->step_um;
    lanes u;
    for (int l = 0; l < LANES; l++) u[l] = (float)(i + l) - g->center[0];
    for (long r = 0; r < WAVE_LEAF; r++) {
        const struct wave_row *row = &g->t->row[i_leaf * WAVE_LEAF + (size_t)r];
        const float v = (float)(j + r) - g->center[1];
        const lanes a = d->xi_3 * row->slope_u + d->psi[0], b = d->xi_3 * row->slope_v + d->psi[1];
        const lanes bend = a * a + b * b, off2 = u * u + v * v;
        const lane_mask in =
            (lane_mask)(bend <= d->reach2 + d->widening * row->most2) & (lane_mask)(off2 <= g->radius * g->radius);
        const unsigned bits = lanes_bits(in);
        if (bits == 0) continue;
        struct wave_gathered *to = g->to;
        const size_t n = g->n;
        g->n += (size_t)__builtin_popcount(bits);
        append(to->path_um, n, bits, d->xi_3 * row->height_um + (d->psi[0] * u + d->psi[1] * v) * step);
        append(to->bend, n, bits, bend);
        append(to->weight, n, bits, lanes_exp_negative(-off2 * g->per_sd2));
        append(to->tilt, n, bits, d->psi[0] * row->slope_u + d->psi[1] * row->slope_v);
        if (g->t->is_curved) {
            const lanes uu = d->xi_3 * row->curve_uu, uv = d->xi_3 * row->curve_uv, vv = d->xi_3 * row->curve_vv;
            append(to->trace, n, bits, uu + vv);
            append(to->det, n, bits, uu * vv - uv * uv);
            append(to->third2, n, bits, d->xi_3 * d->xi_3 * row->third2);
            append(to->across, n, bits, a * a * vv - 2 * a * b * uv + b * b * uu);
        }
    }
}

/* Node of a level whose first kernel is (i, j); these run on beyond the tile, which repeats. */
static void gather_node(struct gathering *g, size_t level, long i, long j)
{
    const long side = (long)WAVE_LEAF << level;
    const size_t n_side = g->t->n / WAVE_LEAF >> level, mask = n_side - 1;
    const size_t at = ((size_t)(j / side) & mask) * n_side + ((size_t)(i / side) & mask);
    if (!is_near(g, i, j, side) || !reaches(&g->t->range[level][at], g->d)) return;
    if (level == 0) {
        gather_leaf(g, at, i, j);
        return;
    }
    for (long k = 0; k < 4; k++) gather_node(g, level - 1, i + k % 2 * (side / 2), j + k / 2 * (side / 2));
}

/* Place in the tile, in distances of kernels from kernel 0. */
static double in_tile(double place_um, const struct wave_tree *t)
{
    const double side = (double)t->n, x = (place_um - (double)t->first_um) / (double)t->step_um;
    return x - side * floor(x / side);
}

void wave_tree_gather(const struct wave_tree *t, const struct wave_window *w, const struct wave_direction *d,
                      struct wave_gathered *to)
{
    const double sd = w->sd_um / (double)t->step_um;
    struct gathering g = {t, d, to, .radius = (float)(WINDOW_REACH * sd), .per_sd2 = (float)(1 / (2 * sd * sd))};
    size_t level = 0;
    long first[2];
    while (level + 1 < t->n_level && (float)((long)WAVE_LEAF << level) < 2 * g.radius) level++;
    const long side = (long)WAVE_LEAF << level;
    for (int k = 0; k < 2; k++) {
        g.center[k] = (float)in_tile(w->center_um[k], t) + (float)t->n; /* nothing before kernel 0 */
        first[k] = ((long)(g.center[k] - g.radius)) / side * side;
    }
    for (long j = first[1]; (float)j <= g.center[1] + g.radius; j += side)
        for (long i = first[0]; (float)i <= g.center[0] + g.radius; i += side) gather_node(&g, level, i, j);
    to->n = (g.n + LANES - 1) / LANES;
    lanes *const column[] = {to->path_um, to->bend, to->weight, to->tilt, to->trace, to->det, to->across, to->third2};
    for (size_t k = 0; k < sizeof column / sizeof *column; k++) *(lanes *)((float *)column[k] + g.n) = (lanes){0};
}

void wave_tree_slope(const struct wave_tree *t, const double place_um[2], float slope[2])
{
    const size_t mask = t->n - 1, i = (size_t)(in_tile(place_um[0], t) + 0.5) & mask,
                 j = (size_t)(in_tile(place_um[1], t) + 0.5) & mask;
    const size_t leaf = j / WAVE_LEAF * (t->n / WAVE_LEAF) + i / WAVE_LEAF;
    const struct wave_row *row = &t->row[leaf * WAVE_LEAF + j % WAVE_LEAF];
    slope[0] = row->slope_u[i % LANES];
    slope[1] = row->slope_v[i % LANES];
}
