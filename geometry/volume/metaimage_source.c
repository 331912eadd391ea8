/* MetaImage: a text header "Key = value" (.mhd) with the data in a file beside it, or header and data
 * in one file (.mha, ElementDataFile = LOCAL). Lengths are in millimetres. Compressed data (zlib) is inflated while
 * reading forwards; reading backwards starts over.
 * Source: the MetaIO documentation (itk.org/Wiki/MetaIO). */
#include "geometry/volume/volume_reader.h"

#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <strings.h>
#include <zlib.h>

enum { MAX_HEADER_BYTES = 65536, CHUNK = 65536 };

struct metaimage {
    char *name;      /* of the header, for errors */
    char *data_path;
    FILE *file;
    long long data_offset;
    size_t n[3];
    double spacing_mm[3];
    enum sample_type sample;
    bool swap, compressed, is_local, has_type, has_size, has_data;
    z_stream inflate;
    bool inflating;
    size_t next_slice; /* that the inflating stream will give */
    uint8_t *in, *slice;
};

static status bad(const struct metaimage *m, struct error *err, const char *what, const char *value)
{
    return error_set_field(err, STATUS_FORMAT, "volume.files", "cannot read volume '%s': %s '%s'", m->name, what, value);
}

static const struct {
    const char *name;
    enum sample_type type;
} element[] = {
    {"MET_UCHAR", SAMPLE_UINT8}, {"MET_CHAR", SAMPLE_INT8},     {"MET_USHORT", SAMPLE_UINT16}, {"MET_SHORT", SAMPLE_INT16},
    {"MET_UINT", SAMPLE_UINT32}, {"MET_INT", SAMPLE_INT32},     {"MET_FLOAT", SAMPLE_FLOAT32}, {"MET_DOUBLE", SAMPLE_FLOAT64},
};

static status parse_element(struct metaimage *m, const char *value, struct error *err)
{
    for (size_t i = 0; i < sizeof element / sizeof *element; i++)
        if (strcmp(value, element[i].name) == 0) {
            m->sample = element[i].type;
            m->has_type = true;
            return STATUS_OK;
        }
    return bad(m, err, "unsupported ElementType", value);
}

static status parse_size(struct metaimage *m, const char *value, struct error *err)
{
    const char *p = value;
    for (int a = 0; a < 3; a++) {
        char *end;
        errno = 0;
        unsigned long long n = strtoull(p, &end, 10);
        if (end == p || errno != 0 || n == 0 || n > 1u << 20 || strchr(value, '-') != NULL)
            return bad(m, err, "DimSize is not three positive numbers:", value);
        m->n[a] = (size_t)n;
        p = end;
    }
    m->has_size = true;
    return STATUS_OK;
}

static status parse_spacing(struct metaimage *m, const char *value, struct error *err)
{
    const char *p = value;
    for (int a = 0; a < 3; a++) {
        char *end;
        m->spacing_mm[a] = strtod(p, &end);
        if (end == p || !(m->spacing_mm[a] > 0.0) || !isfinite(m->spacing_mm[a]))
            return bad(m, err, "ElementSpacing is not three positive numbers:", value);
        p = end;
    }
    return STATUS_OK;
}

static status parse_data_file(struct metaimage *m, const char *header_path, const char *value, struct error *err)
{
    m->has_data = true;
    if (strcmp(value, "LOCAL") == 0 || strcmp(value, "Local") == 0) {
        m->is_local = true;
        m->data_path = strdup(header_path);
        return m->data_path != NULL ? STATUS_OK : error_set(err, STATUS_NO_MEMORY, "cannot read volume: out of memory");
    }
    if (strchr(value, '%') != NULL || strncmp(value, "LIST", 4) == 0)
        return error_set_field(err, STATUS_UNSUPPORTED, "volume.files",
                               "cannot read volume '%s': data in a list of files is not supported", m->name);
    if (strchr(value, '/') != NULL || value[0] == '\0') /* a header must not reach outside its own folder */
        return bad(m, err, "ElementDataFile must be a file beside the header, not", value);
    const char *slash = strrchr(header_path, '/');
    size_t n_folder = slash == NULL ? 0 : (size_t)(slash - header_path) + 1, n = n_folder + strlen(value) + 1;
    m->data_path = malloc(n);
    if (m->data_path == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot read volume: out of memory");
    memcpy(m->data_path, header_path, n_folder);
    memcpy(m->data_path + n_folder, value, n - n_folder);
    return STATUS_OK;
}

static bool is_true(const char *value) { return value[0] == 'T' || value[0] == 't' || value[0] == '1'; }

static status parse_line(struct metaimage *m, const char *header_path, const char *key, const char *value,
                         struct error *err)
{
    if (strcmp(key, "NDims") == 0) return strcmp(value, "3") == 0 ? STATUS_OK : bad(m, err, "NDims must be 3, not", value);
    if (strcmp(key, "DimSize") == 0) return parse_size(m, value, err);
    if (strcmp(key, "ElementType") == 0) return parse_element(m, value, err);
    if (strcmp(key, "ElementSpacing") == 0) return parse_spacing(m, value, err);
    if (strcmp(key, "ElementSize") == 0) return isnan(m->spacing_mm[0]) ? parse_spacing(m, value, err) : STATUS_OK;
    if (strcmp(key, "ElementByteOrderMSB") == 0 || strcmp(key, "BinaryDataByteOrderMSB") == 0) {
        m->swap = is_true(value);
        return STATUS_OK;
    }
    if (strcmp(key, "CompressedData") == 0) {
        m->compressed = is_true(value);
        return STATUS_OK;
    }
    if (strcmp(key, "BinaryData") == 0)
        return is_true(value) ? STATUS_OK : bad(m, err, "data as text is not supported: BinaryData =", value);
    if (strcmp(key, "ElementNumberOfChannels") == 0)
        return strcmp(value, "1") == 0 ? STATUS_OK : bad(m, err, "one channel expected, not", value);
    if (strcmp(key, "HeaderSize") == 0) {
        char *end;
        m->data_offset = strtoll(value, &end, 10);
        return end != value && m->data_offset >= -1 ? STATUS_OK : bad(m, err, "HeaderSize makes no sense:", value);
    }
    if (strcmp(key, "ElementDataFile") == 0) return parse_data_file(m, header_path, value, err);
    return STATUS_OK; /* everything else says nothing about the voxels */
}

/* Header lines up to ElementDataFile, which is the last by definition. */
static status parse_header(struct metaimage *m, const char *path, FILE *file, struct error *err)
{
    char line[4096];
    while (!m->has_data && fgets(line, sizeof line, file) != NULL) {
        if (ftell(file) > MAX_HEADER_BYTES) break;
        char *equal = strchr(line, '=');
        if (equal == NULL) continue;
        char *key_end = equal, *key = line + strspn(line, " \t"), *value = equal + 1 + strspn(equal + 1, " \t");
        while (key_end > key && strchr(" \t", key_end[-1]) != NULL) key_end--;
        *key_end = '\0';
        size_t n = strlen(value);
        while (n > 0 && strchr(" \t\r\n", value[n - 1]) != NULL) value[--n] = '\0';
        status s = parse_line(m, path, key, value, err);
        if (s != STATUS_OK) return s;
    }
    const char *missing = !m->has_size ? "DimSize" : !m->has_type ? "ElementType" : !m->has_data ? "ElementDataFile" : NULL;
    return missing == NULL ? STATUS_OK : bad(m, err, "the header lacks", missing);
}

static void metaimage_close(void *handle)
{
    struct metaimage *m = handle;
    if (m == NULL) return;
    if (m->inflating) inflateEnd(&m->inflate);
    if (m->file != NULL) fclose(m->file);
    free(m->name);
    free(m->data_path);
    free(m->in);
    free(m->slice);
    free(m);
}

/* Opens the data and compares the promised size with what is there. */
static status open_data(struct metaimage *m, struct error *err)
{
    struct stat st;
    m->file = fopen(m->data_path, "rbe");
    if (m->file == NULL && errno == ENOENT)
        return error_set_field(err, STATUS_NOT_FOUND, "volume.files", "cannot read volume '%s': its data file '%s' is missing",
                               m->name, volume_file_name(m->data_path));
    if (m->file == NULL || fstat(fileno(m->file), &st) != 0)
        return error_set_errno_at(err, __func__, "volume.files", "cannot read volume '%s'", m->name);
    uint64_t want = (uint64_t)m->n[0] * m->n[1] * m->n[2] * sample_bytes(m->sample);
    if (m->data_offset == -1 && !m->compressed && want <= (uint64_t)st.st_size)
        m->data_offset = (long long)st.st_size - (long long)want;
    long long have = st.st_size - (m->data_offset > 0 ? m->data_offset : 0);
    uint64_t can_hold = have <= 0 ? 0 : (uint64_t)have * (m->compressed ? 1100 : 1);
    if (want > can_hold)
        return error_set_field(err, STATUS_FORMAT, "volume.files",
                               "cannot read volume '%s': %zu x %zu x %zu %s voxels need %.0f bytes, '%s' has %lld", m->name,
                               m->n[0], m->n[1], m->n[2], sample_name(m->sample), (double)want,
                               volume_file_name(m->data_path), have > 0 ? have : 0);
    if (m->data_offset < 0) m->data_offset = 0;
    m->slice = malloc(m->n[0] * m->n[1] * sample_bytes(m->sample));
    m->in = malloc(CHUNK);
    return m->slice != NULL && m->in != NULL
               ? STATUS_OK
               : error_set(err, STATUS_NO_MEMORY, "cannot read volume '%s': out of memory", m->name);
}

static status metaimage_open(const char *const *path, size_t n_path, void **handle, struct volume_source_info *info,
                             struct error *err)
{
    struct metaimage *m = calloc(1, sizeof *m);
    status s = STATUS_OK;
    if (m != NULL) m->name = strdup(volume_file_name(path[0]));
    if (m == NULL || m->name == NULL) {
        s = error_set(err, STATUS_NO_MEMORY, "cannot read volume: out of memory");
        goto fail;
    }
    m->spacing_mm[0] = m->spacing_mm[1] = m->spacing_mm[2] = NAN;
    FILE *header = fopen(path[0], "rbe");
    if (header == NULL) {
        s = error_set_errno_at(err, __func__, "volume.files", "cannot read volume '%s'", m->name);
        goto fail;
    }
    s = parse_header(m, path[0], header, err);
    if (s == STATUS_OK && m->is_local) m->data_offset = ftell(header);
    fclose(header);
    if (s == STATUS_OK && n_path > 1) /* uploads name the data file, too; nothing else makes sense */
        for (size_t i = 1; i < n_path && s == STATUS_OK; i++)
            if (strcmp(path[i], m->data_path) != 0) s = bad(m, err, "its ElementDataFile is not", volume_file_name(path[i]));
    if (s == STATUS_OK) s = open_data(m, err);
    if (s != STATUS_OK) goto fail;
    *info = (struct volume_source_info){.n = {m->n[0], m->n[1], m->n[2]}, .sample = sample_name(m->sample)};
    for (int a = 0; a < 3; a++) info->voxel_size_m[a] = m->spacing_mm[a] * 1e-3;
    *handle = m;
    return STATUS_OK;
fail:
    metaimage_close(m);
    return s;
}

static status short_data(const struct metaimage *m, size_t i_slice, struct error *err)
{
    return error_set_field(err, STATUS_FORMAT, "volume.files", "cannot read volume '%s': '%s' ends or is damaged in slice %zu",
                           m->name, volume_file_name(m->data_path), i_slice + 1);
}

static status inflate_slice(struct metaimage *m, size_t i_slice, size_t n_byte, struct error *err)
{
    m->inflate.next_out = m->slice;
    m->inflate.avail_out = (uInt)n_byte;
    while (m->inflate.avail_out > 0) {
        if (m->inflate.avail_in == 0) {
            m->inflate.next_in = m->in;
            m->inflate.avail_in = (uInt)fread(m->in, 1, CHUNK, m->file);
            if (m->inflate.avail_in == 0) return short_data(m, i_slice, err);
        }
        int r = inflate(&m->inflate, Z_NO_FLUSH);
        if (r == Z_STREAM_END && m->inflate.avail_out == 0) break;
        if (r != Z_OK) return short_data(m, i_slice, err);
    }
    m->next_slice++;
    return STATUS_OK;
}

static status seek_compressed(struct metaimage *m, size_t i_slice, size_t n_byte, struct error *err)
{
    if (!m->inflating || i_slice < m->next_slice) {
        if (m->inflating) inflateEnd(&m->inflate);
        m->inflating = false;
        m->inflate = (z_stream){0};
        if (fseeko(m->file, m->data_offset, SEEK_SET) != 0 || inflateInit2(&m->inflate, 32 + MAX_WBITS) != Z_OK)
            return short_data(m, i_slice, err);
        m->inflating = true;
        m->next_slice = 0;
    }
    while (m->next_slice < i_slice) {
        status s = inflate_slice(m, m->next_slice, n_byte, err);
        if (s != STATUS_OK) return s;
    }
    return STATUS_OK;
}

static status metaimage_read(void *handle, size_t i_slice, size_t n_slice, float *value, struct error *err)
{
    struct metaimage *m = handle;
    size_t n_sample = m->n[0] * m->n[1], n_byte = n_sample * sample_bytes(m->sample);
    if (n_byte > UINT32_MAX)
        return error_set_field(err, STATUS_TOO_LARGE, "volume.files", "cannot read volume '%s': a slice is over 4 GiB", m->name);
    if (!m->compressed && fseeko(m->file, m->data_offset + (off_t)(i_slice * n_byte), SEEK_SET) != 0)
        return error_set_errno_at(err, __func__, "volume.files", "cannot read volume '%s'", m->name);
    for (size_t i = i_slice; i < i_slice + n_slice; i++, value += n_sample) {
        status s = STATUS_OK;
        if (m->compressed) {
            s = seek_compressed(m, i, n_byte, err);
            if (s == STATUS_OK) s = inflate_slice(m, i, n_byte, err);
        } else if (fread(m->slice, 1, n_byte, m->file) != n_byte) {
            s = short_data(m, i, err);
        }
        if (s != STATUS_OK) return s;
        sample_to_float(m->sample, m->swap, n_sample, m->slice, value);
    }
    return STATUS_OK;
}

static bool metaimage_recognise(const uint8_t b[16], const char *path)
{
    const char *dot = strrchr(path, '.');
    if (dot != NULL && (strcasecmp(dot, ".mhd") == 0 || strcasecmp(dot, ".mha") == 0)) return true;
    return memcmp(b, "ObjectType", 10) == 0 || memcmp(b, "NDims", 5) == 0;
}

const volume_reader metaimage_reader = {"metaimage.v1", metaimage_recognise, metaimage_open, metaimage_read,
                                        metaimage_close};
