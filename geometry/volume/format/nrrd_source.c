/* The NRRD format: a text header "field: value" that ends with an empty line, with the data after it (.nrrd) or in a
 * file beside it (.nhdr). Supported are scalars in three dimensions of space, besides channels and times, and the
 * encodings raw and gzip. Lengths come from "spacings" or from the lengths of "space directions", in the stated unit or
 * by default in millimetres.
 * Source: the definition of the NRRD file format (teem.sourceforge.net/nrrd/format.html). */
#include "base/files/durable.h"
#include "base/option_id.h"
#include "geometry/volume/format/nrrd_axes.h"
#include "geometry/volume/format/volume_reader.h"

#include <endian.h>
#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

struct nrrd {
    struct volume_header header; /* data_path: NULL until open_parsed where the data follows the header */
    struct nrrd_axes axes;
    struct volume_source_info info; /* its statements, and the padding */
    long long line_skip, byte_skip;
    bool has_type, has_endian, big_endian, has_encoding;
};

static status bad(const struct nrrd *m, struct error *err, const char *what, const char *value)
{
    return volume_header_refuse(&m->header, what, value, err);
}

static const struct {
    const char *name;
    enum sample_type type;
} type_name[] = {
    {"uchar", SAMPLE_UINT8},
    {"unsigned char", SAMPLE_UINT8},
    {"uint8", SAMPLE_UINT8},
    {"uint8_t", SAMPLE_UINT8},
    {"signed char", SAMPLE_INT8},
    {"int8", SAMPLE_INT8},
    {"int8_t", SAMPLE_INT8},
    {"ushort", SAMPLE_UINT16},
    {"unsigned short", SAMPLE_UINT16},
    {"unsigned short int", SAMPLE_UINT16},
    {"uint16", SAMPLE_UINT16},
    {"uint16_t", SAMPLE_UINT16},
    {"short", SAMPLE_INT16},
    {"short int", SAMPLE_INT16},
    {"signed short", SAMPLE_INT16},
    {"signed short int", SAMPLE_INT16},
    {"int16", SAMPLE_INT16},
    {"int16_t", SAMPLE_INT16},
    {"uint", SAMPLE_UINT32},
    {"unsigned int", SAMPLE_UINT32},
    {"uint32", SAMPLE_UINT32},
    {"uint32_t", SAMPLE_UINT32},
    {"int", SAMPLE_INT32},
    {"signed int", SAMPLE_INT32},
    {"int32", SAMPLE_INT32},
    {"int32_t", SAMPLE_INT32},
    {"float", SAMPLE_FLOAT32},
    {"double", SAMPLE_FLOAT64},
};

static status parse_type(struct nrrd *m, const char *value, struct error *err)
{
    for (size_t i = 0; i < sizeof type_name / sizeof *type_name; i++)
        if (strcasecmp(value, type_name[i].name) == 0) {
            m->header.layout.sample = type_name[i].type;
            m->has_type = true;
            return STATUS_OK;
        }
    return bad(m, err, "unsupported type", value);
}

static status parse_encoding(struct nrrd *m, const char *value, struct error *err)
{
    m->has_encoding = true;
    m->header.layout.compressed = strcasecmp(value, "gzip") == 0 || strcasecmp(value, "gz") == 0;
    if (m->header.layout.compressed || strcasecmp(value, "raw") == 0) return STATUS_OK;
    return error_set_field(err, STATUS_UNSUPPORTED, OPTION_SCAN_FILES,
                           "cannot read volume '%s': encoding '%.40s' is not supported; save it as raw or gzip",
                           m->header.name, value);
}

static status parse_endian(struct nrrd *m, const char *value, struct error *err)
{
    m->has_endian = true;
    m->big_endian = strcasecmp(value, "big") == 0;
    return m->big_endian || strcasecmp(value, "little") == 0 ? STATUS_OK
                                                             : bad(m, err, "endian must be little or big, not", value);
}

static status parse_skip(struct nrrd *m, const char *value, long long least, long long *skip, struct error *err)
{
    char *end;
    errno = 0;
    *skip = strtoll(value, &end, 10);
    if (end == value || *end != '\0' || errno != 0 || *skip < least || *skip > 1LL << 40)
        return bad(m, err, "a skip is not valid:", value);
    return STATUS_OK;
}

static status parse_field(struct nrrd *m, const char *path, const char *key, const char *value, struct error *err)
{
    if (strcasecmp(key, "type") == 0) return parse_type(m, value, err);
    if (strcasecmp(key, "encoding") == 0) return parse_encoding(m, value, err);
    if (strcasecmp(key, "endian") == 0) return parse_endian(m, value, err);
    if (strcasecmp(key, "data file") == 0 || strcasecmp(key, "datafile") == 0)
        return volume_header_data_file(&m->header, path, value, "the data file must be beside the header, not", err);
    if (strcasecmp(key, "line skip") == 0 || strcasecmp(key, "lineskip") == 0)
        return parse_skip(m, value, 0, &m->line_skip, err);
    if (strcasecmp(key, "byte skip") == 0 || strcasecmp(key, "byteskip") == 0)
        return parse_skip(m, value, -1, &m->byte_skip, err);
    return nrrd_axes_parse(&m->axes, &m->header, key, value, &m->info.ledger, err);
}

static status check_complete(const struct nrrd *m, struct error *err)
{
    const char *missing = m->axes.n == 0      ? "dimension"
                          : !m->axes.has_size ? "sizes"
                          : !m->has_type      ? "type"
                          : !m->has_encoding  ? "encoding"
                                              : NULL;
    if (missing == NULL && !m->has_endian && sample_bytes(m->header.layout.sample) > 1) missing = "endian";
    if (missing != NULL) return bad(m, err, "the header lacks", missing);
    if (m->header.layout.compressed && m->byte_skip < 0)
        return bad(m, err, "compressed data cannot have byte skip", "-1");
    return STATUS_OK;
}

/* Reads header lines up to the empty one, or to the end of a detached header. */
static status parse_header(struct nrrd *m, const char *path, FILE *file, struct error *err)
{
    char line[4096];
    bool ended = false;
    if (fgets(line, sizeof line, file) == NULL || strncmp(line, "NRRD000", 7) != 0)
        return bad(m, err, "it does not begin with", "NRRD000");
    while (!ended && fgets(line, sizeof line, file) != NULL) {
        size_t n = strlen(line);
        if (n + 1 == sizeof line || ftell(file) > VOLUME_HEADER_MAX_BYTES)
            return bad(m, err, "the header does not end within", "65536 bytes");
        while (n > 0 && strchr(" \t\r\n", line[n - 1]) != NULL) line[--n] = '\0';
        ended = n == 0;
        char *colon = strchr(line, ':');
        if (ended || line[0] == '#' || colon == NULL) continue;
        *colon = '\0';
        if (colon[1] == '=') nrrd_state_pair(&m->info, line, colon + 2);
        if (colon[1] == '=') continue;
        status s = parse_field(m, path, line, colon + 1 + strspn(colon + 1, " \t"), err);
        if (s != STATUS_OK) return s;
    }
    if (!ended && m->header.data_path == NULL)
        return bad(m, err, "no data: no empty line ends the header, and it names no", "data file");
    return check_complete(m, err);
}

/* Finds the offset of the data, after "line skip" lines. */
static status find_data(struct nrrd *m, FILE *header, struct error *err)
{
    FILE *file = header;
    if (m->header.data_path != NULL) file = fopen(m->header.data_path, "rbe");
    if (file == NULL) return STATUS_OK; /* voxel_stream_open reports the error */
    for (long long i = 0; i < m->line_skip; i++) {
        int c;
        do c = fgetc(file);
        while (c != '\n' && c != EOF);
        if (c == EOF) break;
    }
    m->header.layout.offset_bytes = ftello(file);
    status s = m->header.layout.offset_bytes >= 0
                   ? STATUS_OK
                   : error_set_errno_at(err, __func__, OPTION_SCAN_FILES, "cannot read volume '%s'", m->header.name);
    if (file != header) fclose(file);
    m->header.layout.skip_bytes = m->byte_skip > 0 ? m->byte_skip : 0;
    if (m->byte_skip == -1) m->header.layout.offset_bytes = -1;
    return s;
}

static void nrrd_close(void *handle)
{
    struct nrrd *m = handle;
    if (m == NULL) return;
    volume_header_release(&m->header);
    free(m);
}

static status open_parsed(struct nrrd *m, const char *const *path, size_t n_path, struct error *err)
{
    if (m->header.data_path == NULL) m->header.data_path = strdup(path[0]);
    if (m->header.data_path == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot read volume: out of memory");
    for (size_t i = 1; i < n_path; i++) /* uploads name the data file as well; other files are an error */
        if (strcmp(path[i], m->header.data_path) != 0)
            return bad(m, err, "its data file is not", path_file_name(path[i]));
    m->header.layout.swap = m->big_endian != (BYTE_ORDER == BIG_ENDIAN);
    return volume_header_open_data(&m->header, err);
}

static status nrrd_open(const char *const *path, size_t n_path, const struct volume_part *part, void **handle,
                        struct volume_source_info *info, struct error *err)
{
    struct nrrd *m = calloc(1, sizeof *m);
    if (m == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot read volume: out of memory");
    nrrd_axes_init(&m->axes);
    m->info = volume_source_info_empty();
    status s = volume_header_init(&m->header, path[0], err);
    FILE *header = s == STATUS_OK ? fopen(path[0], "rbe") : NULL;
    if (s == STATUS_OK && header == NULL)
        s = error_set_errno_at(err, __func__, OPTION_SCAN_FILES, "cannot read volume '%s'", m->header.name);
    if (s == STATUS_OK) s = parse_header(m, path[0], header, err);
    if (s == STATUS_OK) s = find_data(m, header, err);
    if (header != NULL) fclose(header);
    if (s == STATUS_OK) s = nrrd_axes_settle(&m->axes, &m->header, part, &m->info, err);
    if (s == STATUS_OK) s = open_parsed(m, path, n_path, err);
    if (s != STATUS_OK) {
        nrrd_close(m);
        return s;
    }
    *info = m->info;
    info->sample = sample_name(m->header.layout.sample);
    *handle = m;
    return STATUS_OK;
}

static status nrrd_read(void *handle, size_t i_slice, size_t n_slice, float *value, struct error *err)
{
    struct nrrd *m = handle;
    return voxel_stream_read(m->header.stream, i_slice, n_slice, value, err);
}

static bool nrrd_recognise(const uint8_t b[16], const char *path)
{
    (void)path;
    return memcmp(b, "NRRD000", 7) == 0;
}

VOLUME_FORMAT(nrrd_reader, ".nrrd, .nhdr", .ending = {".nrrd", ".nhdr"}, .header_ending = ".nhdr", .separator = ':',
              .data_key = {"data file", "datafile"})

const volume_reader nrrd_reader = {"nrrd.v1", "NRRD", nrrd_recognise, nrrd_open, nrrd_read, nrrd_close};
