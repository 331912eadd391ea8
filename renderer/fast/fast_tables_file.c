/* The file of the tables: a header, the arrays one after the other, and the CRC-32 of all before it. Little-endian, as
 * all machines are that Selvedge runs on. Transfer is stored as 16-bit numbers with one scale per cell. */
#include "base/files/durable.h"
#include "renderer/fast/fast_tables.h"
#include "renderer/fast/sphere_harmonics.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <zlib.h>

static const char magic[8] = "SELVFAST";
enum { VERSION = 6, MOST_BYTES = 1 << 30, MOST_CELL = 1 << 22, MOST_SET = 64, MOST_SEGMENT = 1 << 28 };

struct header {
    char magic[8];
    uint32_t version, header_bytes;
    uint64_t checksum;
    double tile_mm[2], bottom_mm, mean_free_path_mm, spread_mm;
    uint32_t order, mirrored, n_set, n_cell[3], n_transfer, n_segment, n_row;
    float transfer_error;
    uint32_t n_theta, n_component, n_gaussian, n_grid;
    uint32_t deep_traced, deep_edge, deep_side;
    float deep_error, deep_spread_mm, deep_back[3], deep_through[3];
    uint32_t unused;
};

_Static_assert(sizeof(struct header) == 168, "renderer/fast/NOTES.md states the layout");

/* An array of the file. */
struct part {
    void *data;
    size_t n_bytes;
};

enum { N_PART = 11 };

/* scaled and scale hold the transfer as it is in the file. */
static void list_parts(const struct fast_tables *t, int16_t *scaled, float *scale, struct part part[N_PART])
{
    size_t n = fast_n_harmonic(t), n_number = t->n_transfer * 3 * n * n;
    const struct part all[N_PART] = {
        {t->cell, fast_n_cell(t) * sizeof *t->cell},
        {scale, t->n_transfer * sizeof *scale},
        {scaled, n_number * sizeof *scaled},
        {t->scatter, (size_t)t->n_set * FAST_N_THETA * 3 * n * sizeof *t->scatter},
        {t->segment_row, (size_t)t->n_segment * sizeof *t->segment_row},
        {t->basis, sizeof *t->basis * FAST_N_GRID * FAST_N_GRID * (1 + FAST_N_COMPONENT)},
        {t->component_scale, sizeof *t->component_scale * FAST_N_COMPONENT},
        {t->component, (size_t)t->n_row * FAST_N_COMPONENT},
        {t->gaussian, (size_t)t->n_row * 2 * FAST_N_GAUSSIAN},
        {t->deep.value, deep_light_n_value(&t->deep) * sizeof *t->deep.value},
        {t->deep.shift, deep_light_n_shift(&t->deep) * sizeof *t->deep.shift},
    };
    memcpy(part, all, sizeof all);
}

static size_t bytes_of(const struct fast_tables *t)
{
    struct part part[N_PART];
    size_t n = sizeof(struct header) + sizeof(uint32_t);
    list_parts(t, NULL, NULL, part);
    for (int i = 0; i < N_PART; i++) n += part[i].n_bytes;
    return n;
}

static void pack_transfer(const struct fast_tables *t, int16_t *scaled, float *scale)
{
    size_t n = (size_t)fast_n_harmonic(t) * fast_n_harmonic(t) * 3;
    for (size_t i = 0; i < t->n_transfer; i++) {
        float most = 0;
        for (size_t k = 0; k < n; k++) most = fmaxf(most, fabsf(t->transfer[i * n + k]));
        scale[i] = most / 32767;
        float inv = most > 0 ? 32767 / most : 0;
        for (size_t k = 0; k < n; k++) scaled[i * n + k] = (int16_t)lrintf(t->transfer[i * n + k] * inv);
    }
}

static void unpack_transfer(struct fast_tables *t, const int16_t *scaled, const float *scale)
{
    size_t n = (size_t)fast_n_harmonic(t) * fast_n_harmonic(t) * 3;
    for (size_t i = 0; i < t->n_transfer; i++)
        for (size_t k = 0; k < n; k++) t->transfer[i * n + k] = scale[i] * (float)scaled[i * n + k];
}

static void fill_header(const struct fast_tables *t, struct header *h)
{
    memset(h, 0, sizeof *h);
    *h = (struct header){.version = VERSION,
                         .header_bytes = sizeof *h,
                         .checksum = t->checksum,
                         .tile_mm = {t->tile_mm[0], t->tile_mm[1]},
                         .bottom_mm = t->bottom_mm,
                         .mean_free_path_mm = t->mean_free_path_mm,
                         .spread_mm = t->spread_mm,
                         .order = t->order,
                         .mirrored = t->mirrored,
                         .n_set = t->n_set,
                         .n_cell = {t->n_cell[0], t->n_cell[1], t->n_cell[2]},
                         .n_transfer = t->n_transfer,
                         .n_segment = t->n_segment,
                         .n_row = t->n_row,
                         .transfer_error = t->transfer_error,
                         .n_theta = FAST_N_THETA,
                         .n_component = FAST_N_COMPONENT,
                         .n_gaussian = FAST_N_GAUSSIAN,
                         .n_grid = FAST_N_GRID,
                         .deep_traced = t->deep.n_traced,
                         .deep_edge = t->deep.edge,
                         .deep_side = t->deep.n_side,
                         .deep_error = t->deep.error,
                         .deep_spread_mm = t->deep.spread_mm};
    memcpy(h->deep_back, t->deep.back, sizeof h->deep_back);
    memcpy(h->deep_through, t->deep.through, sizeof h->deep_through);
    memcpy(h->magic, magic, sizeof magic);
}

status fast_tables_write(const struct fast_tables *t, const char *path, struct error *err)
{
    size_t n_number = (size_t)t->n_transfer * 3 * fast_n_harmonic(t) * fast_n_harmonic(t), n_bytes = bytes_of(t);
    int16_t *scaled = malloc((n_number + 1) * sizeof *scaled);
    float *scale = malloc((t->n_transfer + 1) * sizeof *scale);
    char *text = malloc(n_bytes), *to = text;
    status s = STATUS_OK;
    if (scaled == NULL || scale == NULL || text == NULL) {
        s = error_set(err, STATUS_NO_MEMORY, "cannot write '%s': out of memory", path_file_name(path));
        goto out;
    }
    struct header h;
    struct part part[N_PART];
    fill_header(t, &h);
    pack_transfer(t, scaled, scale);
    list_parts(t, scaled, scale, part);
    memcpy(to, &h, sizeof h);
    to += sizeof h;
    for (int i = 0; i < N_PART; i++) {
        memcpy(to, part[i].data, part[i].n_bytes);
        to += part[i].n_bytes;
    }
    uint32_t crc = (uint32_t)crc32_z(0, (const unsigned char *)text, n_bytes - sizeof crc);
    memcpy(to, &crc, sizeof crc);
    s = durable_replace(path, text, n_bytes, err);
out:
    free(scaled);
    free(scale);
    free(text);
    return s;
}

/* Shares sum to at most 1 but for the noise of the paths. */
static bool are_shares(const struct header *h)
{
    bool sane = true;
    for (int c = 0; c < 3; c++)
        sane = sane && h->deep_back[c] >= 0 && h->deep_through[c] >= 0 && h->deep_back[c] + h->deep_through[c] < 2;
    return sane;
}

static status check_header(const struct header *h, const char *name, struct error *err)
{
    if (memcmp(h->magic, magic, sizeof magic) != 0)
        return error_set(err, STATUS_FORMAT, "cannot read tables '%s': it does not begin with SELVFAST", name);
    if (h->version != VERSION || h->header_bytes != sizeof *h)
        return error_set(err, STATUS_FORMAT,
                         "cannot read tables '%s': it has version %u, this program reads version %d", name, h->version,
                         VERSION);
    uint64_t n_cell = (uint64_t)h->n_cell[0] * h->n_cell[1];
    bool cells = h->n_cell[0] > 0 && h->n_cell[1] > 0 && h->n_cell[2] > 0 && h->n_cell[2] <= MOST_CELL &&
                 n_cell <= MOST_CELL && n_cell * h->n_cell[2] <= MOST_CELL;
    if (!cells || h->order > SPHERE_MAX_ORDER || h->n_set == 0 || h->n_set > MOST_SET || h->n_transfer > MOST_CELL ||
        h->n_segment > MOST_SEGMENT || h->n_row > h->n_segment || h->n_theta != FAST_N_THETA ||
        h->n_component != FAST_N_COMPONENT || h->n_gaussian != FAST_N_GAUSSIAN || h->n_grid != FAST_N_GRID ||
        h->deep_edge < 2 || h->deep_edge > DEEP_LIGHT_MOST_EDGE || h->deep_side == 0 || h->deep_side > 2 ||
        h->mirrored > 1 || !(h->tile_mm[0] > 0.0) || !(h->tile_mm[1] > 0.0) || !(h->bottom_mm < 0.0) || !are_shares(h))
        return error_set(err, STATUS_FORMAT, "cannot read tables '%s': its header has counts that make no sense", name);
    return STATUS_OK;
}

static void take_header(struct fast_tables *t, const struct header *h)
{
    *t = (struct fast_tables){.checksum = h->checksum,
                              .tile_mm = {h->tile_mm[0], h->tile_mm[1]},
                              .bottom_mm = h->bottom_mm,
                              .mean_free_path_mm = h->mean_free_path_mm,
                              .spread_mm = h->spread_mm,
                              .order = h->order,
                              .mirrored = h->mirrored,
                              .n_set = h->n_set,
                              .n_cell = {h->n_cell[0], h->n_cell[1], h->n_cell[2]},
                              .n_transfer = h->n_transfer,
                              .n_segment = h->n_segment,
                              .n_row = h->n_row,
                              .transfer_error = h->transfer_error,
                              .deep = {.n_traced = h->deep_traced,
                                       .edge = h->deep_edge,
                                       .n_side = h->deep_side,
                                       .error = h->deep_error,
                                       .spread_mm = h->deep_spread_mm}};
    memcpy(t->deep.back, h->deep_back, sizeof t->deep.back);
    memcpy(t->deep.through, h->deep_through, sizeof t->deep.through);
}

/* Rows that tables point to must exist, whatever a file says. */
static bool rows_exist(const struct fast_tables *t)
{
    for (size_t i = 0; i < fast_n_cell(t); i++)
        if (t->cell[i] != FAST_NO_ROW && t->cell[i] >= t->n_transfer) return false;
    for (size_t i = 0; i < t->n_segment; i++)
        if (t->segment_row[i] != FAST_NO_ROW && t->segment_row[i] >= t->n_row) return false;
    return true;
}

static status take_parts(struct fast_tables *t, const char *from, struct error *err)
{
    size_t n_number = (size_t)t->n_transfer * 3 * fast_n_harmonic(t) * fast_n_harmonic(t);
    int16_t *scaled = malloc((n_number + 1) * sizeof *scaled);
    float *scale = malloc((t->n_transfer + 1) * sizeof *scale);
    status s = scaled != NULL && scale != NULL ? STATUS_OK
                                               : error_set(err, STATUS_NO_MEMORY, "cannot read tables: out of memory");
    if (s == STATUS_OK) s = fast_tables_reserve_cells(t, err);
    if (s == STATUS_OK) s = fast_tables_reserve_transfer(t, err);
    if (s == STATUS_OK) s = fast_tables_reserve_scatter(t, err);
    if (s == STATUS_OK) s = fast_tables_reserve_segments(t, err);
    if (s == STATUS_OK) s = fast_tables_reserve_rows(t, err);
    if (s == STATUS_OK) s = fast_tables_reserve_deep(t, err);
    if (s == STATUS_OK) {
        struct part part[N_PART];
        list_parts(t, scaled, scale, part);
        for (int i = 0; i < N_PART; i++) {
            memcpy(part[i].data, from, part[i].n_bytes);
            from += part[i].n_bytes;
        }
        unpack_transfer(t, scaled, scale);
    }
    free(scaled);
    free(scale);
    return s;
}

status fast_tables_read(struct fast_tables *t, const char *path, struct error *err)
{
    char *text = NULL;
    size_t n_bytes = 0;
    const char *name = path_file_name(path);
    struct header h;
    uint32_t crc = 0;
    *t = (struct fast_tables){0};
    status s = file_read_all(path, MOST_BYTES, &text, &n_bytes, err);
    if (s != STATUS_OK) return s;
    if (n_bytes < sizeof h + sizeof crc)
        s = error_set(err, STATUS_FORMAT, "cannot read tables '%s': it has %zu bytes only", name, n_bytes);
    if (s == STATUS_OK) {
        memcpy(&h, text, sizeof h);
        s = check_header(&h, name, err);
    }
    if (s == STATUS_OK) {
        take_header(t, &h);
        memcpy(&crc, text + n_bytes - sizeof crc, sizeof crc);
        if (bytes_of(t) != n_bytes)
            s = error_set(err, STATUS_FORMAT, "cannot read tables '%s': it has %zu bytes, its header asks for %zu",
                          name, n_bytes, bytes_of(t));
        else if ((uint32_t)crc32_z(0, (const unsigned char *)text, n_bytes - sizeof crc) != crc)
            s = error_set(err, STATUS_CHECKSUM, "cannot read tables '%s': its checksum is wrong", name);
    }
    if (s == STATUS_OK) s = take_parts(t, text + sizeof h, err);
    if (s == STATUS_OK && !rows_exist(t))
        s = error_set(err, STATUS_FORMAT, "cannot read tables '%s': it points to rows that it does not have", name);
    free(text);
    if (s != STATUS_OK) fast_tables_release(t);
    return s;
}
