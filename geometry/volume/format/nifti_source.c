/* NIfTI-1 and NIfTI-2: header and voxels in one file (.nii, or .nii.gz, which is all deflated), or in two (.hdr and
 * .img, not deflated). Space has x to the right, y to the front and z up, a right-handed frame; the axes of the cloth
 * are these three, as they are with a space of NRRD. Source: nifti_header.h. */
#include "base/files/durable.h"
#include "base/option_id.h"
#include "geometry/volume/format/header_axes.h"
#include "geometry/volume/format/length_unit.h"
#include "geometry/volume/format/nifti_header.h"
#include "geometry/volume/format/volume_reader.h"

#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <zlib.h>

struct nifti {
    struct volume_header header;
    struct nifti_header of; /* the header of the file */
    bool is_deflated;
    double slope, inter;
};

static status refuse(const struct nifti *m, const char *text, struct error *err)
{
    return error_set_field(err, STATUS_FORMAT, OPTION_SCAN_FILES, "cannot read volume '%s': %s", m->header.name, text);
}

static bool ends_in(const char *path, const char *ending)
{
    const size_t n = strlen(path), m = strlen(ending);
    return n >= m && strcasecmp(path + n - m, ending) == 0;
}

/* zlib also reads files that are not deflated. */
static status read_header(struct nifti *m, const char *path, struct error *err)
{
    uint8_t byte[NIFTI_2_BYTES + 4] = {0};
    gzFile file = gzopen(path, "rbe");
    if (file == NULL)
        return error_set_errno_at(err, __func__, OPTION_SCAN_FILES, "cannot read volume '%s'", m->header.name);
    const int n = gzread(file, byte, sizeof byte);
    m->is_deflated = gzdirect(file) == 0;
    gzclose(file);
    return nifti_header_parse(byte, n > 0 ? (size_t)n : 0, &m->header, &m->of, err);
}

static status set_type(struct nifti *m, struct error *err)
{
    static const struct {
        int code;
        const char *name;
        enum sample_type type; /* SAMPLE_COUNT: is refused by its name */
    } known[] = {{2, "", SAMPLE_UINT8},
                 {4, "", SAMPLE_INT16},
                 {8, "", SAMPLE_INT32},
                 {16, "", SAMPLE_FLOAT32},
                 {64, "", SAMPLE_FLOAT64},
                 {256, "", SAMPLE_INT8},
                 {512, "", SAMPLE_UINT16},
                 {768, "", SAMPLE_UINT32},
                 {1, "single bits", SAMPLE_COUNT},
                 {32, "complex numbers", SAMPLE_COUNT},
                 {128, "colors (RGB)", SAMPLE_COUNT},
                 {1024, "int64", SAMPLE_COUNT},
                 {1280, "uint64", SAMPLE_COUNT},
                 {1536, "float128", SAMPLE_COUNT},
                 {1792, "complex numbers", SAMPLE_COUNT},
                 {2048, "complex numbers", SAMPLE_COUNT},
                 {2304, "colors (RGBA)", SAMPLE_COUNT}};
    for (size_t i = 0; i < sizeof known / sizeof *known; i++) {
        if (known[i].code != m->of.datatype) continue;
        if (known[i].type == SAMPLE_COUNT)
            return volume_header_refuse(&m->header, "save its densities as float32 or uint16, because its values are",
                                        known[i].name, err);
        m->header.layout.sample = known[i].type;
        m->header.layout.swap = m->of.swap;
        return STATUS_OK;
    }
    return error_set_field(err, STATUS_FORMAT, OPTION_SCAN_FILES,
                           "cannot read volume '%s': its datatype %d is none of NIfTI", m->header.name, m->of.datatype);
}

/* The file of the voxels: the same, or the one of the pair that ends in .img. */
static status find_data(struct nifti *m, const char *path, struct error *err)
{
    const char *name = m->header.name;
    char data[256];
    const double at = m->of.vox_offset;
    if (!(at >= 0.0 && at <= 1e15)) return refuse(m, "its vox_offset is not possible", err);
    if (m->of.is_single_file && at < (double)m->of.header_bytes)
        return refuse(m, "its vox_offset lies within the header", err);
    m->header.layout.compressed = m->is_deflated;
    *(m->is_deflated ? &m->header.layout.skip_bytes : &m->header.layout.offset_bytes) = (long long)at;
    if (m->of.is_single_file) return volume_header_data_file(&m->header, path, name, "its name is", err);
    if (m->is_deflated || !ends_in(name, ".hdr") || strlen(name) >= sizeof data)
        return refuse(m, "of a pair of files the header must be a .hdr that is not deflated, with an .img beside it",
                      err);
    snprintf(data, sizeof data, "%.*s%s", (int)strlen(name) - 4, name, name[strlen(name) - 1] == 'R' ? ".IMG" : ".img");
    return volume_header_data_file(&m->header, path, data, "the name of its voxels is", err);
}

static void state_units(struct nifti *m, double edge_m[3], struct file_ledger *ledger)
{
    static const double unit_m[4] = {NAN, 1.0, 1e-3, 1e-6};
    const int code = m->of.xyzt_units & 7;
    const double metre = code < 4 ? unit_m[code] : NAN;
    for (int a = 0; a < 3; a++) edge_m[a] = fabs(m->of.pixdim[a + 1]) * metre;
    if (isnan(metre))
        file_ledger_add(ledger, "voxel size", "xyzt_units states no unit of length", "%.6g x %.6g x %.6g",
                        m->of.pixdim[1], m->of.pixdim[2], m->of.pixdim[3]);
}

/* Statements that have no use here. */
static void state_other(const struct nifti_header *h, struct file_ledger *ledger)
{
    const char *const histogram = "void and solid come from the histogram";
    if (h->cal_max != 0.0 || h->cal_min != 0.0)
        file_ledger_add(ledger, "range of display", histogram, "cal_min %.6g, cal_max %.6g", h->cal_min, h->cal_max);
    if (h->descrip[0] != '\0') file_ledger_add(ledger, "description", "text for people", "%s", h->descrip);
    if (h->aux_file[0] != '\0') file_ledger_add(ledger, "auxiliary file", "no other file is read", "%s", h->aux_file);
    if (h->intent_code != 0 || h->intent_name[0] != '\0')
        file_ledger_add(ledger, "intent", "all values are densities", "code %d %s", h->intent_code, h->intent_name);
    if (h->slice_code != 0 || h->slice_duration != 0.0)
        file_ledger_add(ledger, "times of slices", "cloth does not move", "code %d, %.6g", h->slice_code,
                        h->slice_duration);
    if (h->has_extension) file_ledger_add(ledger, "extension", "it holds no statement on voxels", "after the header");
    if (h->toffset != 0.0) file_ledger_add(ledger, "time of the start", "cloth does not move", "%.6g", h->toffset);
    const bool by_rows = h->sform_code > 0;
    const double at[3] = {by_rows ? h->srow[0][3] : h->qoffset[0], by_rows ? h->srow[1][3] : h->qoffset[1],
                          by_rows ? h->srow[2][3] : h->qoffset[2]};
    if ((by_rows || h->qform_code > 0) && (at[0] != 0.0 || at[1] != 0.0 || at[2] != 0.0))
        file_ledger_add(ledger, "origin", "the cloth begins at the corner of the scan", "%.6g %.6g %.6g", at[0], at[1],
                        at[2]);
    if (by_rows && h->qform_code > 0) file_ledger_add(ledger, "qform", "sform comes first", "code %d", h->qform_code);
}

/* Edges of the voxels by the directions; where pixdim says otherwise neither is certain. */
static bool edges_agree(const struct nifti_header *h, double direction[3][3])
{
    bool agree = true;
    for (int a = 0; a < 3; a++) {
        const double *d = direction[a], length = sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
        agree = agree && fabs(length - fabs(h->pixdim[a + 1])) <= 1e-3 * length;
    }
    return agree;
}

static status set_axes(struct nifti *m, struct header_axes *axes, struct file_ledger *ledger, struct error *err)
{
    double edge_m[3], direction[3][3];
    const char *source = nifti_header_directions(&m->of, direction);
    state_units(m, edge_m, ledger);
    for (size_t a = 0; a < m->of.n; a++) {
        if (m->of.size[a] > 1 && a > 4) return refuse(m, "it has more than five dimensions", err);
        if (a > 4) continue;
        axes->size[a] = m->of.size[a];
        axes->kind[a] = a < 3 ? AXIS_SPACE : a == 3 ? AXIS_TIME : AXIS_CHANNEL;
        axes->spacing_m[a] = a < 3 ? edge_m[a] : NAN;
        axes->n = a + 1;
    }
    if (source == NULL) return STATUS_OK;
    for (int a = 0; a < 3; a++) {
        const double *d = direction[a], square = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
        if (!(square > 0.0) || !isfinite(square))
            return refuse(m, "its sform or qform has an axis without a length", err);
        memcpy(axes->direction[a], d, sizeof direction[a]);
    }
    axes->has_direction = true;
    if (!edges_agree(&m->of, direction)) {
        for (int a = 0; a < 3; a++) axes->spacing_m[a] = NAN;
        file_ledger_add(ledger, "voxel size", "pixdim and sform or qform disagree", "%.6g x %.6g x %.6g (pixdim)",
                        m->of.pixdim[1], m->of.pixdim[2], m->of.pixdim[3]);
    }
    return STATUS_OK;
}

static void set_scale(struct nifti *m, struct file_ledger *ledger)
{
    const double slope = m->of.scl_slope, inter = m->of.scl_inter;
    const bool stated = isfinite(slope) && isfinite(inter) && slope != 0.0; /* 0: by definition not stated */
    m->slope = stated ? slope : 1.0;
    m->inter = stated ? inter : 0.0;
    if (m->slope != 1.0 || m->inter != 0.0)
        file_ledger_add(ledger, "scale of values", NULL, "%.6g x value + %.6g", m->slope, m->inter);
}

static status settle(struct nifti *m, const struct volume_part *part, struct volume_source_info *info,
                     struct error *err)
{
    struct header_axes axes = {.source = "its header"};
    *info = volume_source_info_empty();
    status s = set_type(m, err);
    if (s != STATUS_OK) return s;
    info->sample = sample_name(m->header.layout.sample);
    set_scale(m, &info->ledger);
    state_other(&m->of, &info->ledger);
    s = set_axes(m, &axes, &info->ledger, err);
    return s == STATUS_OK ? header_axes_settle(&axes, &m->header, part, info, err) : s;
}

static void nifti_close(void *handle)
{
    if (handle != NULL) volume_header_release(handle);
    free(handle);
}

static status nifti_open(const char *const *path, size_t n_path, const struct volume_part *part, void **handle,
                         struct volume_source_info *info, struct error *err)
{
    struct nifti *m = calloc(1, sizeof *m);
    if (m == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot read volume: out of memory");
    status s = volume_header_init(&m->header, path[0], err);
    if (s == STATUS_OK && ends_in(path[0], ".img"))
        s = refuse(m, "of a pair of files, name the header (.hdr) first", err);
    if (s == STATUS_OK) s = read_header(m, path[0], err);
    if (s == STATUS_OK) s = find_data(m, path[0], err);
    for (size_t i = 1; i < n_path && s == STATUS_OK; i++) /* uploads name the data file as well */
        if (strcmp(path[i], m->header.data_path) != 0)
            s = volume_header_refuse(&m->header, "its voxels are not in", path_file_name(path[i]), err);
    if (s == STATUS_OK) s = settle(m, part, info, err);
    if (s == STATUS_OK) s = volume_header_open_data(&m->header, err);
    if (s == STATUS_OK)
        *handle = m;
    else
        nifti_close(m);
    return s;
}

static status nifti_read(void *handle, size_t i_slice, size_t n_slice, float *value, struct error *err)
{
    struct nifti *m = handle;
    status s = voxel_stream_read(m->header.stream, i_slice, n_slice, value, err);
    if (s != STATUS_OK || (m->slope == 1.0 && m->inter == 0.0)) return s;
    const size_t n = n_slice * m->header.layout.n[0] * m->header.layout.n[1];
    for (size_t i = 0; i < n; i++) value[i] = (float)(m->slope * (double)value[i] + m->inter);
    return STATUS_OK;
}

static bool nifti_recognise(const uint8_t b[16], const char *path)
{
    return nifti_header_begins(b) || ends_in(path, ".nii") || ends_in(path, ".nii.gz") || ends_in(path, ".img");
}

VOLUME_FORMAT(nifti_reader, ".nii, .nii.gz, .hdr", .ending = {".nii", ".nii.gz", ".hdr", ".img"},
              .header_ending = ".hdr", .data_ending = ".img")

const volume_reader nifti_reader = {"nifti.v1", "NIfTI", nifti_recognise, nifti_open, nifti_read, nifti_close};
