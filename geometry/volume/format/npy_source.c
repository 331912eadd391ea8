/* The .npy format of NumPy: one array behind a header that is the text of a Python dictionary. Its index is [z, y, x],
 * as readers of pictures in Python have it, in either order of memory; an array in Fortran's order therefore has z as
 * its fastest axis. A fourth dimension is of channels.
 * Source: numpy.lib.format, versions 1.0 to 3.0 (numpy.org/doc/stable/reference/generated/numpy.lib.format.html). */
#include "base/option_id.h"
#include "geometry/volume/format/header_axes.h"
#include "geometry/volume/format/volume_reader.h"

#include <endian.h>
#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { NPY_MAX_DIMENSION = 8 };

struct npy {
    struct volume_header header;
    bool has_descr, has_order, has_shape, is_fortran;
    size_t n, shape[NPY_MAX_DIMENSION]; /* the slowest first in C's order */
};

/* value: text of the header, shown up to the end of its first bracket or line */
static status bad(const struct npy *m, const char *what, const char *value, struct error *err)
{
    char shown[80];
    size_t n = strcspn(value, ")]\n");
    if (value[n] == ')' || value[n] == ']') n++;
    snprintf(shown, sizeof shown, "%.*s", (int)n, value);
    return volume_header_refuse(&m->header, what, shown, err);
}

static const char *after_blanks(const char *p) { return p + strspn(p, " \t\n"); }

/* "<u2": byte order, kind and bytes. */
static status parse_type(struct npy *m, const char *text, struct error *err)
{
    static const struct {
        const char *name;
        enum sample_type type;
    } known[] = {{"b1", SAMPLE_UINT8},  {"u1", SAMPLE_UINT8},   {"i1", SAMPLE_INT8},
                 {"u2", SAMPLE_UINT16}, {"i2", SAMPLE_INT16},   {"u4", SAMPLE_UINT32},
                 {"i4", SAMPLE_INT32},  {"f4", SAMPLE_FLOAT32}, {"f8", SAMPLE_FLOAT64}};
    if (strpbrk(text, "cOUSVMm") != NULL)
        return bad(m, "complex numbers, text, times and objects are no values of a scan: its type is", text, err);
    for (size_t i = 0; i < sizeof known / sizeof *known; i++)
        if (text[0] != '\0' && strchr("<>|=", text[0]) != NULL && strcmp(text + 1, known[i].name) == 0) {
            m->header.layout.sample = known[i].type;
            m->header.layout.swap = text[0] == (BYTE_ORDER == BIG_ENDIAN ? '<' : '>');
            m->has_descr = true;
            return STATUS_OK;
        }
    return bad(m, "save it by astype('float32'), because no reader knows values of type", text, err);
}

static status parse_descr(struct npy *m, const char **at, struct error *err)
{
    char text[32] = "";
    const char quote = **at;
    if (quote == '[' || quote == '(') return bad(m, "its values are records of several fields:", *at, err);
    const char *end = quote == '\'' || quote == '"' ? strchr(*at + 1, quote) : NULL;
    const size_t n = end != NULL ? (size_t)(end - *at - 1) : sizeof text;
    if (n >= sizeof text) return bad(m, "its 'descr' is no type:", *at, err);
    memcpy(text, *at + 1, n);
    *at = end + 1;
    return parse_type(m, text, err);
}

static status parse_order(struct npy *m, const char **at, struct error *err)
{
    m->is_fortran = strncmp(*at, "True", 4) == 0;
    if (!m->is_fortran && strncmp(*at, "False", 5) != 0)
        return bad(m, "its 'fortran_order' is neither True nor False:", *at, err);
    *at += m->is_fortran ? 4 : 5;
    m->has_order = true;
    return STATUS_OK;
}

/* "(3, 4, 5)", where the last number may end in a comma. */
static status parse_shape(struct npy *m, const char **at, struct error *err)
{
    const char *p = *at, *complaint = "its 'shape' is not three edges from 1 to 1048576:";
    if (*p++ != '(') return bad(m, complaint, *at, err);
    for (p = after_blanks(p); *p != ')'; p = after_blanks(p)) {
        char *end;
        errno = 0;
        const unsigned long long edge = strtoull(p, &end, 10);
        if (*p < '0' || *p > '9' || errno != 0 || edge == 0 || edge > VOXEL_STREAM_MAX_EDGE ||
            m->n == NPY_MAX_DIMENSION)
            return bad(m, complaint, *at, err);
        m->shape[m->n++] = (size_t)edge;
        p = after_blanks(*end == 'L' ? end + 1 : end); /* Python 2 ended long numbers in L */
        if (*p == ',')
            p++;
        else if (*p != ')')
            return bad(m, complaint, *at, err);
    }
    if (m->n < 3 || m->n > 5) return bad(m, complaint, *at, err);
    *at = p + 1;
    m->has_shape = true;
    return STATUS_OK;
}

static status parse_dictionary(struct npy *m, const char *text, struct error *err)
{
    static const struct {
        const char *key;
        status (*parse)(struct npy *m, const char **at, struct error *err);
    } entry[] = {{"descr", parse_descr}, {"fortran_order", parse_order}, {"shape", parse_shape}};
    const char *p = after_blanks(text);
    if (*p++ != '{') return bad(m, "its header is no dictionary:", text, err);
    for (p = after_blanks(p); *p != '}'; p = after_blanks(p)) {
        const char quote = *p, *end = quote == '\'' || quote == '"' ? strchr(p + 1, quote) : NULL;
        const char *colon = end != NULL ? after_blanks(end + 1) : "";
        status s = STATUS_FORMAT;
        size_t i = 0;
        while (
            end != NULL && i < 3 &&
            (strlen(entry[i].key) != (size_t)(end - p - 1) || strncmp(entry[i].key, p + 1, strlen(entry[i].key)) != 0))
            i++;
        if (end == NULL || i == 3 || *colon != ':') return bad(m, "its header is not understood at", p, err);
        p = after_blanks(colon + 1);
        m->n = entry[i].parse == parse_shape ? 0 : m->n;
        s = entry[i].parse(m, &p, err);
        if (s != STATUS_OK) return s;
        p = after_blanks(p);
        if (*p == ',') p++;
    }
    const char *missing = !m->has_descr ? "descr" : !m->has_order ? "fortran_order" : !m->has_shape ? "shape" : NULL;
    return missing == NULL ? STATUS_OK : bad(m, "the header lacks", missing, err);
}

/* Reads the header: 6 bytes of magic, two of version, its length in 2 or 4 bytes, then the text. */
static status read_header(struct npy *m, const char *path, struct error *err)
{
    uint8_t begin[12] = {0};
    char *text = NULL;
    status s = STATUS_OK;
    FILE *file = fopen(path, "rbe");
    if (file == NULL)
        return error_set_errno_at(err, __func__, OPTION_SCAN_FILES, "cannot read volume '%s'", m->header.name);
    bool whole = fread(begin, 1, 8, file) == 8 && memcmp(begin, "\x93NUMPY", 6) == 0;
    const size_t n_length = begin[6] == 1 ? 2 : 4;
    if (whole && (begin[6] < 1 || begin[6] > 3)) {
        fclose(file);
        return bad(m, "the version of its format is not 1, 2 or 3, but", (char[4]){(char)('0' + begin[6] % 10)}, err);
    }
    whole = whole && fread(begin + 8, 1, n_length, file) == n_length;
    size_t n = 0;
    for (size_t i = n_length; i-- > 0;) n = n << 8 | begin[8 + i];
    if (whole && n <= VOLUME_HEADER_MAX_BYTES) text = calloc(1, n + 1);
    whole = text != NULL && fread(text, 1, n, file) == n;
    if (!whole)
        s = error_set_field(err, STATUS_FORMAT, OPTION_SCAN_FILES,
                            "cannot read volume '%s': its header is cut off or longer than %d bytes", m->header.name,
                            VOLUME_HEADER_MAX_BYTES);
    else
        s = parse_dictionary(m, text, err);
    m->header.layout.offset_bytes = (long long)(8 + n_length + n);
    free(text);
    fclose(file);
    return s;
}

static status settle(struct npy *m, const struct volume_part *part, struct volume_source_info *info, struct error *err)
{
    struct header_axes axes = {.n = m->n, .source = "its shape"};
    if (m->is_fortran && m->n > 3)
        return bad(m, "it has more than three dimensions: save it by numpy.ascontiguousarray, because it is in",
                   "Fortran order", err);
    for (size_t a = 0; a < m->n; a++) {
        axes.size[a] = m->shape[m->is_fortran ? a : m->n - 1 - a];
        axes.spacing_m[a] = NAN;
    }
    *info = volume_source_info_empty();
    info->sample = sample_name(m->header.layout.sample);
    status s = header_axes_settle(&axes, &m->header, part, info, err);
    if (s == STATUS_OK && m->is_fortran) {
        memcpy(info->axes, "zyx", 4);
        file_ledger_add(&info->ledger, "directions of axes", NULL, "zyx (an array [z, y, x] in Fortran's order)");
    }
    return s;
}

static void npy_close(void *handle)
{
    if (handle != NULL) volume_header_release(handle);
    free(handle);
}

static status npy_open(const char *const *path, size_t n_path, const struct volume_part *part, void **handle,
                       struct volume_source_info *info, struct error *err)
{
    struct npy *m = calloc(1, sizeof *m);
    if (m == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot read volume: out of memory");
    status s = volume_header_init(&m->header, path[0], err);
    if (s == STATUS_OK && n_path > 1) s = bad(m, "it is one file, and there is also", path[1], err);
    if (s == STATUS_OK) s = read_header(m, path[0], err);
    if (s == STATUS_OK) s = settle(m, part, info, err);
    if (s == STATUS_OK) s = volume_header_data_file(&m->header, path[0], m->header.name, "its name is", err);
    if (s == STATUS_OK) s = volume_header_open_data(&m->header, err);
    if (s == STATUS_OK)
        *handle = m;
    else
        npy_close(m);
    return s;
}

static status npy_read(void *handle, size_t i_slice, size_t n_slice, float *value, struct error *err)
{
    return voxel_stream_read(((struct npy *)handle)->header.stream, i_slice, n_slice, value, err);
}

static bool npy_recognise(const uint8_t b[16], const char *path)
{
    (void)path;
    return memcmp(b, "\x93NUMPY", 6) == 0;
}

VOLUME_FORMAT(npy_reader, ".npy", .ending = {".npy"})

const volume_reader npy_reader = {"npy.v1", "NumPy", npy_recognise, npy_open, npy_read, npy_close};
