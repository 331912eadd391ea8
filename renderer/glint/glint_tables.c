#include "renderer/glint/glint_tables.h"

#include "renderer/glint/glint_window.h"

/* Tiles farther than that many standard deviations from the middle of a footprint do not count. */
#define TILE_REACH 3.0F

const struct glint_table_level *glint_tables_level(const struct glint_tables *t, const struct glint_footprint *at)
{
    const float *c = at->covariance_um2, mean = (c[0] + c[2]) / 2;
    const float off = sqrtf((c[0] - c[2]) * (c[0] - c[2]) / 4 + c[1] * c[1]);
    const float wide = sqrtf(mean + off), narrow = sqrtf(fmaxf(mean - off, 0));
    const float tile_um = t->period_um / (float)t->level[0].n_tile;
    if (wide * narrow < tile_um * tile_um) return NULL;
    /* the width in tiles is from 1 to 2, or more along a direction in which there are eight times as many */
    const float width = fmaxf(narrow, wide / 8) / tile_um;
    size_t k = 0;
    while (k + 1 < t->n_level && width >= (float)(2U << k)) k++;
    return k + 2 >= t->n_level && width >= (float)(1U << k) ? &t->level[t->n_level - 1] : &t->level[k];
}

/* The weights of tiles under a footprint. */
struct tile_weights {
    struct glint_window window;
    float inverse[3];
};

static void weights_init(struct tile_weights *w, const struct glint_tables *t, const struct glint_table_level *level,
                         const struct glint_footprint *at)
{
    const float tile_um = t->period_um / (float)level->n_tile, least = tile_um * tile_um / 4;
    const float *c = at->covariance_um2;
    /* a narrow footprint needs the middle of a tile somewhere */
    float wide[3] = {fmaxf(c[0], least), c[1], fmaxf(c[2], least)};
    if (wide[0] * wide[2] - c[1] * c[1] < least * least)
        for (int a = 0; a < 3; a += 2) wide[a] += least;
    const float det = wide[0] * wide[2] - wide[1] * wide[1];
    w->window = (struct glint_window){.reach = TILE_REACH, .tile_um = tile_um};
    for (int a = 0; a < 3; a++) w->window.covariance_um2[a] = wide[a];
    for (int a = 0; a < 2; a++)
        w->window.center_um[a] = at->center_um[a] - t->period_um * floorf(at->center_um[a] / t->period_um);
    w->inverse[0] = wide[2] / det;
    w->inverse[1] = -wide[1] / det;
    w->inverse[2] = wide[0] / det;
}

static float weight_of(const struct tile_weights *w, int64_t x, int64_t y)
{
    const float du = ((float)x + 0.5F) * w->window.tile_um - w->window.center_um[0],
                dv = ((float)y + 0.5F) * w->window.tile_um - w->window.center_um[1];
    return expf(-0.5F * (du * du * w->inverse[0] + 2 * du * dv * w->inverse[1] + dv * dv * w->inverse[2]));
}

static size_t tile_index(const struct glint_table_level *level, int64_t x, int64_t y)
{
    const int64_t mask = (int64_t)level->n_tile - 1;
    return (size_t)((y & mask) * (int64_t)level->n_tile + (x & mask));
}

/* Where a normal lies between the nodes of a table. */
struct node_place {
    size_t first; /* index of the lower node of both axes */
    float share[2];
};

static bool place_init(const struct glint_tables *t, const float half[2], struct node_place *p)
{
    size_t whole[2];
    for (int a = 0; a < 2; a++) {
        const float at = (half[a] - t->least[a]) / t->step[a];
        if (!(at >= 0 && at < (float)(t->n_node[a] - 1))) return false;
        whole[a] = (size_t)at;
        p->share[a] = at - (float)whole[a];
    }
    p->first = whole[1] * t->n_node[0] + whole[0];
    return true;
}

static float read_table(const struct glint_tables *t, const struct glint_table_level *level, size_t tile,
                        const struct node_place *p)
{
    const float *low = level->density + tile * t->n_node[0] * t->n_node[1] + p->first, *high = low + t->n_node[0];
    const float s = p->share[0], a = low[0] + s * (low[1] - low[0]), b = high[0] + s * (high[1] - high[0]);
    return a + p->share[1] * (b - a);
}

float glint_tables_density(const struct glint_tables *t, const struct glint_table_level *level,
                           const struct glint_footprint *at, const float half[2])
{
    struct node_place p;
    struct tile_weights w;
    int64_t row[2], range[2];
    float sum = 0, total = 0;
    if (!place_init(t, half, &p)) return 0;
    if (level->n_tile == 1) return read_table(t, level, 0, &p);
    weights_init(&w, t, level, at);
    glint_window_rows(&w.window, row);
    for (int64_t y = row[0]; y <= row[1]; y++) {
        if (!glint_window_row(&w.window, y, range)) continue;
        for (int64_t x = range[0]; x <= range[1]; x++) {
            const float weight = weight_of(&w, x, y);
            total += weight;
            sum += weight * read_table(t, level, tile_index(level, x, y), &p);
        }
    }
    return sum / total;
}

/* Passes over the tiles until their weights exceed `until`. Returns the sum of the weights; tile: the last one. */
static float pass_tiles(const struct tile_weights *w, const struct glint_table_level *level, float until, size_t *tile)
{
    int64_t row[2], range[2];
    float sum = 0;
    glint_window_rows(&w->window, row);
    for (int64_t y = row[0]; y <= row[1]; y++) {
        if (!glint_window_row(&w->window, y, range)) continue;
        for (int64_t x = range[0]; x <= range[1]; x++) {
            *tile = tile_index(level, x, y);
            sum += weight_of(w, x, y);
            if (sum > until) return sum;
        }
    }
    return sum;
}

/* Index of n values at which their sum exceeds u times the whole. */
static size_t pick_value(const float *value, size_t n, float u)
{
    float sum = 0;
    for (size_t k = 0; k < n; k++) sum += value[k];
    float left = u * sum;
    size_t last = 0;
    for (size_t k = 0; k < n; k++) {
        if (value[k] <= 0) continue;
        last = k;
        left -= value[k];
        if (left < 0) break;
    }
    return last;
}

/* A deviate of the density 1 - |x|. */
static float tent(float u) { return u < 0.5F ? sqrtf(2 * u) - 1 : 1 - sqrtf(2 * (1 - u)); }

void glint_tables_draw(const struct glint_tables *t, const struct glint_table_level *level,
                       const struct glint_footprint *at, const float u[GLINT_N_NUMBER], float half[2])
{
    size_t tile = 0, node[2];
    if (level->n_tile > 1) {
        struct tile_weights w;
        weights_init(&w, t, level, at);
        const float total = pass_tiles(&w, level, INFINITY, &tile);
        pass_tiles(&w, level, u[0] * total, &tile);
    }
    node[1] = pick_value(level->row + tile * t->n_node[1], t->n_node[1], u[1]);
    node[0] = pick_value(level->density + (tile * t->n_node[1] + node[1]) * t->n_node[0], t->n_node[0], u[2]);
    for (int a = 0; a < 2; a++) half[a] = t->least[a] + ((float)node[a] + tent(u[3 + a])) * t->step[a];
}
