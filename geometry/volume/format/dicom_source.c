/* DICOM: a file for each slice, or one with several frames, without compression. Slices are ordered by their positions
 * along the normal of the picture, else by InstanceNumber, never by names. Space is the frame of the patient (left,
 * posterior, superior), which is right-handed; its axes are the axes of the cloth. Source: dicom_file.h. */
#include "base/files/durable.h"
#include "base/option_id.h"
#include "geometry/volume/format/dicom_file.h"
#include "geometry/volume/format/header_axes.h"
#include "geometry/volume/format/volume_reader.h"

#include <endian.h>
#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

struct dicom_slice {
    size_t i_path;
    long long offset;
    double place, position[3]; /* millimetres along the normal, or InstanceNumber */
    double slope, inter;
};

struct dicom {
    struct volume_header header; /* its name, and the layout as header_axes.h finds it */
    struct dicom_file first;
    char **path;
    size_t n_path, n_slice;
    struct dicom_slice *slice;
    bool has_positions, has_scale, has_scales, has_paddings; /* several of them */
    FILE *file;
    size_t i_open; /* path of `file` */
    void *buffer;
};

static const char *name_of(const struct dicom *m, size_t i) { return path_file_name(m->path[m->slice[i].i_path]); }

/* Positions are often rounded, to thousandths of a millimetre. Shares of the distance of slices: */
static const double MOST_DISTANCE = 1.75, MOST_OFF_LINE = 0.6;

static status refuse(const char *name, const char *text, struct error *err)
{
    return error_set_field(err, STATUS_FORMAT, OPTION_SCAN_FILES, "cannot read volume '%s': %s", name, text);
}

static double normal_component(const double d[6], const double p[3])
{
    return (d[1] * d[5] - d[2] * d[4]) * p[0] + (d[2] * d[3] - d[0] * d[5]) * p[1] + (d[0] * d[4] - d[1] * d[3]) * p[2];
}

static bool differs(const double *a, const double *b, size_t n)
{
    for (size_t i = 0; i < n; i++)
        if (isnan(a[i]) != isnan(b[i]) || fabs(a[i] - b[i]) > 1e-4) return true;
    return false;
}

static status compare(const struct dicom *m, const struct dicom_file *f, const char *name, struct error *err)
{
    const struct dicom_file *one = &m->first;
    if (strcmp(one->series, f->series) != 0)
        return error_set_field(
            err, STATUS_INVALID, OPTION_SCAN_FILES,
            "cannot read volume '%s': the files are of several series: '%s' is of '%s', '%s' of '%s': "
            "name those of one",
            name, m->header.name, one->series, name, f->series);
    if (one->rows != f->rows || one->columns != f->columns)
        return error_set_field(err, STATUS_FORMAT, OPTION_SCAN_FILES,
                               "cannot read volume '%s': it has %zu x %zu pixels, and '%s' has %zu x %zu", name,
                               f->columns, f->rows, m->header.name, one->columns, one->rows);
    if (one->bits_allocated != f->bits_allocated || one->bits_stored != f->bits_stored ||
        one->is_signed != f->is_signed || one->big != f->big || strcmp(one->photometric, f->photometric) != 0)
        return refuse(name, "its samples are of another type than those of the first file", err);
    if (differs(one->direction, f->direction, 6) || differs(one->spacing_mm, f->spacing_mm, 2))
        return refuse(name, "its directions or distances of pixels are others than those of the first file", err);
    return STATUS_OK;
}

/* Adds the frames of a file. */
static status add_frames(struct dicom *m, size_t i_path, const struct dicom_file *f, struct error *err)
{
    const char *name = path_file_name(m->path[i_path]);
    const bool placed = f->n_position == f->n_frame && !isnan(f->direction[5]);
    const size_t bytes = f->rows * f->columns * (f->bits_allocated / 8);
    void *more = realloc(m->slice, (m->n_slice + f->n_frame) * sizeof *m->slice);
    if (more == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot read volume '%s': out of memory", name);
    m->slice = more;
    if (i_path == 0) m->has_positions = placed;
    if (m->has_positions != placed) return refuse(name, "unlike the first file, it states no position, or one", err);
    if (!placed && m->n_path > 1 && (isnan(f->instance) || f->n_frame > 1))
        return refuse(name, "it states neither a position nor an InstanceNumber, so the slices have no order", err);
    for (size_t k = 0; k < f->n_frame; k++) {
        struct dicom_slice *s = &m->slice[m->n_slice++];
        *s = (struct dicom_slice){.i_path = i_path, .offset = f->pixel_offset + (long long)(k * bytes)};
        s->slope = isnan(f->slope) || f->slope == 0.0 ? 1.0 : f->slope;
        s->inter = isnan(f->inter) ? 0.0 : f->inter;
        m->has_scale = m->has_scale || s->slope != 1.0 || s->inter != 0.0;
        m->has_scales = m->has_scales || s->slope != m->slice[0].slope || s->inter != m->slice[0].inter;
        if (placed) memcpy(s->position, f->position[k], sizeof s->position);
        s->place = placed ? normal_component(f->direction, s->position) : m->n_path > 1 ? f->instance : (double)k;
    }
    return STATUS_OK;
}

static status read_files(struct dicom *m, struct error *err)
{
    status s = STATUS_OK;
    for (size_t i = 0; i < m->n_path && s == STATUS_OK; i++) {
        struct dicom_file f;
        const char *name = path_file_name(m->path[i]);
        s = dicom_file_read(&f, m->path[i], name, err);
        if (s == STATUS_OK && i > 0) s = compare(m, &f, name, err);
        if (s == STATUS_OK) s = add_frames(m, i, &f, err);
        if (s == STATUS_OK && i > 0)
            m->has_paddings = m->has_paddings || differs(&f.padding, &m->first.padding, 1) ||
                              differs(&f.padding_limit, &m->first.padding_limit, 1);
        if (s == STATUS_OK && i == 0) {
            m->first = f;
            m->first.position = NULL; /* the slices have them */
        }
        dicom_file_release(&f);
    }
    return s;
}

static int by_place(const void *a, const void *b)
{
    const double x = ((const struct dicom_slice *)a)->place, y = ((const struct dicom_slice *)b)->place;
    return (x > y) - (x < y);
}

/* Checks that positions lie on the line from the first to the last one, and returns the length of its step. */
static status check_line(const struct dicom *m, double *step, struct error *err)
{
    const size_t last = m->n_slice - 1;
    const double *begin = m->slice[0].position, *end = m->slice[last].position;
    double d[3], square = 0.0;
    for (int a = 0; a < 3; a++) {
        d[a] = (end[a] - begin[a]) / (double)last;
        square += d[a] * d[a];
    }
    *step = sqrt(square);
    for (size_t i = 1; i < last; i++)
        for (int a = 0; a < 3; a++)
            if (fabs(m->slice[i].position[a] - begin[a] - (double)i * d[a]) > MOST_OFF_LINE * *step)
                return error_set_field(err, STATUS_INVALID, OPTION_SCAN_FILES,
                                       "cannot read volume '%s': its position is not on the line of the other slices",
                                       name_of(m, i));
    return STATUS_OK;
}

/* Sorts the slices and checks their distances, which are returned in *step: NaN for one slice. */
static status sort_slices(struct dicom *m, double *step, struct error *err)
{
    const size_t n = m->n_slice;
    *step = n > 1 ? INFINITY : NAN;
    qsort(m->slice, n, sizeof *m->slice, by_place);
    for (size_t i = 1; i < n; i++) {
        const double gap = m->slice[i].place - m->slice[i - 1].place;
        if (!(gap > 1e-9))
            return error_set_field(err, STATUS_INVALID, OPTION_SCAN_FILES,
                                   "cannot read volume '%s': '%s' is at the same place (%.6g)", name_of(m, i - 1),
                                   name_of(m, i), m->slice[i].place);
        *step = fmin(*step, gap);
    }
    for (size_t i = 1; i < n; i++) {
        const double gap = m->slice[i].place - m->slice[i - 1].place;
        if (gap > *step * MOST_DISTANCE)
            return error_set_field(
                err, STATUS_INVALID, OPTION_SCAN_FILES,
                "cannot read volume '%s': slices are missing between it and '%s': they are %.6g apart, "
                "others %.6g",
                name_of(m, i - 1), name_of(m, i), gap, *step);
    }
    if (n > 1) *step = (m->slice[n - 1].place - m->slice[0].place) / (double)(n - 1);
    return n > 1 && m->has_positions ? check_line(m, step, err) : STATUS_OK;
}

static double scaled(const struct dicom *m, const struct dicom_slice *s, double v)
{
    const bool inverted = strcmp(m->first.photometric, "MONOCHROME1") == 0;
    if (inverted) v = (m->first.is_signed ? -1.0 : ldexp(1.0, (int)m->first.bits_stored) - 1.0) - v;
    return s->slope * v + s->inter;
}

static void state(const struct dicom *m, struct volume_source_info *info, double step)
{
    struct file_ledger *ledger = &info->ledger;
    const struct dicom_file *f = &m->first;
    const size_t last = m->n_slice - 1;
    file_ledger_add(ledger, "order of slices", NULL, "by %s: '%.24s' to '%.24s'",
                    m->has_positions ? "position"
                    : m->n_path > 1  ? "InstanceNumber"
                                     : "frame",
                    name_of(m, 0), name_of(m, last));
    if (strcmp(f->photometric, "MONOCHROME1") == 0)
        file_ledger_add(ledger, "photometric sense", NULL, "MONOCHROME1: values are inverted");
    if (f->bits_stored < f->bits_allocated)
        file_ledger_add(ledger, "significant bits", NULL, "%zu of %zu", f->bits_stored, f->bits_allocated);
    if (m->has_scales)
        file_ledger_add(ledger, "scale of values", NULL, "of each file, of the first %.6g x value + %.6g",
                        m->slice[0].slope, m->slice[0].inter);
    else if (m->has_scale)
        file_ledger_add(ledger, "scale of values", NULL, "%.6g x value + %.6g", m->slice[0].slope, m->slice[0].inter);
    if (!isnan(f->thickness_mm))
        file_ledger_add(ledger, "thickness of slices", "only distances count", "%.6g mm", f->thickness_mm);
    if (m->has_positions && m->n_slice > 1 && !isnan(f->between_slices_mm))
        file_ledger_add(ledger, "distance of slices",
                        fabs(f->between_slices_mm - step) < 0.01 * step ? NULL : "their positions come first",
                        "%.6g mm", f->between_slices_mm);
    if (f->description[0] != '\0') file_ledger_add(ledger, "description", "text for people", "%s", f->description);
    if (m->has_positions)
        file_ledger_add(ledger, "origin", "the cloth begins at the corner of the scan", "%.6g %.6g %.6g",
                        m->slice[0].position[0], m->slice[0].position[1], m->slice[0].position[2]);
}

/* What is no statement on the place of slices. */
static void state_rest(const struct dicom *m, struct volume_source_info *info)
{
    struct file_ledger *ledger = &info->ledger;
    const struct dicom_file *f = &m->first;
    if (m->has_paddings || (m->has_scales && !isnan(f->padding)))
        file_ledger_add(ledger, "padding value", "it differs among the files", "%.6g in the first", f->padding);
    else if (!isnan(f->padding) && !isnan(f->padding_limit) && f->padding_limit != f->padding)
        file_ledger_add(ledger, "padding value", "one value can be unknown, no range", "%.6g to %.6g", f->padding,
                        f->padding_limit);
    else if (!isnan(f->padding))
        info->padding = scaled(m, &m->slice[0], f->padding);
    if (!isnan(f->window_center) || !isnan(f->window_width))
        file_ledger_add(ledger, "range of display", "densities come from the histogram", "center %.6g, width %.6g",
                        f->window_center, f->window_width);
    if (!isnan(f->detector_mm[0]))
        file_ledger_add(ledger, "pixels of the detector", "they are no voxels", "%.6g x %.6g mm", f->detector_mm[1],
                        f->detector_mm[0]);
    if (f->is_lossy) file_ledger_add(ledger, "lossy compression", "its values are read as they are", "once");
    if (f->modality[0] != '\0') file_ledger_add(ledger, "modality", "all values are densities", "%s", f->modality);
}

/* The axes: columns, rows, and slices from the first to the last. */
static status settle(struct dicom *m, double step, const struct volume_part *part, struct volume_source_info *info,
                     struct error *err)
{
    static const char *const type[2][3] = {{"uint8", "uint16", "uint32"}, {"int8", "int16", "int32"}};
    const struct dicom_file *f = &m->first;
    const double *d = f->direction, *p = m->slice[0].position, *q = m->slice[m->n_slice - 1].position;
    const bool is_placed = m->has_positions && m->n_slice > 1;
    struct header_axes axes = {.n = 3, .size = {f->columns, f->rows, m->n_slice}, .source = "its header"};
    double between = is_placed ? step : f->between_slices_mm;
    for (int a = 0; a < 3; a++) axes.kind[a] = AXIS_SPACE;
    axes.spacing_m[0] = 1e-3 * f->spacing_mm[1];
    axes.spacing_m[1] = 1e-3 * f->spacing_mm[0];
    axes.spacing_m[2] = 1e-3 * between;
    axes.has_direction = !isnan(d[5]);
    for (int w = 0; w < 3 && axes.has_direction; w++) {
        const double unit[3] = {w == 0, w == 1, w == 2};
        axes.direction[0][w] = d[w];
        axes.direction[1][w] = d[3 + w];
        axes.direction[2][w] = is_placed ? q[w] - p[w] : normal_component(d, unit);
    }
    *info = volume_source_info_empty();
    info->sample = type[f->is_signed][f->bits_allocated == 8 ? 0 : f->bits_allocated == 16 ? 1 : 2];
    state(m, info, step);
    state_rest(m, info);
    if (isnan(between) && !isnan(f->spacing_mm[0])) {
        for (int a = 0; a < 3; a++) axes.spacing_m[a] = NAN;
        file_ledger_add(&info->ledger, "voxel size", "the distance of the slices is not stated", "%.6g x %.6g mm",
                        f->spacing_mm[1], f->spacing_mm[0]);
    }
    for (int a = 0; a < 2 && axes.has_direction; a++) {
        const double *v = axes.direction[a];
        if (!(fabs(v[0] * v[0] + v[1] * v[1] + v[2] * v[2] - 1.0) < 1e-2))
            return refuse(m->header.name, "its directions of columns and rows are no unit vectors", err);
    }
    return header_axes_settle(&axes, &m->header, part, info, err);
}

static void dicom_close(void *handle)
{
    struct dicom *m = handle;
    if (m == NULL) return;
    for (size_t i = 0; i < m->n_path; i++) free(m->path[i]);
    free(m->path);
    free(m->slice);
    free(m->buffer);
    if (m->file != NULL) fclose(m->file);
    volume_header_release(&m->header);
    free(m);
}

static status start(struct dicom *m, const char *const *path, size_t n_path, struct error *err)
{
    status s = volume_header_init(&m->header, path[0], err);
    m->i_open = SIZE_MAX;
    m->path = calloc(n_path, sizeof *m->path);
    for (size_t i = 0; i < n_path && m->path != NULL; i++) {
        m->path[i] = strdup(path[i]);
        if (m->path[i] == NULL) break;
        m->n_path++;
    }
    return s == STATUS_OK && m->n_path < n_path ? error_set(err, STATUS_NO_MEMORY, "cannot read volume: out of memory")
                                                : s;
}

static status dicom_open(const char *const *path, size_t n_path, const struct volume_part *part, void **handle,
                         struct volume_source_info *info, struct error *err)
{
    double step = NAN;
    struct dicom *m = calloc(1, sizeof *m);
    if (m == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot read volume: out of memory");
    status s = start(m, path, n_path, err);
    if (s == STATUS_OK) s = read_files(m, err);
    if (s == STATUS_OK) s = sort_slices(m, &step, err);
    if (s == STATUS_OK) s = settle(m, step, part, info, err);
    if (s == STATUS_OK) m->buffer = malloc(m->first.rows * m->first.columns * (m->first.bits_allocated / 8));
    if (s == STATUS_OK && m->buffer == NULL) s = error_set(err, STATUS_NO_MEMORY, "cannot read volume: out of memory");
    if (s == STATUS_OK)
        *handle = m;
    else
        dicom_close(m);
    return s;
}

/* Converts samples, whose lowest bits_stored bits count. */
static void convert(const struct dicom *m, const struct dicom_slice *s, float *value)
{
    const struct dicom_file *f = &m->first;
    const size_t bytes = f->bits_allocated / 8, n = f->rows * f->columns;
    const uint8_t *b = m->buffer;
    const uint32_t mask = f->bits_stored == 32 ? UINT32_MAX : (1u << f->bits_stored) - 1,
                   sign = 1u << (f->bits_stored - 1);
    for (size_t i = 0; i < n; i++, b += bytes) {
        uint32_t u = 0;
        for (size_t k = 0; k < bytes; k++) u |= (uint32_t)b[k] << 8 * (f->big ? bytes - 1 - k : k);
        u &= mask;
        value[i] = (float)scaled(m, s, f->is_signed ? (double)(int32_t)((u ^ sign) - sign) : (double)u);
    }
}

static status dicom_read(void *handle, size_t i_slice, size_t n_slice, float *value, struct error *err)
{
    struct dicom *m = handle;
    const size_t n = m->first.rows * m->first.columns, bytes = n * (m->first.bits_allocated / 8);
    for (size_t i = i_slice; i < i_slice + n_slice; i++, value += n) {
        const struct dicom_slice *s = &m->slice[i];
        if (m->file == NULL || m->i_open != s->i_path) {
            if (m->file != NULL) fclose(m->file);
            m->file = fopen(m->path[s->i_path], "rbe");
            m->i_open = s->i_path;
        }
        if (m->file == NULL || fseeko(m->file, s->offset, SEEK_SET) != 0 ||
            fread(m->buffer, 1, bytes, m->file) != bytes)
            return refuse(name_of(m, i), "it ends within its samples", err);
        convert(m, s, value);
    }
    return STATUS_OK;
}

static bool dicom_recognise(const uint8_t b[16], const char *path) { return dicom_file_begins(b, path); }

VOLUME_FORMAT(dicom_reader, "DICOM (.dcm)", .ending = {".dcm", ".dicom", ".ima"}, .may_be_slices = true,
              .orders_itself = true)

const volume_reader dicom_reader = {"dicom.v1", "DICOM", dicom_recognise, dicom_open, dicom_read, dicom_close};
