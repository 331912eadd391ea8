/* TIFF volumes: one multi-page file, or several files in order. libtiff decodes them, so all its compressions are
 * supported. Its messages go to a handler per file handle (TIFFOpenOptions, libtiff 4.5) and from there into our
 * error texts. */
#include "base/files/durable.h"
#include "base/option_id.h"
#include "geometry/volume/format/tiff_volume.h"
#include "geometry/volume/format/volume_reader.h"

#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

/* Checks the current page, number i_page from 0: it has the same tags as the first one, and the file of file_bytes
 * bytes is long enough for it. STATUS_FORMAT, STATUS_TOO_LARGE, STATUS_UNSUPPORTED. */
static status check_page(struct tiff_stack *h, const struct tiff_page *p, size_t i_page, uint64_t file_bytes,
                         struct error *err)
{
    const char *name = path_file_name(h->path[h->i_open]);
    if (i_page == 0) {
        h->first = *p;
        h->first_page = TIFFCurrentDirOffset(h->tiff);
    }
    status s = tiff_page_compare(p, &h->first, name, i_page + 1, err);
    if (s != STATUS_OK) return s;
    h->message[0] = '\0';
    if (p->depth > 1 && !TIFFIsTiled(h->tiff) && !tiff_page_is_contiguous(h->tiff, p))
        return error_set_field(err, STATUS_UNSUPPORTED, OPTION_SCAN_FILES,
                               "cannot read volume '%s': page %zu has %u slices (ImageDepth) in strips: save it in "
                               "tiles, or a page for each slice",
                               name, i_page + 1, p->depth);
    if (p->compression != COMPRESSION_NONE && tiff_page_bytes(p) > UINT32_MAX) /* as in voxel_stream.c */
        return error_set_field(err, STATUS_TOO_LARGE, OPTION_SCAN_FILES,
                               "cannot read volume '%s': page %zu is compressed and over 4 GiB", name, i_page + 1);
    if (!tiff_page_fits(h->tiff, p, file_bytes))
        return error_set_field(
            err, STATUS_FORMAT, OPTION_SCAN_FILES,
            "cannot read volume '%s': page %zu states %u x %u pixels, but the file is too short for them", name,
            i_page + 1, p->width, p->height);
    return STATUS_OK;
}

/* Slice z of the current page. libtiff knows the strips of its first slice only; uncompressed ones follow it. */
static struct tiff_slice tiff_slice_of_page(const struct tiff_stack *h, const struct tiff_page *p, uint32_t z)
{
    const bool is_bare = p->depth > 1 && !TIFFIsTiled(h->tiff);
    const uint64_t at =
        is_bare ? TIFFGetStrileOffset(h->tiff, 0) + z * tiff_page_bytes(p) : TIFFCurrentDirOffset(h->tiff);
    return (struct tiff_slice){h->i_open, at, z, is_bare};
}

/* Adds the slices of the current page, unless it is a preview of another one. */
static status add_page(struct tiff_stack *h, uint64_t file_bytes, struct error *err)
{
    struct tiff_page p;
    status s = tiff_page_read(h->tiff, path_file_name(h->path[h->i_open]), h->n_slice + 1, &p, err);
    if (s == STATUS_OK && p.is_preview && h->n_slice > 0) return s;
    if (s == STATUS_OK) s = check_page(h, &p, h->n_slice, file_bytes, err);
    for (uint32_t z = 0; z < p.depth && s == STATUS_OK; z++) s = tiff_stack_add(h, tiff_slice_of_page(h, &p, z), err);
    return s;
}

static status scan_file(struct tiff_stack *h, size_t i_path, struct error *err)
{
    status s = tiff_stack_open_file(h, i_path, err);
    if (s != STATUS_OK) return s;
    const size_t n_before = h->n_slice;
    struct stat st;
    if (fstat(TIFFFileno(h->tiff), &st) != 0)
        return error_set_errno_at(err, __func__, OPTION_SCAN_FILES, "cannot read volume '%s'",
                                  path_file_name(h->path[i_path]));
    for (;;) {
        s = add_page(h, (uint64_t)st.st_size, err);
        if (s != STATUS_OK) return s;
        if (TIFFLastDirectory(h->tiff)) break;
        h->message[0] = '\0';
        if (!TIFFReadDirectory(h->tiff))
            return error_set_field(err, STATUS_FORMAT, OPTION_SCAN_FILES,
                                   "cannot read volume '%s': page %zu is unreadable: %s",
                                   path_file_name(h->path[i_path]), h->n_slice + 1, tiff_stack_cause(h));
    }
    if (h->n_slice == n_before + 1) s = tiff_stack_add_bare(h, (uint64_t)st.st_size, err);
    if (i_path == 0) h->n_of_first = h->n_slice;
    return s;
}

static void tiff_close(void *handle)
{
    struct tiff_stack *h = handle;
    if (h == NULL) return;
    if (h->tiff != NULL) TIFFClose(h->tiff);
    for (size_t i = 0; i < h->n_path; i++) free(h->path[i]);
    free(h->path);
    free(h->slice);
    free(h->block);
    free(h->turned);
    free(h);
}

static status tiff_open(const char *const *path, size_t n_path, const struct volume_part *part, void **handle,
                        struct volume_source_info *info, struct error *err)
{
    status s = STATUS_OK;
    struct tiff_stack *h = calloc(1, sizeof *h);
    if (h != NULL) h->path = calloc(n_path, sizeof *h->path);
    if (h == NULL || h->path == NULL) goto no_memory;
    for (size_t i = 0; i < n_path; i++) {
        h->path[i] = strdup(path[i]);
        if (h->path[i] == NULL) goto no_memory;
        h->n_path++;
    }
    for (size_t i = 0; i < n_path; i++) {
        s = scan_file(h, i, err);
        if (s != STATUS_OK) goto fail;
    }
    *info = volume_source_info_empty();
    s = tiff_stack_order(h, part, info, err);
    if (s != STATUS_OK) goto fail;
    const bool transposed = h->first.orientation >= ORIENTATION_LEFTTOP;
    info->n[transposed] = h->first.width;
    info->n[!transposed] = h->first.height;
    info->n[2] = h->n_slice;
    info->sample = sample_name(h->first.sample);
    *handle = h;
    return STATUS_OK;
no_memory:
    s = error_set(err, STATUS_NO_MEMORY, "cannot read volume: out of memory");
fail:
    tiff_close(h);
    return s;
}

static status tiff_read(void *handle, size_t i_slice, size_t n_slice, float *value, struct error *err)
{
    struct tiff_stack *h = handle;
    status s = STATUS_OK;
    for (size_t i = i_slice; i < i_slice + n_slice && s == STATUS_OK; i++)
        s = tiff_stack_read(h, i, value + (i - i_slice) * h->first.width * h->first.height, err);
    return s;
}

static bool tiff_recognise(const uint8_t b[16], const char *path)
{
    (void)path;
    return memcmp(b, "II*\0", 4) == 0 || memcmp(b, "MM\0*", 4) == 0 || memcmp(b, "II+\0", 4) == 0 ||
           memcmp(b, "MM\0+", 4) == 0;
}

VOLUME_FORMAT(tiff_reader, "TIFF", .ending = {".tif", ".tiff"}, .may_be_slices = true)

const volume_reader tiff_reader = {"tiff.v1", "TIFF", tiff_recognise, tiff_open, tiff_read, tiff_close};
