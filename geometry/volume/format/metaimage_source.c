/* The MetaImage format: a text header "Key = value" (.mhd) with the data in a file beside it, or header and data in
 * one file (.mha, ElementDataFile = LOCAL). Lengths are in DistanceUnits, by default millimetres. Compressed data is
 * zlib's. Source: the MetaIO documentation (itk.org/Wiki/MetaIO). */
#include "base/files/durable.h"
#include "base/option_id.h"
#include "geometry/volume/format/volume_header.h"
#include "geometry/volume/format/volume_reader.h"

#include <endian.h>
#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

struct metaimage {
    struct volume_header header;
    double spacing[3], unit_m; /* metres per unit of spacing */
    bool is_local, has_type, has_size, has_data;
};

static status bad(const struct metaimage *m, struct error *err, const char *what, const char *value)
{
    return volume_header_refuse(&m->header, what, value, err);
}

static const struct {
    const char *name;
    enum sample_type type;
} element[] = {
    {"MET_UCHAR", SAMPLE_UINT8},   {"MET_CHAR", SAMPLE_INT8},      {"MET_USHORT", SAMPLE_UINT16},
    {"MET_SHORT", SAMPLE_INT16},   {"MET_UINT", SAMPLE_UINT32},    {"MET_INT", SAMPLE_INT32},
    {"MET_FLOAT", SAMPLE_FLOAT32}, {"MET_DOUBLE", SAMPLE_FLOAT64},
};

static status parse_element(struct metaimage *m, const char *value, struct error *err)
{
    for (size_t i = 0; i < sizeof element / sizeof *element; i++)
        if (strcmp(value, element[i].name) == 0) {
            m->header.layout.sample = element[i].type;
            m->has_type = true;
            return STATUS_OK;
        }
    return bad(m, err, "unsupported ElementType", value);
}

static status parse_size(struct metaimage *m, const char *value, struct error *err)
{
    const char *end;
    m->has_size = true;
    return volume_header_sizes(&m->header, value, "DimSize is not three positive numbers:", &end, err);
}

static status parse_spacing(struct metaimage *m, const char *value, struct error *err)
{
    const char *p = value;
    for (int a = 0; a < 3; a++) {
        char *end;
        m->spacing[a] = strtod(p, &end);
        if (end == p || !(m->spacing[a] > 0.0) || !isfinite(m->spacing[a]))
            return bad(m, err, "ElementSpacing is not three positive numbers:", value);
        p = end;
    }
    return STATUS_OK;
}

/* MetaIO has these four units; "?" is its default. */
static status parse_unit(struct metaimage *m, const char *value, struct error *err)
{
    static const struct {
        const char *name;
        double metre;
    } unit[] = {{"?", 1e-3}, {"um", 1e-6}, {"mm", 1e-3}, {"cm", 1e-2}};
    for (size_t i = 0; i < sizeof unit / sizeof *unit; i++)
        if (strcasecmp(value, unit[i].name) == 0) {
            m->unit_m = unit[i].metre;
            return STATUS_OK;
        }
    return bad(m, err, "DistanceUnits must be um, mm or cm, not", value);
}

static status parse_data_file(struct metaimage *m, const char *header_path, const char *value, struct error *err)
{
    m->has_data = true;
    if (strcmp(value, "LOCAL") == 0 || strcmp(value, "Local") == 0) {
        m->is_local = true;
        m->header.data_path = strdup(header_path);
        return m->header.data_path != NULL ? STATUS_OK
                                           : error_set(err, STATUS_NO_MEMORY, "cannot read volume: out of memory");
    }
    return volume_header_data_file(&m->header, header_path, value,
                                   "ElementDataFile must be a file beside the header, not", err);
}

static bool is_true(const char *value) { return value[0] == 'T' || value[0] == 't' || value[0] == '1'; }

static status parse_line(struct metaimage *m, const char *header_path, const char *key, const char *value,
                         struct error *err)
{
    if (strcmp(key, "NDims") == 0)
        return strcmp(value, "3") == 0 ? STATUS_OK : bad(m, err, "NDims must be 3, not", value);
    if (strcmp(key, "DimSize") == 0) return parse_size(m, value, err);
    if (strcmp(key, "ElementType") == 0) return parse_element(m, value, err);
    if (strcmp(key, "ElementSpacing") == 0) return parse_spacing(m, value, err);
    if (strcmp(key, "ElementSize") == 0) return isnan(m->spacing[0]) ? parse_spacing(m, value, err) : STATUS_OK;
    if (strcmp(key, "DistanceUnits") == 0) return parse_unit(m, value, err);
    if (strcmp(key, "ElementByteOrderMSB") == 0 || strcmp(key, "BinaryDataByteOrderMSB") == 0) {
        m->header.layout.swap = is_true(value) != (BYTE_ORDER == BIG_ENDIAN);
        return STATUS_OK;
    }
    if (strcmp(key, "CompressedData") == 0) {
        m->header.layout.compressed = is_true(value);
        return STATUS_OK;
    }
    if (strcmp(key, "BinaryData") == 0)
        return is_true(value) ? STATUS_OK : bad(m, err, "data as text is not supported: BinaryData =", value);
    if (strcmp(key, "ElementNumberOfChannels") == 0)
        return strcmp(value, "1") == 0 ? STATUS_OK : bad(m, err, "one channel expected, not", value);
    if (strcmp(key, "HeaderSize") == 0) {
        char *end;
        m->header.layout.offset_bytes = strtoll(value, &end, 10);
        return end != value && m->header.layout.offset_bytes >= -1 ? STATUS_OK
                                                                   : bad(m, err, "HeaderSize is not valid:", value);
    }
    if (strcmp(key, "ElementDataFile") == 0) return parse_data_file(m, header_path, value, err);
    return STATUS_OK; /* other keys do not concern the voxels */
}

/* Reads header lines up to ElementDataFile, which is the last by definition. */
static status parse_header(struct metaimage *m, const char *path, FILE *file, struct error *err)
{
    char line[4096];
    while (!m->has_data && fgets(line, sizeof line, file) != NULL) {
        if (ftell(file) > VOLUME_HEADER_MAX_BYTES) break;
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
    const char *missing = !m->has_size   ? "DimSize"
                          : !m->has_type ? "ElementType"
                          : !m->has_data ? "ElementDataFile"
                                         : NULL;
    return missing == NULL ? STATUS_OK : bad(m, err, "the header lacks", missing);
}

static void metaimage_close(void *handle)
{
    struct metaimage *m = handle;
    if (m == NULL) return;
    volume_header_release(&m->header);
    free(m);
}

static status metaimage_open(const char *const *path, size_t n_path, void **handle, struct volume_source_info *info,
                             struct error *err)
{
    struct metaimage *m = calloc(1, sizeof *m);
    status s = STATUS_OK;
    if (m == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot read volume: out of memory");
    s = volume_header_init(&m->header, path[0], err);
    if (s != STATUS_OK) goto fail;
    m->spacing[0] = m->spacing[1] = m->spacing[2] = NAN;
    m->unit_m = 1e-3;
    FILE *header = fopen(path[0], "rbe");
    if (header == NULL) {
        s = error_set_errno_at(err, __func__, OPTION_SCAN_FILES, "cannot read volume '%s'", m->header.name);
        goto fail;
    }
    s = parse_header(m, path[0], header, err);
    if (s == STATUS_OK && m->is_local) m->header.layout.offset_bytes = ftell(header);
    if (m->header.layout.compressed && m->header.layout.offset_bytes < 0) m->header.layout.offset_bytes = 0;
    fclose(header);
    if (s == STATUS_OK && n_path > 1) /* uploads name the data file as well; other files are an error */
        for (size_t i = 1; i < n_path && s == STATUS_OK; i++)
            if (strcmp(path[i], m->header.data_path) != 0)
                s = bad(m, err, "its ElementDataFile is not", path_file_name(path[i]));
    if (s == STATUS_OK) s = volume_header_open_data(&m->header, err);
    if (s != STATUS_OK) goto fail;
    *info = (struct volume_source_info){.sample = sample_name(m->header.layout.sample)};
    memcpy(info->n, m->header.layout.n, sizeof info->n);
    for (int a = 0; a < 3; a++) info->voxel_size_m[a] = m->spacing[a] * m->unit_m;
    *handle = m;
    return STATUS_OK;
fail:
    metaimage_close(m);
    return s;
}

static status metaimage_read(void *handle, size_t i_slice, size_t n_slice, float *value, struct error *err)
{
    struct metaimage *m = handle;
    return voxel_stream_read(m->header.stream, i_slice, n_slice, value, err);
}

static bool metaimage_recognise(const uint8_t b[16], const char *path)
{
    const char *dot = strrchr(path, '.');
    if (dot != NULL && (strcasecmp(dot, ".mhd") == 0 || strcasecmp(dot, ".mha") == 0)) return true;
    return memcmp(b, "ObjectType", 10) == 0 || memcmp(b, "NDims", 5) == 0;
}

VOLUME_FORMAT(metaimage_reader, ".mhd, .mha", .ending = {".mhd", ".mha"}, .header_ending = ".mhd", .separator = '=',
              .data_key = {"ElementDataFile"})

const volume_reader metaimage_reader = {"metaimage.v1", "MetaImage",    metaimage_recognise,
                                        metaimage_open, metaimage_read, metaimage_close};
