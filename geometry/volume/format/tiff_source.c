/* TIFF volumes: one multi-page file, or several files in order. libtiff decodes them, so all its compressions are
 * supported. Its messages go to a handler per file handle (TIFFOpenOptions, libtiff 4.5) and from there into our
 * error texts. */
#include "base/files/durable.h"
#include "base/option_id.h"
#include "geometry/volume/format/tiff_page.h"
#include "geometry/volume/format/volume_reader.h"

#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <tiffio.h>

enum { MAX_PAGE = 1 << 20 };

struct page {
    size_t i_path;
    toff_t offset;
};

struct tiff_handle {
    char **path;
    size_t n_path;
    struct page *page;
    size_t n_page;
    struct tiff_page first; /* all other pages have the same tags */
    TIFF *tiff;             /* the file that is open at present */
    size_t i_open;
    void *block; /* one strip or tile */
    size_t block_bytes;
    char message[256]; /* libtiff's first message since the last reset */
};

/* Removes "path: ", with which libtiff starts some texts: users know the file by its name, and must not see folders
 * of the server. */
static void drop_path(struct tiff_handle *h)
{
    size_t n = strlen(h->path[h->i_open]);
    if (strncmp(h->message, h->path[h->i_open], n) != 0 || strncmp(h->message + n, ": ", 2) != 0) return;
    memmove(h->message, h->message + n + 2, strlen(h->message + n + 2) + 1);
}

static int keep_message(TIFF *tiff, void *user, const char *module, const char *format, va_list argument)
{
    (void)tiff;
    (void)module;
    struct tiff_handle *h = user;
    if (h->message[0] == '\0') {
        vsnprintf(h->message, sizeof h->message, format, argument);
        size_t n = strlen(h->message);
        if (n > 0 && h->message[n - 1] == '.') h->message[n - 1] = '\0';
        drop_path(h);
    }
    return 1; /* handled: libtiff does not call its global handlers, which print */
}

static int drop_message(TIFF *tiff, void *user, const char *module, const char *format, va_list argument)
{
    (void)tiff, (void)user, (void)module, (void)format, (void)argument;
    return 1;
}

static const char *cause(const struct tiff_handle *h) { return h->message[0] != '\0' ? h->message : "damaged data"; }

static status open_file(struct tiff_handle *h, size_t i_path, struct error *err)
{
    if (h->tiff != NULL && h->i_open == i_path) return STATUS_OK;
    if (h->tiff != NULL) TIFFClose(h->tiff);
    h->tiff = NULL;
    h->message[0] = '\0';
    const char *name = path_file_name(h->path[i_path]);
    struct stat st;
    if (stat(h->path[i_path], &st) != 0) {
        if (errno == ENOENT)
            return error_set_field(err, STATUS_NOT_FOUND, OPTION_SCAN_FILES, "cannot read volume '%s': no such file",
                                   name);
        return error_set_errno_at(err, __func__, OPTION_SCAN_FILES, "cannot read volume '%s'", name);
    }
    if (st.st_size == 0)
        return error_set_field(err, STATUS_FORMAT, OPTION_SCAN_FILES, "cannot read volume '%s': the file is empty",
                               name);
    TIFFOpenOptions *option = TIFFOpenOptionsAlloc();
    if (option == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot read volume '%s': out of memory", name);
    TIFFOpenOptionsSetErrorHandlerExtR(option, keep_message, h);
    TIFFOpenOptionsSetWarningHandlerExtR(option, drop_message, h);
    h->i_open = i_path;
    /* m: no memory map, because a file that is too short would raise SIGBUS */
    h->tiff = TIFFOpenExt(h->path[i_path], "rm", option);
    TIFFOpenOptionsFree(option);
    if (h->tiff == NULL)
        return error_set_field(err, STATUS_FORMAT, OPTION_SCAN_FILES, "cannot read volume '%s': %s", name, cause(h));
    return STATUS_OK;
}

/* Checks the current page, number i_page from 0: it can be read, has the same tags as the first one, and the file of
 * file_bytes bytes is long enough for it. STATUS_FORMAT, STATUS_TOO_LARGE, STATUS_UNSUPPORTED. */
static status check_page(struct tiff_handle *h, size_t i_page, uint64_t file_bytes, struct error *err)
{
    const char *name = path_file_name(h->path[h->i_open]);
    struct tiff_page p;
    status s = tiff_page_read(h->tiff, name, i_page + 1, &p, err);
    if (s != STATUS_OK) return s;
    if (i_page == 0) h->first = p;
    s = tiff_page_compare(&p, &h->first, name, i_page + 1, err);
    if (s != STATUS_OK) return s;
    h->message[0] = '\0';
    if (p.compression != COMPRESSION_NONE && tiff_page_bytes(&p) > UINT32_MAX) /* as in voxel_stream.c */
        return error_set_field(err, STATUS_TOO_LARGE, OPTION_SCAN_FILES,
                               "cannot read volume '%s': page %zu is compressed and over 4 GiB", name, i_page + 1);
    if (!tiff_page_fits(h->tiff, &p, file_bytes))
        return error_set_field(
            err, STATUS_FORMAT, OPTION_SCAN_FILES,
            "cannot read volume '%s': page %zu states %u x %u pixels, but the file is too short for them", name,
            i_page + 1, p.width, p.height);
    return STATUS_OK;
}

static status add_page(struct tiff_handle *h, size_t *capacity, struct error *err)
{
    if (h->n_page == MAX_PAGE)
        return error_set_field(err, STATUS_TOO_LARGE, OPTION_SCAN_FILES, "cannot read volume '%s': over %d pages",
                               path_file_name(h->path[0]), MAX_PAGE);
    if (h->n_page == *capacity) {
        size_t n = *capacity == 0 ? 256 : *capacity * 2;
        struct page *bigger = realloc(h->page, n * sizeof *bigger);
        if (bigger == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot read volume: out of memory");
        h->page = bigger;
        *capacity = n;
    }
    h->page[h->n_page++] = (struct page){h->i_open, TIFFCurrentDirOffset(h->tiff)};
    return STATUS_OK;
}

static status scan_file(struct tiff_handle *h, size_t i_path, size_t *capacity, struct error *err)
{
    status s = open_file(h, i_path, err);
    if (s != STATUS_OK) return s;
    struct stat st;
    if (fstat(TIFFFileno(h->tiff), &st) != 0)
        return error_set_errno_at(err, __func__, OPTION_SCAN_FILES, "cannot read volume '%s'",
                                  path_file_name(h->path[i_path]));
    for (;;) {
        s = check_page(h, h->n_page, (uint64_t)st.st_size, err);
        if (s == STATUS_OK) s = add_page(h, capacity, err);
        if (s != STATUS_OK) return s;
        if (TIFFLastDirectory(h->tiff)) return STATUS_OK;
        h->message[0] = '\0';
        if (!TIFFReadDirectory(h->tiff))
            return error_set_field(err, STATUS_FORMAT, OPTION_SCAN_FILES,
                                   "cannot read volume '%s': page %zu is unreadable: %s",
                                   path_file_name(h->path[i_path]), h->n_page + 1, cause(h));
    }
}

static void tiff_close(void *handle)
{
    struct tiff_handle *h = handle;
    if (h == NULL) return;
    if (h->tiff != NULL) TIFFClose(h->tiff);
    for (size_t i = 0; i < h->n_path; i++) free(h->path[i]);
    free(h->path);
    free(h->page);
    free(h->block);
    free(h);
}

static status tiff_open(const char *const *path, size_t n_path, void **handle, struct volume_source_info *info,
                        struct error *err)
{
    status s = STATUS_OK;
    size_t capacity = 0;
    struct tiff_handle *h = calloc(1, sizeof *h);
    if (h != NULL) h->path = calloc(n_path, sizeof *h->path);
    if (h == NULL || h->path == NULL) goto no_memory;
    for (size_t i = 0; i < n_path; i++) {
        h->path[i] = strdup(path[i]);
        if (h->path[i] == NULL) goto no_memory;
        h->n_path++;
    }
    for (size_t i = 0; i < n_path; i++) {
        s = scan_file(h, i, &capacity, err);
        if (s != STATUS_OK) goto fail;
    }
    *info = (struct volume_source_info){.n = {h->first.width, h->first.height, h->n_page},
                                        /* TIFF resolution tags are rarely meaningful */
                                        .voxel_size_m = {NAN, NAN, NAN},
                                        .sample = sample_name(h->first.sample)};
    *handle = h;
    return STATUS_OK;
no_memory:
    s = error_set(err, STATUS_NO_MEMORY, "cannot read volume: out of memory");
fail:
    tiff_close(h);
    return s;
}

static status reserve_block(struct tiff_handle *h, uint64_t n_byte, struct error *err)
{
    if (n_byte <= h->block_bytes) return STATUS_OK;
    void *bigger = n_byte < (uint64_t)1 << 40 ? realloc(h->block, (size_t)n_byte) : NULL;
    if (bigger == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot read volume: out of memory");
    h->block = bigger;
    h->block_bytes = (size_t)n_byte;
    return STATUS_OK;
}

static status block_error(struct tiff_handle *h, size_t i_page, struct error *err)
{
    return error_set_field(err, STATUS_FORMAT, OPTION_SCAN_FILES, "cannot read volume '%s': page %zu is damaged: %s",
                           path_file_name(h->path[h->i_open]), i_page + 1, cause(h));
}

static status read_strips(struct tiff_handle *h, size_t i_page, float *value, struct error *err)
{
    uint32_t rows = h->first.height;
    TIFFGetFieldDefaulted(h->tiff, TIFFTAG_ROWSPERSTRIP, &rows);
    if (rows == 0 || rows > h->first.height) rows = h->first.height;
    size_t row_bytes = h->first.width * sample_bytes(h->first.sample);
    status s = reserve_block(h, (uint64_t)row_bytes * rows, err);
    if (s != STATUS_OK) return s;
    for (uint32_t y = 0; y < h->first.height; y += rows) {
        uint32_t n_row = y + rows <= h->first.height ? rows : h->first.height - y;
        tmsize_t want = (tmsize_t)(row_bytes * n_row);
        if (TIFFReadEncodedStrip(h->tiff, y / rows, h->block, want) != want) return block_error(h, i_page, err);
        sample_to_float(h->first.sample, false, (size_t)n_row * h->first.width, h->block,
                        value + (size_t)y * h->first.width);
    }
    return STATUS_OK;
}

static status read_tiles(struct tiff_handle *h, size_t i_page, float *value, struct error *err)
{
    uint32_t tw = 0, th = 0;
    TIFFGetField(h->tiff, TIFFTAG_TILEWIDTH, &tw);
    TIFFGetField(h->tiff, TIFFTAG_TILELENGTH, &th);
    if (tw == 0 || th == 0 || tw > h->first.width + 4096u || th > h->first.height + 4096u)
        return block_error(h, i_page, err);
    size_t bytes = sample_bytes(h->first.sample);
    status s = reserve_block(h, (uint64_t)tw * th * bytes, err);
    if (s != STATUS_OK) return s;
    for (uint32_t y = 0; y < h->first.height; y += th)
        for (uint32_t x = 0; x < h->first.width; x += tw) {
            uint32_t i_tile = TIFFComputeTile(h->tiff, x, y, 0, 0);
            tmsize_t want = (tmsize_t)((size_t)tw * th * bytes);
            if (TIFFReadEncodedTile(h->tiff, i_tile, h->block, want) != want) return block_error(h, i_page, err);
            size_t n = x + tw <= h->first.width ? tw : h->first.width - x;
            for (uint32_t r = 0; r < th && y + r < h->first.height; r++)
                sample_to_float(h->first.sample, false, n, (uint8_t *)h->block + (size_t)r * tw * bytes,
                                value + (size_t)(y + r) * h->first.width + x);
        }
    return STATUS_OK;
}

static status tiff_read(void *handle, size_t i_slice, size_t n_slice, float *value, struct error *err)
{
    struct tiff_handle *h = handle;
    for (size_t i = i_slice; i < i_slice + n_slice; i++, value += (size_t)h->first.width * h->first.height) {
        status s = open_file(h, h->page[i].i_path, err);
        if (s != STATUS_OK) return s;
        h->message[0] = '\0';
        if (!TIFFSetSubDirectory(h->tiff, h->page[i].offset)) return block_error(h, i, err);
        uint32_t width = 0, height = 0; /* the file may have changed since it was opened */
        TIFFGetField(h->tiff, TIFFTAG_IMAGEWIDTH, &width);
        TIFFGetField(h->tiff, TIFFTAG_IMAGELENGTH, &height);
        if (width != h->first.width || height != h->first.height) return block_error(h, i, err);
        s = TIFFIsTiled(h->tiff) ? read_tiles(h, i, value, err) : read_strips(h, i, value, err);
        if (s != STATUS_OK) return s;
    }
    return STATUS_OK;
}

static bool tiff_recognise(const uint8_t b[16], const char *path)
{
    (void)path;
    return memcmp(b, "II*\0", 4) == 0 || memcmp(b, "MM\0*", 4) == 0 || memcmp(b, "II+\0", 4) == 0 ||
           memcmp(b, "MM\0+", 4) == 0;
}

VOLUME_FORMAT(tiff_reader, "TIFF", .ending = {".tif", ".tiff"}, .may_be_slices = true)

const volume_reader tiff_reader = {"tiff.v1", "TIFF", tiff_recognise, tiff_open, tiff_read, tiff_close};
