/* HDF5: one data set of a file, whose index is [z, y, x]; a fourth dimension is of channels. The attribute
 * `element_size_um`, as ilastik and tools of Fiji write it, has lengths in this order; other attributes have no certain
 * unit. Source: the HDF5 library of the HDF Group, C interface 1.10. */
#include "base/option_id.h"
#include "geometry/volume/format/hdf5_file.h"
#include "geometry/volume/format/header_axes.h"
#include "geometry/volume/format/length_unit.h"
#include "geometry/volume/format/volume_reader.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

struct hdf5 {
    struct volume_header header; /* its name, and the layout as header_axes.h finds it */
    struct hdf5_file file;
    size_t place[HDF5_MAX_DIMENSION], n_place; /* dimensions that are left without the parts of one voxel */
};

/* Reads up to three numbers of an attribute. Returns their count; 0 for an attribute of another kind. */
static size_t read_numbers(hid_t set, const char *name, double number[3])
{
    const hid_t attribute = H5Aopen(set, name, H5P_DEFAULT);
    const hid_t space = attribute >= 0 ? H5Aget_space(attribute) : -1, type = space >= 0 ? H5Aget_type(attribute) : -1;
    const hssize_t n = space >= 0 ? H5Sget_simple_extent_npoints(space) : 0;
    const H5T_class_t class = type >= 0 ? H5Tget_class(type) : H5T_NO_CLASS;
    const bool is_read = (class == H5T_FLOAT || class == H5T_INTEGER) && n >= 1 && n <= 3 &&
                         H5Aread(attribute, H5T_NATIVE_DOUBLE, number) >= 0;
    if (type >= 0) H5Tclose(type);
    if (space >= 0) H5Sclose(space);
    if (attribute >= 0) H5Aclose(attribute);
    return is_read ? (size_t)n : 0;
}

/* Enters what an attribute says about voxels into the ledger. */
static herr_t state_attribute(hid_t set, const char *key, const H5A_info_t *attribute, void *context)
{
    static const char *const of_voxels[] = {"voxel", "spacing", "resolution", "pixel", "unit",  "channel",
                                            "axis",  "axes",    "scale",      "dim",   "offset"},
                             *const of_padding[] = {"padding", "nodata", "no_data", "fillvalue", "missing_value"};
    struct volume_source_info *info = context;
    double number[3];
    char name[32] = "attribute ";
    (void)attribute;
    if (strcmp(key, "element_size_um") == 0) return 0;
    const size_t n = read_numbers(set, key, number);
    for (size_t i = 0; i < sizeof of_padding / sizeof *of_padding; i++)
        if (n == 1 && strcasestr(key, of_padding[i]) != NULL) info->padding = number[0];
    strncat(name, key, sizeof name - 11);
    for (size_t i = 0; i < sizeof of_voxels / sizeof *of_voxels; i++) {
        if (strcasestr(key, of_voxels[i]) == NULL) continue;
        if (n == 3)
            file_ledger_add(&info->ledger, name, "its unit or meaning is not certain", "%.6g %.6g %.6g", number[0],
                            number[1], number[2]);
        else if (n == 1)
            file_ledger_add(&info->ledger, name, "its unit or meaning is not certain", "%.6g", number[0]);
        else
            file_ledger_add(&info->ledger, name, "its unit or meaning is not certain", "(no number)");
    }
    return 0;
}

/* Leaves out dimensions of one voxel, the slowest first, until three are left. */
static void find_places(struct hdf5 *m)
{
    size_t more = m->file.n - 3;
    for (size_t a = 0; a < m->file.n; a++)
        if (more > 0 && m->file.size[a] == 1)
            more--;
        else
            m->place[m->n_place++] = a;
}

static status settle(struct hdf5 *m, const struct volume_part *part, struct volume_source_info *info, struct error *err)
{
    struct header_axes axes = {.source = "its data set"};
    double zyx_um[3], edge_m[3] = {NAN, NAN, NAN};
    hsize_t at = 0;
    find_places(m);
    if (m->n_place > 4)
        return error_set_field(err, STATUS_FORMAT, OPTION_SCAN_FILES,
                               "cannot read volume '%s': data set '%s' has five dimensions: save one time of it",
                               m->header.name, m->file.set_name);
    axes.n = m->n_place;
    for (size_t a = 0; a < axes.n; a++) {
        axes.size[a] = m->file.size[m->place[axes.n - 1 - a]];
        axes.spacing_m[a] = NAN;
    }
    *info = volume_source_info_empty();
    info->sample = sample_name(m->file.sample);
    file_ledger_add(&info->ledger, "data set", NULL, "%s%s", m->file.set_name,
                    m->file.is_only ? " (the only one)" : "");
    const uint64_t n_missing = hdf5_file_missing_chunks(&m->file);
    if (n_missing > 0)
        file_ledger_add(&info->ledger, "missing chunks", NULL, "%llu, which hold the fill value",
                        (unsigned long long)n_missing);
    status s = header_axes_settle(&axes, &m->header, part, info, err);
    if (read_numbers(m->file.set, "element_size_um", zyx_um) == 3)
        for (int a = 0; a < 3; a++) edge_m[a] = 1e-6 * zyx_um[2 - a];
    volume_state_voxel_size(info, edge_m, "element_size_um");
    H5Aiterate2(m->file.set, H5_INDEX_NAME, H5_ITER_INC, &at, state_attribute, info);
    return s;
}

static void hdf5_close(void *handle)
{
    struct hdf5 *m = handle;
    if (m == NULL) return;
    hdf5_file_close(&m->file);
    volume_header_release(&m->header);
    free(m);
}

static status hdf5_open(const char *const *path, size_t n_path, const struct volume_part *part, void **handle,
                        struct volume_source_info *info, struct error *err)
{
    struct hdf5 *m = calloc(1, sizeof *m);
    if (m == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot read volume: out of memory");
    status s = volume_header_init(&m->header, path[0], err);
    m->file.name = m->header.name;
    if (s == STATUS_OK && n_path > 1)
        s = volume_header_refuse(&m->header, "it is one file, and there is also", path[1], err);
    if (s == STATUS_OK) s = hdf5_file_open(&m->file, path[0], part != NULL ? part->dataset : NULL, err);
    if (s == STATUS_OK) s = settle(m, part, info, err);
    if (s == STATUS_OK)
        *handle = m;
    else
        hdf5_close(m);
    return s;
}

/* header_axes.h takes a fourth dimension for channels of a voxel if it is the last one and short, else for volumes. */
static status hdf5_read(void *handle, size_t i_slice, size_t n_slice, float *value, struct error *err)
{
    struct hdf5 *m = handle;
    const struct voxel_layout *l = &m->header.layout;
    hsize_t start[HDF5_MAX_DIMENSION] = {0}, count[HDF5_MAX_DIMENSION] = {1, 1, 1, 1, 1};
    const bool is_first = m->n_place == 4 && l->by_volume.n > 1;
    if (m->n_place == 4) start[m->place[is_first ? 0 : 3]] = is_first ? l->by_volume.i : l->by_sample.i;
    start[m->place[is_first]] = i_slice;
    count[m->place[is_first]] = n_slice;
    count[m->place[is_first + 1]] = l->n[1];
    count[m->place[is_first + 2]] = l->n[0];
    return hdf5_file_read(&m->file, start, count, value, err);
}

static bool hdf5_recognise(const uint8_t b[16], const char *path)
{
    (void)path;
    return memcmp(b, "\x89HDF\r\n\x1a\n", 8) == 0;
}

VOLUME_FORMAT(hdf5_reader, ".h5, .hdf5", .ending = {".h5", ".hdf5", ".hdf", ".nxs"})

const volume_reader hdf5_reader = {"hdf5.v1", "HDF5",     hdf5_recognise,      hdf5_open,
                                   hdf5_read, hdf5_close, .has_datasets = true};
