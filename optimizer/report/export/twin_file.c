#include "optimizer/report/export/twin_result.h"
#include "renderer/mesh/mesh_drape.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Every second point of the drape's mesh is kept along both edges. */
static const double drape_size_mm = TWIN_DRAPE_SIZE_MM, drape_radius_mm = TWIN_DRAPE_RADIUS_MM;
enum { DRAPE_STEP = 2 };

struct twin_block {
    char *data;
    size_t n_byte;
};

/* Room for n more bytes; NULL without memory. */
static void *grow(struct twin_block *b, size_t n)
{
    char *data = realloc(b->data, b->n_byte + n);
    if (data == NULL) return NULL;
    b->data = data;
    b->n_byte += n;
    return data + b->n_byte - n;
}

/* Returns the nearest half float; a number that is too large becomes the largest one. */
static uint16_t half_of(float x)
{
    const float most = 65504.0f, least_normal = 0x1p-14f;
    float size = fminf(fabsf(x), most);
    int exponent;
    uint32_t bits;
    if (!(size >= least_normal))
        bits = (uint32_t)lrintf(size * 0x1p24f);
    else {
        float mantissa = frexpf(size, &exponent); /* in [1/2, 1) */
        bits = (uint32_t)(lrintf(mantissa * 2048.0f) - 1024) + (uint32_t)(exponent + 14) * 1024u;
    }
    return (uint16_t)(bits > 0x7bffu ? 0x7bffu : bits) | (signbit(x) ? 0x8000u : 0u);
}

static bool add_textures(const struct appearance_table *t, struct twin_block *b)
{
    size_t n = t->width * t->height;
    uint16_t *out = grow(b, t->n_basis * n * sizeof *out);
    if (out == NULL) return false;
    for (size_t k = 0; k < t->n_basis; k++)
        for (size_t i = 0; i < n; i++) out[(k / 4 * n + i) * 4 + k % 4] = half_of(t->weight[k * n + i]);
    return true;
}

static bool add_table(const struct appearance_table *t, struct twin_block *b)
{
    size_t v = t->view_edge, l = t->light_edge, n_light = t->n_side * l * l;
    size_t columns = v * t->n_side * l, rows = t->n_side * v * l;
    uint16_t *out = grow(b, 3 * t->n_basis * columns * rows * sizeof *out);
    if (out == NULL) return false;
    for (size_t i = 0; i < t->n_side * v * v; i++)
        for (size_t j = 0; j < n_light; j++) {
            const float *value = t->value + (i * n_light + j) * 3 * t->n_basis;
            size_t row = i / v * l + j / l % l, column = (i % v * t->n_side + j / (l * l)) * l + j % l;
            for (size_t k = 0; k < 3 * t->n_basis; k++) {
                size_t layer = k / 3 / 4 * 3 + k % 3;
                out[((layer * rows + row) * columns + column) * 4 + k / 3 % 4] = half_of(value[k]);
            }
        }
    return true;
}

static json_t *part_json(size_t offset, json_t *more)
{
    json_object_set_new(more, "offset", json_integer((json_int_t)offset));
    return more;
}

static status add_drape(const struct progress *progress, struct twin_block *b, json_t **json, struct error *err)
{
    struct mesh m = {0};
    double low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY};
    size_t offset = b->n_byte;
    status s = mesh_drape(drape_size_mm, drape_radius_mm, progress, &m, err);
    if (s != STATUS_OK) return s;
    size_t n = (size_t)lround(sqrt((double)m.n_position)), kept = (n - 1) / DRAPE_STEP + 1;
    for (size_t i = 0; i < m.n_position; i++)
        for (int a = 0; a < 3; a++) {
            low[a] = fmin(low[a], m.position_mm[i][a]);
            high[a] = fmax(high[a], m.position_mm[i][a]);
        }
    uint16_t *out = grow(b, kept * kept * 3 * sizeof *out);
    for (size_t i = 0; i < kept * kept && out != NULL; i++) {
        const double *p = m.position_mm[i / kept * DRAPE_STEP * n + i % kept * DRAPE_STEP];
        for (int a = 0; a < 3; a++)
            out[3 * i + (size_t)a] = (uint16_t)lround(65535.0 * (p[a] - low[a]) / (high[a] - low[a]));
    }
    mesh_release(&m);
    if (out == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot write the twin: out of memory");
    *json = part_json(offset, json_pack("{s:I, s:f, s:f, s:[f, f, f], s:[f, f, f]}", "points", (json_int_t)kept,
                                        "size_mm", drape_size_mm, "radius_mm", drape_radius_mm, "low", low[0], low[1],
                                        low[2], "high", high[0], high[1], high[2]));
    return STATUS_OK;
}

static bool add_lobes(const struct near_fibers *f, struct twin_block *b)
{
    const size_t n = f->n_set * NEAR_LOBE_CELLS;
    uint16_t *out = grow(b, 4 * n * sizeof *out);
    for (size_t i = 0; i < n && out != NULL; i++) {
        for (size_t c = 0; c < 3; c++) out[4 * i + c] = half_of(f->lobe[3 * i + c]);
        out[4 * i + 3] = 0;
    }
    return out != NULL;
}

static void find_bounds(const struct near_fibers *f, double low[3], double high[3], double *radius_mm)
{
    *radius_mm = 0.0;
    for (int a = 0; a < 3; a++) {
        low[a] = INFINITY;
        high[a] = -INFINITY;
    }
    for (size_t i = 0; i < f->n_point; i++) {
        *radius_mm = fmax(*radius_mm, (double)f->point[i].radius_mm);
        for (int a = 0; a < 3; a++) {
            low[a] = fmin(low[a], (double)f->point[i].position_mm[a]);
            high[a] = fmax(high[a], (double)f->point[i].position_mm[a]);
        }
    }
}

static uint32_t step_of(double x, double low, double high)
{
    return high > low ? (uint32_t)lround(65535.0 * (x - low) / (high - low)) : 0;
}

/* Adds both parts of the fibers to json; no part without fibers. */
static bool add_fibers(const struct near_fibers *f, struct twin_block *b, json_t *json)
{
    double low[3], high[3], radius_mm;
    if (f->n_point == 0) return true;
    const size_t lobes_at = b->n_byte, fibers_at = lobes_at + 8 * f->n_set * NEAR_LOBE_CELLS;
    find_bounds(f, low, high, &radius_mm);
    uint32_t *out = add_lobes(f, b) ? grow(b, 8 * f->n_point * sizeof *out) : NULL;
    for (size_t i = 0; i < f->n_point && out != NULL; i++, out += 8) {
        const struct near_point *p = &f->point[i];
        uint32_t at[3];
        for (int a = 0; a < 3; a++) at[a] = step_of((double)p->position_mm[a], low[a], high[a]);
        out[0] = at[0] | at[1] << 16;
        out[1] = at[2] | step_of((double)p->radius_mm, 0.0, radius_mm) << 16;
        out[2] = p->i_set | (p->is_last ? 1U << 31 : 0U);
        out[3] = 0;
        for (int k = 0; k < 4; k++) out[4 + k] = (uint32_t)(p->open[k / 2] >> (k % 2 * 32));
    }
    if (out == NULL) return false;
    json_object_set_new(
        json, "lobes",
        part_json(lobes_at, json_pack("{s:I, s:i, s:i, s:i}", "sets", (json_int_t)f->n_set, "azimuth",
                                      NEAR_LOBE_AZIMUTH, "difference", NEAR_LOBE_DIFFERENCE, "half", NEAR_LOBE_HALF)));
    json_object_set_new(json, "fibers",
                        part_json(fibers_at, json_pack("{s:I, s:f, s:[f, f, f], s:[f, f, f]}", "points",
                                                       (json_int_t)f->n_point, "radius_mm", radius_mm, "low", low[0],
                                                       low[1], low[2], "high", high[0], high[1], high[2])));
    return true;
}

static json_t *tables_json(const struct appearance_table *t, size_t textures_at, size_t table_at)
{
    return json_pack(
        "{s:o, s:o}", "textures",
        part_json(textures_at, json_pack("{s:I, s:I, s:I}", "n", (json_int_t)t->n_basis, "width", (json_int_t)t->width,
                                         "height", (json_int_t)t->height)),
        "table",
        part_json(table_at, json_pack("{s:I, s:I, s:I}", "view_edge", (json_int_t)t->view_edge, "light_edge",
                                      (json_int_t)t->light_edge, "sides", (json_int_t)t->n_side)));
}

status twin_file_make(const struct appearance_table *t, const struct near_fibers *f, const struct progress *progress,
                      char **block, size_t *n_byte, json_t **parts, struct error *err)
{
    struct twin_block b = {0};
    json_t *drape = NULL, *json = NULL;
    status s = add_drape(progress, &b, &drape, err);
    const size_t over = b.n_byte % 8, textures_at = b.n_byte + (8 - over) % 8;
    if (over > 0 && s == STATUS_OK) {
        char *room = grow(&b, 8 - over); /* numbers of 4 bytes follow, too */
        if (room != NULL) memset(room, 0, 8 - over);
    }
    bool made = s == STATUS_OK && b.n_byte == textures_at && add_textures(t, &b);
    const size_t table_at = b.n_byte;
    made = made && add_table(t, &b);
    json = made ? tables_json(t, textures_at, table_at) : NULL;
    if (s == STATUS_OK && (json == NULL || !add_fibers(f, &b, json)))
        s = error_set(err, STATUS_NO_MEMORY, "cannot write the twin: out of memory");
    if (s != STATUS_OK) {
        free(b.data);
        json_decref(drape);
        json_decref(json);
        return s;
    }
    json_object_set_new(json, "drape", drape);
    *parts = json;
    *block = b.data;
    *n_byte = b.n_byte;
    return STATUS_OK;
}
