/* The MetaImage format: a text header "Key = value" (.mhd) with the data in a file beside it, or header and data in
 * one file (.mha, ElementDataFile = LOCAL). Lengths are in DistanceUnits, by default millimetres. Compressed data is
 * zlib's. Source: the MetaIO documentation (itk.org/Wiki/MetaIO). */
#include "base/files/durable.h"
#include "base/option_id.h"
#include "geometry/volume/format/header_axes.h"
#include "geometry/volume/format/length_unit.h"
#include "geometry/volume/format/volume_reader.h"

#include <endian.h>
#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

struct metaimage {
    struct volume_header header;
    struct header_axes axes; /* without channels; lengths in the unit, no directions */
    double direction[4][4];  /* a row for each axis */
    double unit_m;           /* metres per unit of spacing */
    size_t n_channel;
    struct file_ledger ledger; /* statements that do not concern the axes */
    bool is_local, has_type, has_size, has_spacing, has_data;
};

static status bad(const struct metaimage *m, struct error *err, const char *what, const char *value)
{
    return volume_header_refuse(&m->header, what, value, err);
}

/* Lists of numbers have one for each axis, and the axes come first in a header. */
static status parse_dimensions(struct metaimage *m, const char *value, struct error *err)
{
    m->axes.n = strcmp(value, "4") == 0 ? 4 : 3;
    return m->axes.n == 4 || strcmp(value, "3") == 0 ? STATUS_OK : bad(m, err, "NDims must be 3 or 4, not", value);
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
    return volume_header_sizes(&m->header, value, m->axes.n, m->axes.size,
                               "DimSize is not three positive numbers, or one for each axis:", &end, err);
}

static status parse_numbers(const struct metaimage *m, const char *value, size_t n, double *number,
                            const char *complaint, struct error *err)
{
    const char *p = value;
    for (size_t i = 0; i < n; i++) {
        char *end;
        number[i] = strtod(p, &end);
        if (end == p || !isfinite(number[i])) return bad(m, err, complaint, value);
        p = end;
    }
    return STATUS_OK;
}

static status parse_spacing(struct metaimage *m, const char *value, struct error *err)
{
    static const char complaint[] = "ElementSpacing is not three positive numbers:";
    status s = parse_numbers(m, value, m->axes.n, m->axes.spacing_m, complaint, err);
    for (size_t a = 0; a < 3 && s == STATUS_OK; a++)
        if (!(m->axes.spacing_m[a] > 0.0)) return bad(m, err, complaint, value);
    m->has_spacing = true;
    return s;
}

/* "TransformMatrix = 1 0 0 0 1 0 0 0 -1": a row for each axis of the file, where it points. */
static status parse_matrix(struct metaimage *m, const char *value, struct error *err)
{
    double number[16];
    const size_t n = m->axes.n;
    status s = parse_numbers(m, value, n * n, number, "TransformMatrix is not a square of numbers:", err);
    for (size_t a = 0; a < n && s == STATUS_OK; a++) {
        memcpy(m->direction[a], number + a * n, n * sizeof *number);
        const double *d = m->direction[a];
        if (a < 3 && !(d[0] * d[0] + d[1] * d[1] + d[2] * d[2] > 0.0))
            return bad(m, err, "a row of TransformMatrix has no length:", value);
    }
    m->axes.has_direction = true;
    return s;
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

static status parse_channels(struct metaimage *m, const char *value, struct error *err)
{
    char *end;
    const long n = strtol(value, &end, 10);
    if (end == value || *end != '\0' || n < 1 || n > 64)
        return bad(m, err, "ElementNumberOfChannels is not a number from 1 to 64:", value);
    m->n_channel = (size_t)n;
    return STATUS_OK;
}

/* Statements about the voxels that have no use here; other keys do not concern the voxels. */
static void state_other(struct file_ledger *ledger, const char *key, const char *value)
{
    static const struct {
        const char *key, *name, *reason;
    } known[] = {{"Offset", "origin", "the cloth begins at the corner of the scan"},
                 {"Position", "origin", "the cloth begins at the corner of the scan"},
                 {"Origin", "origin", "the cloth begins at the corner of the scan"},
                 {"AnatomicalOrientation", "anatomical orientation", "cloth has none"},
                 {"ElementMin", "smallest value", "void and solid come from the histogram"},
                 {"ElementMax", "largest value", "void and solid come from the histogram"},
                 {"ElementToIntensityFunctionSlope", "slope of values", "void and solid come from the histogram"},
                 {"ElementToIntensityFunctionOffset", "offset of values", "void and solid come from the histogram"}};
    for (size_t i = 0; i < sizeof known / sizeof *known; i++)
        if (strcmp(key, known[i].key) == 0) file_ledger_add(ledger, known[i].name, known[i].reason, "%s", value);
}

static status parse_line(struct metaimage *m, const char *header_path, const char *key, const char *value,
                         struct error *err)
{
    if (strcmp(key, "NDims") == 0) return parse_dimensions(m, value, err);
    if (strcmp(key, "DimSize") == 0) return parse_size(m, value, err);
    if (strcmp(key, "ElementType") == 0) return parse_element(m, value, err);
    if (strcmp(key, "ElementSpacing") == 0) return parse_spacing(m, value, err);
    if (strcmp(key, "ElementSize") == 0) return m->has_spacing ? STATUS_OK : parse_spacing(m, value, err);
    if (strcmp(key, "TransformMatrix") == 0 || strcmp(key, "Rotation") == 0 || strcmp(key, "Orientation") == 0)
        return parse_matrix(m, value, err);
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
    if (strcmp(key, "ElementNumberOfChannels") == 0) return parse_channels(m, value, err);
    if (strcmp(key, "HeaderSize") == 0) {
        char *end;
        m->header.layout.offset_bytes = strtoll(value, &end, 10);
        return end != value && m->header.layout.offset_bytes >= -1 ? STATUS_OK
                                                                   : bad(m, err, "HeaderSize is not valid:", value);
    }
    if (strcmp(key, "ElementDataFile") == 0) return parse_data_file(m, header_path, value, err);
    state_other(&m->ledger, key, value);
    return STATUS_OK;
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

/* The axes of the file: channels first, then the axes of the header, with the fourth as times. */
static status settle_axes(struct metaimage *m, const struct volume_part *part, struct volume_source_info *info,
                          struct error *err)
{
    struct header_axes all = {.has_direction = m->axes.has_direction, .source = "its header"};
    if (m->n_channel > 1) {
        all.size[0] = m->n_channel;
        all.kind[0] = AXIS_CHANNEL;
        all.n = 1;
    }
    for (size_t a = 0; a < m->axes.n; a++, all.n++) {
        all.size[all.n] = m->axes.size[a];
        all.kind[all.n] = a < 3 ? AXIS_SPACE : AXIS_TIME;
        all.spacing_m[all.n] = m->has_spacing ? m->axes.spacing_m[a] * m->unit_m : NAN;
        memcpy(all.direction[all.n], m->direction[a], sizeof all.direction[all.n]);
    }
    *info = volume_source_info_empty();
    info->sample = sample_name(m->header.layout.sample);
    info->ledger = m->ledger;
    return header_axes_settle(&all, &m->header, part, info, err);
}

static status read_header(struct metaimage *m, const char *path, struct error *err)
{
    FILE *header = fopen(path, "rbe");
    if (header == NULL)
        return error_set_errno_at(err, __func__, OPTION_SCAN_FILES, "cannot read volume '%s'", m->header.name);
    status s = parse_header(m, path, header, err);
    if (s == STATUS_OK && m->is_local) m->header.layout.offset_bytes = ftell(header);
    if (m->header.layout.compressed && m->header.layout.offset_bytes < 0) m->header.layout.offset_bytes = 0;
    fclose(header);
    return s;
}

static status metaimage_open(const char *const *path, size_t n_path, const struct volume_part *part, void **handle,
                             struct volume_source_info *info, struct error *err)
{
    struct metaimage *m = calloc(1, sizeof *m);
    if (m == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot read volume: out of memory");
    m->unit_m = 1e-3;
    m->axes.n = 3;
    status s = volume_header_init(&m->header, path[0], err);
    if (s == STATUS_OK) s = read_header(m, path[0], err);
    for (size_t i = 1; i < n_path && s == STATUS_OK; i++) /* uploads name the data file as well */
        if (strcmp(path[i], m->header.data_path) != 0)
            s = bad(m, err, "its ElementDataFile is not", path_file_name(path[i]));
    if (s == STATUS_OK) s = settle_axes(m, part, info, err);
    if (s == STATUS_OK) s = volume_header_open_data(&m->header, err);
    if (s == STATUS_OK)
        *handle = m;
    else
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
