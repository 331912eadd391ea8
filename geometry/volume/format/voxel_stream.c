#include "geometry/volume/format/voxel_stream.h"
#include "base/option_id.h"

#include "base/files/durable.h"

#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <zlib.h>

enum { CHUNK = 65536, LEAST_FOR_ORDER = 64 };

struct voxel_stream {
    struct voxel_layout layout;
    char *name, *data_path;
    FILE *file;
    size_t slice_bytes;
    uint8_t *in, *slice;
    z_stream inflate;
    bool inflating;
    size_t next_slice; /* next slice of the inflated stream */
};

static size_t count(const struct voxel_parts *p) { return p->n > 1 ? p->n : 1; }

/* Slices in the file, of all volumes. */
static uint64_t n_stored(const struct voxel_layout *l)
{
    return (uint64_t)l->n[2] * count(&l->by_slice) * count(&l->by_volume);
}

/* The slice in the file that slice k of the volume is. */
static size_t stored_slice(const struct voxel_layout *l, size_t k)
{
    return (l->by_volume.i * l->n[2] + k) * count(&l->by_slice) + l->by_slice.i;
}

/* Samples in a slice of the file. */
static uint64_t n_in_slice(const struct voxel_layout *l) { return (uint64_t)l->n[0] * l->n[1] * count(&l->by_sample); }

/* Bytes of all samples of n_byte bytes; UINT64_MAX: too many to count. */
static uint64_t stored_bytes(const struct voxel_layout *l, size_t n_byte)
{
    uint64_t n;
    return __builtin_mul_overflow(n_in_slice(l) * n_byte, n_stored(l), &n) ? UINT64_MAX : n;
}

static status no_memory(const char *name, struct error *err)
{
    return error_set(err, STATUS_NO_MEMORY, "cannot read volume '%s': out of memory", name);
}

char *voxel_stream_beside(const char *header_path, const char *file)
{
    const char *slash = strrchr(header_path, '/');
    size_t n_folder = slash == NULL ? 0 : (size_t)(slash - header_path) + 1, n = n_folder + strlen(file) + 1;
    char *path = malloc(n);
    if (path == NULL) return NULL;
    memcpy(path, header_path, n_folder);
    memcpy(path + n_folder, file, n - n_folder);
    return path;
}

void voxel_stream_close(struct voxel_stream *v)
{
    if (v == NULL) return;
    if (v->inflating) inflateEnd(&v->inflate);
    if (v->file != NULL) fclose(v->file);
    free(v->name);
    free(v->data_path);
    free(v->in);
    free(v->slice);
    free(v);
}

/* Returns ", which fits uint8, int8" for the types that would give exactly the file's length, else "". */
static const char *types_that_fit(const struct voxel_layout *l, uint64_t have, char *text, size_t n_text)
{
    size_t used = 0;
    text[0] = '\0';
    for (enum sample_type t = 0; t < SAMPLE_COUNT; t++) {
        if (have != stored_bytes(l, sample_bytes(t))) continue;
        int n = snprintf(text + used, n_text - used, "%s%s", used == 0 ? ", which fits " : ", ", sample_name(t));
        if (n > 0 && used + (size_t)n < n_text) used += (size_t)n;
    }
    return text;
}

static status check_size(struct voxel_stream *v, uint64_t size, struct error *err)
{
    struct voxel_layout *l = &v->layout;
    char fits[128];
    uint64_t want = stored_bytes(l, sample_bytes(l->sample)), skip = (uint64_t)l->skip_bytes;
    if (l->offset_bytes == -1) l->offset_bytes = want <= size ? (long long)(size - want) : 0;
    uint64_t offset = (uint64_t)l->offset_bytes, have = size > offset ? size - offset : 0;
    if (l->compressed) { /* the best ratio of deflate is 1032 */
        if (have <= UINT64_MAX / 1100 && (skip > have * 1100 || want > have * 1100 - skip)) goto too_short;
        return STATUS_OK;
    }
    have = have > skip ? have - skip : 0;
    if (want > have) goto too_short;
    if (have - want >= l->n[0] * sample_bytes(l->sample))
        return error_set_field(err, STATUS_FORMAT, OPTION_SCAN_FILES,
                               "cannot read volume '%s': %zu x %zu x %zu %s voxels need %llu bytes, '%s' has %llu%s",
                               v->name, l->n[0], l->n[1], l->n[2], sample_name(l->sample), (unsigned long long)want,
                               path_file_name(v->data_path), (unsigned long long)have,
                               types_that_fit(l, have, fits, sizeof fits));
    return STATUS_OK;
too_short:
    return error_set_field(
        err, STATUS_FORMAT, OPTION_SCAN_FILES,
        "cannot read volume '%s': the file is too short: %zu x %zu x %zu %s voxels need %llu bytes, '%s' has %llu%s%s",
        v->name, l->n[0], l->n[1], l->n[2], sample_name(l->sample), (unsigned long long)want,
        path_file_name(v->data_path), (unsigned long long)have, l->compressed ? " (compressed)" : "",
        l->compressed ? "" : types_that_fit(l, have, fits, sizeof fits));
}

static status open_data(struct voxel_stream *v, struct error *err)
{
    struct stat st;
    const struct voxel_layout *l = &v->layout;
    for (int a = 0; a < 3; a++)
        if (l->n[a] == 0 || l->n[a] > VOXEL_STREAM_MAX_EDGE)
            return error_set_field(err, STATUS_FORMAT, OPTION_SCAN_FILES,
                                   "cannot read volume '%s': an impossible size, %zu x %zu x %zu voxels", v->name,
                                   l->n[0], l->n[1], l->n[2]);
    if (l->by_sample.n > 64 || l->by_slice.n > VOXEL_STREAM_MAX_EDGE || l->by_volume.n > VOXEL_STREAM_MAX_EDGE)
        return error_set_field(err, STATUS_FORMAT, OPTION_SCAN_FILES,
                               "cannot read volume '%s': too many channels or times", v->name);
    v->slice_bytes = (size_t)n_in_slice(l) * sample_bytes(l->sample);
    if (v->slice_bytes > UINT32_MAX)
        return error_set_field(err, STATUS_TOO_LARGE, OPTION_SCAN_FILES,
                               "cannot read volume '%s': a slice is over 4 GiB", v->name);
    v->file = fopen(v->data_path, "rbe");
    if (v->file == NULL && errno == ENOENT)
        return error_set_field(err, STATUS_NOT_FOUND, OPTION_SCAN_FILES,
                               "cannot read volume '%s': its data file '%s' is missing", v->name,
                               path_file_name(v->data_path));
    if (v->file == NULL || fstat(fileno(v->file), &st) != 0)
        return error_set_errno_at(err, __func__, OPTION_SCAN_FILES, "cannot read volume '%s'", v->name);
    if (!S_ISREG(st.st_mode))
        return error_set_field(err, STATUS_FORMAT, OPTION_SCAN_FILES,
                               "cannot read volume '%s': '%s' is not a regular file", v->name,
                               path_file_name(v->data_path));
    status s = check_size(v, (uint64_t)st.st_size, err);
    if (s != STATUS_OK) return s;
    v->slice = malloc(v->slice_bytes);
    v->in = malloc(CHUNK);
    return v->slice != NULL && v->in != NULL ? STATUS_OK : no_memory(v->name, err);
}

status voxel_stream_open(const char *name, const char *data_path, const struct voxel_layout *layout,
                         struct voxel_stream **stream, struct error *err)
{
    *stream = NULL;
    struct voxel_stream *v = calloc(1, sizeof *v);
    if (v == NULL) return no_memory(name, err);
    v->layout = *layout;
    v->name = strdup(name);
    v->data_path = strdup(data_path);
    status s = v->name == NULL || v->data_path == NULL ? no_memory(name, err) : open_data(v, err);
    if (s != STATUS_OK) {
        voxel_stream_close(v);
        return s;
    }
    *stream = v;
    return STATUS_OK;
}

static status short_data(const struct voxel_stream *v, size_t i_slice, struct error *err)
{
    if (ferror(v->file))
        return error_set_errno_at(err, __func__, OPTION_SCAN_FILES, "cannot read volume '%s'", v->name);
    return error_set_field(err, STATUS_FORMAT, OPTION_SCAN_FILES,
                           "cannot read volume '%s': '%s' ends or is damaged in slice %zu", v->name,
                           path_file_name(v->data_path), i_slice + 1);
}

/* Reads the next n_byte inflated bytes. Consecutive gzip members form one stream. */
static status inflate_bytes(struct voxel_stream *v, size_t i_slice, uint8_t *out, size_t n_byte, struct error *err)
{
    v->inflate.next_out = out;
    v->inflate.avail_out = (uInt)n_byte;
    while (v->inflate.avail_out > 0) {
        if (v->inflate.avail_in == 0) {
            v->inflate.next_in = v->in;
            v->inflate.avail_in = (uInt)fread(v->in, 1, CHUNK, v->file);
            if (v->inflate.avail_in == 0) return short_data(v, i_slice, err);
        }
        int r = inflate(&v->inflate, Z_NO_FLUSH);
        if (r == Z_STREAM_END && v->inflate.avail_out > 0) r = inflateReset(&v->inflate);
        if (r != Z_OK && r != Z_STREAM_END) return short_data(v, i_slice, err);
    }
    return STATUS_OK;
}

static status start_inflating(struct voxel_stream *v, struct error *err)
{
    if (v->inflating) inflateEnd(&v->inflate);
    v->inflating = false;
    v->inflate = (z_stream){0};
    if (fseeko(v->file, v->layout.offset_bytes, SEEK_SET) != 0) return short_data(v, 0, err);
    if (inflateInit2(&v->inflate, 32 + MAX_WBITS) != Z_OK) return no_memory(v->name, err);
    v->inflating = true;
    v->next_slice = 0;
    long long left = v->layout.skip_bytes;
    while (left > 0) {
        size_t n = left < (long long)v->slice_bytes ? (size_t)left : v->slice_bytes;
        status s = inflate_bytes(v, 0, v->slice, n, err);
        if (s != STATUS_OK) return s;
        left -= (long long)n;
    }
    return STATUS_OK;
}

static status next_inflated(struct voxel_stream *v, size_t i_slice, struct error *err)
{
    status s = !v->inflating || i_slice < v->next_slice ? start_inflating(v, err) : STATUS_OK;
    while (s == STATUS_OK && v->next_slice <= i_slice) {
        s = inflate_bytes(v, v->next_slice, v->slice, v->slice_bytes, err);
        v->next_slice++;
    }
    if (s != STATUS_OK && v->inflating) { /* after an error the stream starts again at the next read */
        inflateEnd(&v->inflate);
        v->inflating = false;
    }
    return s;
}

/* Checks for surplus data after the last slice; v->slice is used as buffer. The length of compressed data cannot be
 * checked earlier. Another row is more than the padding of a writer, so it is an error; the end of the stream, or
 * trailing data that cannot be inflated, is not. */
static status check_end(struct voxel_stream *v, struct error *err)
{
    const struct voxel_layout *l = &v->layout;
    size_t row_bytes = l->n[0] * sample_bytes(l->sample);
    if (inflate_bytes(v, (size_t)n_stored(l), v->slice, row_bytes, NULL) != STATUS_OK) return STATUS_OK;
    return error_set_field(err, STATUS_FORMAT, OPTION_SCAN_FILES,
                           "cannot read volume '%s': '%s' continues after the %zu x %zu x %zu %s voxels of its header",
                           v->name, path_file_name(v->data_path), l->n[0], l->n[1], l->n[2], sample_name(l->sample));
}

static status next_plain(struct voxel_stream *v, size_t i_slice, struct error *err)
{
    off_t at = v->layout.offset_bytes + v->layout.skip_bytes + (off_t)(i_slice * v->slice_bytes);
    if (fseeko(v->file, at, SEEK_SET) != 0)
        return error_set_errno_at(err, __func__, OPTION_SCAN_FILES, "cannot read volume '%s'", v->name);
    return fread(v->slice, 1, v->slice_bytes, v->file) == v->slice_bytes ? STATUS_OK : short_data(v, i_slice, err);
}

/* Moves the samples of the part that is read to the front of a slice whose samples alternate. */
static void take_part(const struct voxel_layout *l, uint8_t *slice)
{
    const size_t bytes = sample_bytes(l->sample), n = l->n[0] * l->n[1], step = count(&l->by_sample);
    for (size_t i = 0; step > 1 && i < n; i++)
        for (size_t b = 0; b < bytes; b++) slice[i * bytes + b] = slice[(i * step + l->by_sample.i) * bytes + b];
}

status voxel_stream_read(struct voxel_stream *v, size_t i_slice, size_t n_slice, float *value, struct error *err)
{
    size_t n_sample = v->layout.n[0] * v->layout.n[1];
    for (size_t i = i_slice; i < i_slice + n_slice; i++, value += n_sample) {
        const size_t stored = stored_slice(&v->layout, i);
        status s = v->layout.compressed ? next_inflated(v, stored, err) : next_plain(v, stored, err);
        if (s != STATUS_OK) return s;
        take_part(&v->layout, v->slice);
        sample_to_float(v->layout.sample, v->layout.swap, n_sample, v->slice, value);
        if (v->layout.compressed && stored + 1 == n_stored(&v->layout)) s = check_end(v, err);
        if (s != STATUS_OK) return s;
    }
    return STATUS_OK;
}

/* Correlation of neighbours along x; 0 for constant rows and for values that are not finite. */
static double neighbour_correlation(const float *value, const size_t n[3])
{
    double mean = 0.0, var = 0.0, cov = 0.0;
    size_t n_pair = 0, n_all = n[0] * n[1];
    for (size_t i = 0; i < n_all; i++) mean += (double)value[i] / (double)n_all;
    for (size_t j = 0; j < n[1]; j++)
        for (size_t i = 0; i + 1 < n[0]; i++, n_pair++) {
            double a = (double)value[j * n[0] + i] - mean, b = (double)value[j * n[0] + i + 1] - mean;
            var += 0.5 * (a * a + b * b);
            cov += a * b;
        }
    return n_pair > 0 && var > 0.0 && isfinite(var) ? cov / var : 0.0;
}

status voxel_stream_check_order(struct voxel_stream *v, struct error *err)
{
    struct voxel_layout *l = &v->layout;
    if (l->compressed || sample_bytes(l->sample) == 1 || l->n[0] * l->n[1] < LEAST_FOR_ORDER) return STATUS_OK;
    float *value = malloc(l->n[0] * l->n[1] * sizeof *value);
    if (value == NULL) return no_memory(v->name, err);
    double correlation[2] = {0.0, 0.0};
    status s = STATUS_OK;
    for (int other = 0; other < 2 && s == STATUS_OK; other++) {
        bool stated = l->swap;
        if (other == 1) l->swap = !stated;
        s = voxel_stream_read(v, l->n[2] / 2, 1, value, err);
        l->swap = stated;
        if (s == STATUS_OK) correlation[other] = neighbour_correlation(value, l->n);
    }
    free(value);
    if (s != STATUS_OK) return s;
    if (correlation[0] < 0.1 && correlation[1] > 0.5)
        return error_set_field(
            err, STATUS_FORMAT, OPTION_SCAN_FILES,
            "cannot read volume '%s': its %s values are noise in the stated byte order and a picture in the other; the "
            "stated byte order is wrong",
            v->name, sample_name(l->sample));
    return STATUS_OK;
}
