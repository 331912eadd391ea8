#include "geometry/volume/format/vol_file.h"
#include "base/option_id.h"

#include "base/files/durable.h"
#include "geometry/volume/format/length_unit.h"
#include "geometry/volume/format/volume_part.h"
#include "geometry/volume/format/volume_reader.h"

#include <endian.h>
#include <errno.h>
#include <fcntl.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

enum { HEADER_BYTES = 48, MAX_EDGE = 1 << 20 };

void vol_quantise_direction(const float d[3], uint8_t b[2])
{
    float sign = d[2] < 0.0f ? -1.0f : 1.0f, length = sqrtf(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
    b[0] = b[1] = 255;
    if (!(length > 0.0f)) return;
    float theta = acosf(fminf(1.0f, sign * d[2] / length)), phi = atan2f(sign * d[1], sign * d[0]);
    if (phi < 0.0f) phi += 2.0f * (float)M_PI;
    long i_phi = lrintf(phi * 255.0f / (2.0f * (float)M_PI));
    b[0] = (uint8_t)lrintf(theta * 255.0f / (float)M_PI); /* theta <= pi/2, so it is never 255 */
    b[1] = (uint8_t)(i_phi >= 255 ? 0 : i_phi);
}

void vol_dequantise_direction(const uint8_t b[2], float d[3])
{
    d[0] = d[1] = d[2] = 0.0f;
    if (b[0] == 255) return;
    float theta = (float)b[0] * (float)M_PI / 255.0f, phi = (float)b[1] * 2.0f * (float)M_PI / 255.0f;
    d[0] = cosf(phi) * sinf(theta);
    d[1] = sinf(phi) * sinf(theta);
    d[2] = cosf(theta);
}

static void put_u32(uint8_t *p, uint32_t x)
{
    x = htole32(x);
    memcpy(p, &x, 4);
}

static void put_f32(uint8_t *p, float x)
{
    uint32_t u;
    memcpy(&u, &x, 4);
    put_u32(p, u);
}

static uint32_t get_u32(const uint8_t *p)
{
    uint32_t x;
    memcpy(&x, p, 4);
    return le32toh(x);
}

static float get_f32(const uint8_t *p)
{
    uint32_t u = get_u32(p);
    float x;
    memcpy(&x, &u, 4);
    return x;
}

static void fill_header(uint8_t h[HEADER_BYTES], enum vol_encoding encoding, const size_t n[3], uint32_t n_channel,
                        const double voxel_size_m[3])
{
    memcpy(h, "VOL\3", 4);
    put_u32(h + 4, (uint32_t)encoding);
    for (int a = 0; a < 3; a++) put_u32(h + 8 + 4 * a, (uint32_t)n[a]);
    put_u32(h + 20, n_channel);
    for (int a = 0; a < 3; a++) {
        put_f32(h + 24 + 4 * a, 0.0f);
        put_f32(h + 36 + 4 * a, (float)((double)n[a] * voxel_size_m[a] * 1e3));
    }
}

/* A file that has a temporary name beside path until it is complete. */
struct vol_writer {
    const char *path;
    char temporary[4096];
    FILE *file;
};

static status writer_open(struct vol_writer *w, const char *path, struct error *err)
{
    w->path = path;
    w->file = NULL;
    if (snprintf(w->temporary, sizeof w->temporary, "%s.part-%ld", path, (long)getpid()) >= (int)sizeof w->temporary)
        return error_set(err, STATUS_INVALID, "cannot write '%s': path too long", path);
    w->file = fopen(w->temporary, "wbe");
    if (w->file == NULL) return error_set_errno(err, "cannot write '%s'", path);
    return STATUS_OK;
}

static status writer_put(struct vol_writer *w, const void *data, size_t n_byte, struct error *err)
{
    if (fwrite(data, 1, n_byte, w->file) == n_byte) return STATUS_OK;
    return error_set_errno(err, "cannot write '%s'", w->path);
}

static status writer_close(struct vol_writer *w, status s, struct error *err)
{
    if (w->file == NULL) return s;
    if (s == STATUS_OK && (fflush(w->file) != 0 || fsync(fileno(w->file)) != 0))
        s = error_set_errno(err, "cannot write '%s'", w->path);
    if (fclose(w->file) != 0 && s == STATUS_OK) s = error_set_errno(err, "cannot write '%s'", w->path);
    if (s == STATUS_OK && rename(w->temporary, w->path) != 0) s = error_set_errno(err, "cannot write '%s'", w->path);
    if (s == STATUS_OK) return durable_sync_folder_of(w->path, err);
    unlink(w->temporary);
    return s;
}

/* Encodes voxels of a slice as bytes of the file. */
typedef void (*encode_slice)(const void *volume, size_t first_voxel, size_t n_voxel, uint8_t *out);

static void encode_density_f32(const void *volume, size_t first, size_t n, uint8_t *out)
{
    const struct volume *v = volume;
    for (size_t i = 0; i < n; i++) put_f32(out + 4 * i, fminf(1.0f, fmaxf(0.0f, v->density[first + i])));
}

static void encode_density_u8(const void *volume, size_t first, size_t n, uint8_t *out)
{
    const struct volume *v = volume;
    for (size_t i = 0; i < n; i++) out[i] = (uint8_t)lrintf(255.0f * fminf(1.0f, fmaxf(0.0f, v->density[first + i])));
}

static void encode_direction_f32(const void *volume, size_t first, size_t n, uint8_t *out)
{
    const struct direction_volume *v = volume;
    for (size_t i = 0; i < n; i++) {
        float d[3] = {0.0f, 0.0f, 0.0f};
        if (v->density[first + i] > 0) direction_volume_get(v, first + i, d);
        for (int a = 0; a < 3; a++) put_f32(out + 12 * i + 4 * a, d[a]);
    }
}

static void encode_direction_quantised(const void *volume, size_t first, size_t n, uint8_t *out)
{
    const struct direction_volume *v = volume;
    for (size_t i = 0; i < n; i++) {
        float d[3] = {0.0f, 0.0f, 0.0f};
        if (v->density[first + i] > 0) direction_volume_get(v, first + i, d);
        vol_quantise_direction(d, out + 2 * i);
    }
}

static status write_slices(const char *path, const uint8_t header[HEADER_BYTES], const void *volume, const size_t n[3],
                           struct scratch_space *space, size_t bytes_per_voxel, encode_slice encode, struct error *err)
{
    struct vol_writer w = {0};
    uint8_t *slice = malloc(n[0] * n[1] * bytes_per_voxel);
    if (slice == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot write '%s': out of memory", path);
    status s = writer_open(&w, path, err);
    if (s == STATUS_OK) s = writer_put(&w, header, HEADER_BYTES, err);
    for (size_t k = 0; k < n[2] && s == STATUS_OK; k++) {
        scratch_keep_within(space);
        encode(volume, volume_index(n, 0, 0, k), n[0] * n[1], slice);
        s = writer_put(&w, slice, n[0] * n[1] * bytes_per_voxel, err);
    }
    s = writer_close(&w, s, err);
    free(slice);
    return s;
}

status vol_write_density(const char *path, const struct volume *v, enum vol_encoding encoding, struct error *err)
{
    if (encoding != VOL_FLOAT32 && encoding != VOL_UINT8)
        return error_set(err, STATUS_INVALID, "cannot write '%s': encoding %d is not for densities", path,
                         (int)encoding);
    uint8_t header[HEADER_BYTES];
    fill_header(header, encoding, v->n, 1, v->voxel_size_m);
    return encoding == VOL_FLOAT32 ? write_slices(path, header, v, v->n, v->space, 4, encode_density_f32, err)
                                   : write_slices(path, header, v, v->n, v->space, 1, encode_density_u8, err);
}

status vol_write_direction(const char *path, const struct direction_volume *d, enum vol_encoding encoding,
                           struct error *err)
{
    if (encoding != VOL_FLOAT32 && encoding != VOL_QUANTISED)
        return error_set(err, STATUS_INVALID, "cannot write '%s': encoding %d is not for directions", path,
                         (int)encoding);
    uint8_t header[HEADER_BYTES];
    fill_header(header, encoding, d->n, 3, d->voxel_size_m);
    return encoding == VOL_FLOAT32 ? write_slices(path, header, d, d->n, d->space, 12, encode_direction_f32, err)
                                   : write_slices(path, header, d, d->n, d->space, 2, encode_direction_quantised, err);
}

struct sggx_volume {
    const struct direction_volume *d;
    float taken; /* 1 - along^2 */
};

static void encode_sggx(const void *volume, size_t first, size_t n, uint8_t *out)
{
    static const int row[6] = {0, 1, 2, 0, 0, 1}, column[6] = {0, 1, 2, 1, 2, 2};
    const struct sggx_volume *v = volume;
    for (size_t i = 0; i < n; i++) {
        float t[3] = {0.0f, 0.0f, 0.0f};
        if (v->d->density[first + i] > 0) direction_volume_get(v->d, first + i, t);
        for (int k = 0; k < 6; k++)
            put_f32(out + 24 * i + 4 * k, (k < 3 ? 1.0f : 0.0f) - v->taken * t[row[k]] * t[column[k]]);
    }
}

status vol_write_sggx(const char *path, const struct direction_volume *d, double along, struct error *err)
{
    uint8_t header[HEADER_BYTES];
    const struct sggx_volume v = {d, (float)(1.0 - along * along)};
    fill_header(header, VOL_FLOAT32, d->n, 6, d->voxel_size_m);
    return write_slices(path, header, &v, d->n, d->space, 24, encode_sggx, err);
}

static void copy_density(const void *volume, size_t first, size_t n, uint8_t *out)
{
    const struct direction_volume *v = volume;
    memcpy(out, v->density + first, n);
}

status vol_write_kept_density(const char *path, const struct direction_volume *d, struct error *err)
{
    uint8_t header[HEADER_BYTES];
    fill_header(header, VOL_UINT8, d->n, 1, d->voxel_size_m);
    return write_slices(path, header, d, d->n, d->space, 1, copy_density, err);
}

static status bad_header(const char *name, struct error *err, const char *what)
{
    return error_set_field(err, STATUS_FORMAT, OPTION_SCAN_FILES, "cannot read volume '%s': %s", name, what);
}

status vol_read_header(FILE *file, const char *name, struct vol_header *h, struct error *err)
{
    uint8_t b[HEADER_BYTES];
    struct stat st;
    *h = (struct vol_header){0};
    if (fseeko(file, 0, SEEK_SET) != 0 || fread(b, 1, sizeof b, file) != sizeof b)
        return bad_header(name, err, "the header is incomplete");
    if (memcmp(b, "VOL\3", 4) != 0) return bad_header(name, err, "not a .vol file of version 3");
    uint32_t encoding = get_u32(b + 4), n_channel = get_u32(b + 20);
    uint64_t n_voxel = 1;
    for (int a = 0; a < 3; a++) {
        uint32_t n = get_u32(b + 8 + 4 * a);
        if (n == 0 || n > MAX_EDGE) return bad_header(name, err, "the header gives an impossible size");
        h->n[a] = n;
        n_voxel *= n;
        h->box_min[a] = get_f32(b + 24 + 4 * a);
        h->box_max[a] = get_f32(b + 36 + 4 * a);
    }
    bool density = n_channel == 1 && (encoding == VOL_FLOAT32 || encoding == VOL_UINT8);
    bool direction = n_channel == 3 && (encoding == VOL_FLOAT32 || encoding == VOL_QUANTISED);
    if (!density && !direction)
        return error_set_field(err, STATUS_UNSUPPORTED, OPTION_SCAN_FILES,
                               "cannot read volume '%s': encoding %u with %u channels is not supported", name, encoding,
                               n_channel);
    h->encoding = (enum vol_encoding)encoding;
    h->n_channel = n_channel;
    h->bytes_per_voxel = encoding == VOL_FLOAT32 ? 4 * n_channel : encoding == VOL_QUANTISED ? 2 : 1;
    if (fstat(fileno(file), &st) != 0)
        return error_set_errno_at(err, __func__, OPTION_SCAN_FILES, "cannot read volume '%s'", name);
    uint64_t have = (uint64_t)st.st_size - HEADER_BYTES, want = n_voxel * h->bytes_per_voxel;
    /* longer by a row: the header belongs to another file */
    if (have < want || have - want >= h->n[0] * h->bytes_per_voxel)
        return error_set_field(err, STATUS_FORMAT, OPTION_SCAN_FILES,
                               "cannot read volume '%s': %zu x %zu x %zu voxels need %llu bytes, but the file has %lld",
                               name, h->n[0], h->n[1], h->n[2], (unsigned long long)(want + HEADER_BYTES),
                               (long long)st.st_size);
    return STATUS_OK;
}

/* ---- as a volume source ---- */

struct vol_handle {
    FILE *file;
    char *name;
    struct vol_header header;
};

static void vol_source_close(void *handle)
{
    struct vol_handle *h = handle;
    if (h == NULL) return;
    if (h->file != NULL) fclose(h->file);
    free(h->name);
    free(h);
}

static status vol_source_open(const char *const *path, size_t n_path, const struct volume_part *part, void **handle,
                              struct volume_source_info *info, struct error *err)
{
    size_t index[2];
    struct vol_handle *h = calloc(1, sizeof *h);
    status s = STATUS_OK;
    if (h != NULL) h->name = strdup(path_file_name(path[0]));
    if (h == NULL || h->name == NULL) {
        vol_source_close(h);
        return error_set(err, STATUS_NO_MEMORY, "cannot read volume: out of memory");
    }
    h->file = fopen(path[0], "rbe");
    if (h->file == NULL) s = error_set_errno_at(err, __func__, OPTION_SCAN_FILES, "cannot read volume '%s'", h->name);
    if (s == STATUS_OK && n_path > 1)
        s = bad_header(h->name, err, "one .vol file is a whole volume, but more files are given");
    if (s == STATUS_OK) s = vol_read_header(h->file, h->name, &h->header, err);
    if (s == STATUS_OK && h->header.n_channel != 1) s = bad_header(h->name, err, "it holds directions, not densities");
    if (s == STATUS_OK) s = volume_part_choose(h->name, &(struct volume_parts){0}, part, index, NULL, err);
    if (s != STATUS_OK) {
        vol_source_close(h);
        return s;
    }
    *info = volume_source_info_empty();
    info->sample = h->header.encoding == VOL_FLOAT32 ? "float32" : "uint8";
    double size_m[3];
    memcpy(info->n, h->header.n, sizeof info->n);
    for (int a = 0; a < 3; a++)
        size_m[a] = ((double)h->header.box_max[a] - (double)h->header.box_min[a]) * 1e-3 / (double)h->header.n[a];
    volume_state_voxel_size(info, size_m, "bounding box");
    *handle = h;
    return STATUS_OK;
}

static status vol_source_read(void *handle, size_t i_slice, size_t n_slice, float *value, struct error *err)
{
    struct vol_handle *h = handle;
    size_t n = h->header.n[0] * h->header.n[1] * n_slice, bytes = h->header.bytes_per_voxel;
    off_t at = HEADER_BYTES + (off_t)(h->header.n[0] * h->header.n[1] * bytes * i_slice);
    uint8_t *raw = malloc(n * bytes);
    if (raw == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot read volume '%s': out of memory", h->name);
    if (fseeko(h->file, at, SEEK_SET) != 0 || fread(raw, bytes, n, h->file) != n) {
        free(raw);
        return bad_header(h->name, err, "the file ends too early");
    }
    for (size_t i = 0; i < n; i++) value[i] = bytes == 1 ? (float)raw[i] / 255.0f : get_f32(raw + 4 * i);
    free(raw);
    return STATUS_OK;
}

static bool vol_recognise(const uint8_t b[16], const char *path)
{
    (void)path;
    return memcmp(b, "VOL\3", 4) == 0;
}

VOLUME_FORMAT(vol_reader, ".vol", .ending = {".vol"})

const volume_reader vol_reader = {"vol.v1", ".vol", vol_recognise, vol_source_open, vol_source_read, vol_source_close};

status vol_read_density(const char *path, struct volume *v, struct error *err)
{
    struct volume_source_info info = {0};
    void *handle = NULL;
    *v = (struct volume){0};
    status s = vol_source_open(&path, 1, NULL, &handle, &info, err);
    if (s == STATUS_OK) s = volume_init(v, info.n, info.voxel_size_m, err);
    if (s == STATUS_OK) s = vol_source_read(handle, 0, info.n[2], v->density, err);
    vol_source_close(handle);
    if (s != STATUS_OK) volume_release(v);
    return s;
}

status vol_read_direction(const char *path, struct vol_header *header, float **direction, struct error *err)
{
    const char *name = path_file_name(path);
    uint8_t *raw = NULL;
    *direction = NULL;
    FILE *file = fopen(path, "rbe");
    if (file == NULL) return error_set_errno_at(err, __func__, OPTION_SCAN_FILES, "cannot read volume '%s'", name);
    status s = vol_read_header(file, name, header, err);
    if (s == STATUS_OK && header->n_channel != 3) s = bad_header(name, err, "it holds densities, not directions");
    if (s != STATUS_OK) goto out;
    size_t n = volume_n_voxel(header->n), bytes = header->bytes_per_voxel;
    raw = malloc(n * bytes);
    *direction = malloc(n * 3 * sizeof **direction);
    if (raw == NULL || *direction == NULL) {
        s = error_set(err, STATUS_NO_MEMORY, "cannot read volume '%s': out of memory", name);
        goto out;
    }
    if (fread(raw, bytes, n, file) != n) {
        s = bad_header(name, err, "the file ends too early");
        goto out;
    }
    for (size_t i = 0; i < n; i++)
        if (bytes == 2)
            vol_dequantise_direction(raw + 2 * i, *direction + 3 * i);
        else
            for (size_t a = 0; a < 3; a++) (*direction)[3 * i + a] = get_f32(raw + 12 * i + 4 * a);
out:
    free(raw);
    fclose(file);
    if (s != STATUS_OK) {
        free(*direction);
        *direction = NULL;
    }
    return s;
}
