/* Decodes the slices of a TIFF volume: strips, tiles, and samples that no page describes. */
#include "base/files/durable.h"
#include "base/option_id.h"
#include "geometry/volume/format/tiff_volume.h"

#include <stdlib.h>
#include <unistd.h>

static status reserve_block(struct tiff_stack *h, uint64_t n_byte, struct error *err)
{
    if (n_byte <= h->block_bytes) return STATUS_OK;
    void *bigger = n_byte < (uint64_t)1 << 40 ? realloc(h->block, (size_t)n_byte) : NULL;
    if (bigger == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot read volume: out of memory");
    h->block = bigger;
    h->block_bytes = (size_t)n_byte;
    return STATUS_OK;
}

static status block_error(struct tiff_stack *h, size_t i_slice, struct error *err)
{
    return error_set_field(err, STATUS_FORMAT, OPTION_SCAN_FILES, "cannot read volume '%s': page %zu is damaged: %s",
                           path_file_name(h->path[h->i_open]), i_slice + 1, tiff_stack_cause(h));
}

/* Samples of a pixel that lie beside one another: 1 where every sample has strips and tiles of its own. */
static size_t n_beside(const struct tiff_page *p) { return p->is_separate ? 1 : p->n_sample; }

/* Converts n samples that begin at block; those of one channel of pixels that hold several. */
static void convert(const struct tiff_stack *h, size_t n, uint8_t *block, float *value)
{
    const size_t bytes = sample_bytes(h->first.sample), beside = n_beside(&h->first);
    for (size_t i = 0; beside > 1 && i < n; i++)
        for (size_t b = 0; b < bytes; b++) block[i * bytes + b] = block[(i * beside + h->i_sample) * bytes + b];
    sample_to_float(h->first.sample, false, n, block, value);
}

static uint16_t plane_of(const struct tiff_stack *h) { return h->first.is_separate ? (uint16_t)h->i_sample : 0; }

static status read_strips(struct tiff_stack *h, size_t i_slice, float *value, struct error *err)
{
    const uint32_t width = h->first.width, height = h->first.height;
    uint32_t rows = height;
    TIFFGetFieldDefaulted(h->tiff, TIFFTAG_ROWSPERSTRIP, &rows);
    if (rows == 0 || rows > height) rows = height;
    const size_t row_bytes = width * sample_bytes(h->first.sample) * n_beside(&h->first);
    status s = reserve_block(h, (uint64_t)row_bytes * rows, err);
    if (s != STATUS_OK) return s;
    for (uint32_t y = 0; y < height; y += rows) {
        const uint32_t n_row = y + rows <= height ? rows : height - y;
        const tmsize_t want = (tmsize_t)(row_bytes * n_row);
        if (TIFFReadEncodedStrip(h->tiff, TIFFComputeStrip(h->tiff, y, plane_of(h)), h->block, want) != want)
            return block_error(h, i_slice, err);
        convert(h, (size_t)n_row * width, h->block, value + (size_t)y * width);
    }
    return STATUS_OK;
}

/* Reads a tile to h->block. libtiff does not count the slices of a tile, so those are decoded from its stored bytes. */
static status read_tile(struct tiff_stack *h, uint32_t i_tile, size_t n_byte, size_t i_slice, struct error *err)
{
    const tmsize_t want = (tmsize_t)n_byte, n_stored = (tmsize_t)TIFFGetStrileByteCount(h->tiff, i_tile);
    if (h->first.depth == 1)
        return TIFFReadEncodedTile(h->tiff, i_tile, h->block, want) == want ? STATUS_OK : block_error(h, i_slice, err);
    void *stored = n_stored > 0 ? malloc((size_t)n_stored) : NULL;
    const bool done = stored != NULL && TIFFReadRawTile(h->tiff, i_tile, stored, n_stored) == n_stored &&
                      TIFFReadFromUserBuffer(h->tiff, i_tile, stored, n_stored, h->block, want) != 0;
    free(stored);
    return done ? STATUS_OK : block_error(h, i_slice, err);
}

static status read_tiles(struct tiff_stack *h, size_t i_slice, float *value, struct error *err)
{
    const uint32_t width = h->first.width, height = h->first.height, z = h->slice[i_slice].depth;
    uint32_t tw = 0, th = 0, td = 1;
    TIFFGetField(h->tiff, TIFFTAG_TILEWIDTH, &tw);
    TIFFGetField(h->tiff, TIFFTAG_TILELENGTH, &th);
    TIFFGetFieldDefaulted(h->tiff, TIFFTAG_TILEDEPTH, &td);
    if (tw == 0 || th == 0 || td == 0 || tw > width + 4096u || th > height + 4096u || td > h->first.depth + 4096u)
        return block_error(h, i_slice, err);
    const size_t row_bytes = tw * sample_bytes(h->first.sample) * n_beside(&h->first);
    status s = reserve_block(h, (uint64_t)row_bytes * th * td, err);
    if (s != STATUS_OK) return s;
    for (uint32_t y = 0; y < height; y += th)
        for (uint32_t x = 0; x < width; x += tw) {
            s = read_tile(h, TIFFComputeTile(h->tiff, x, y, z, plane_of(h)), row_bytes * th * td, i_slice, err);
            if (s != STATUS_OK) return s;
            const size_t n = x + tw <= width ? tw : width - x;
            uint8_t *of_slice = (uint8_t *)h->block + row_bytes * th * (z % td);
            for (uint32_t r = 0; r < th && y + r < height; r++)
                convert(h, n, of_slice + row_bytes * r, value + (size_t)(y + r) * width + x);
        }
    return STATUS_OK;
}

static status read_bare(struct tiff_stack *h, size_t i_slice, float *value, struct error *err)
{
    const size_t n_byte = (size_t)tiff_page_bytes(&h->first);
    status s = reserve_block(h, n_byte, err);
    for (size_t done = 0; s == STATUS_OK && done < n_byte;) {
        const ssize_t n = pread(TIFFFileno(h->tiff), (char *)h->block + done, n_byte - done,
                                (off_t)(h->slice[i_slice].offset + done));
        if (n <= 0) return block_error(h, i_slice, err);
        done += (size_t)n;
    }
    if (s == STATUS_OK)
        sample_to_float(h->first.sample, TIFFIsByteSwapped(h->tiff) != 0, (size_t)h->first.width * h->first.height,
                        h->block, value);
    return s;
}

static status read_page(struct tiff_stack *h, size_t i, float *value, struct error *err)
{
    if (!TIFFSetSubDirectory(h->tiff, h->slice[i].offset)) return block_error(h, i, err);
    struct tiff_page p; /* the file may have changed since it was opened */
    status s = tiff_page_read(h->tiff, path_file_name(h->path[h->i_open]), i + 1, &p, err);
    if (s != STATUS_OK) return s;
    if (p.width != h->first.width || p.height != h->first.height || p.depth != h->first.depth ||
        p.sample != h->first.sample || p.n_sample != h->first.n_sample || p.is_separate != h->first.is_separate)
        return block_error(h, i, err);
    return TIFFIsTiled(h->tiff) ? read_tiles(h, i, value, err) : read_strips(h, i, value, err);
}

/* Copies a stored page to the page that is seen: orientation is the value of the tag, 2 to 8. */
static void turn(const struct tiff_page *p, const float *stored, float *seen)
{
    const size_t w = p->width, n[2] = {w, p->height};
    const bool transposed = p->orientation >= ORIENTATION_LEFTTOP;
    /* in the seen page: whether columns and rows run against the stored ones */
    static const bool against[9][2] = {[ORIENTATION_TOPRIGHT] = {true, false}, [ORIENTATION_BOTRIGHT] = {true, true},
                                       [ORIENTATION_BOTLEFT] = {false, true},  [ORIENTATION_RIGHTTOP] = {true, false},
                                       [ORIENTATION_RIGHTBOT] = {true, true},  [ORIENTATION_LEFTBOT] = {false, true}};
    const size_t columns = n[transposed], rows = n[!transposed];
    for (size_t y = 0; y < rows; y++)
        for (size_t x = 0; x < columns; x++) {
            const size_t a = against[p->orientation][0] ? columns - 1 - x : x,
                         b = against[p->orientation][1] ? rows - 1 - y : y;
            seen[y * columns + x] = stored[transposed ? a * w + b : b * w + a];
        }
}

status tiff_stack_read(struct tiff_stack *h, size_t i, float *value, struct error *err)
{
    status s = tiff_stack_open_file(h, h->slice[i].i_path, err);
    if (s != STATUS_OK) return s;
    h->message[0] = '\0';
    const bool upright = h->first.orientation <= ORIENTATION_TOPLEFT;
    if (!upright && h->turned == NULL) {
        h->turned = malloc((size_t)h->first.width * h->first.height * sizeof *h->turned);
        if (h->turned == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot read volume: out of memory");
    }
    float *stored = upright ? value : h->turned;
    s = h->slice[i].is_bare ? read_bare(h, i, stored, err) : read_page(h, i, stored, err);
    if (s == STATUS_OK && !upright) turn(&h->first, stored, value);
    return s;
}
