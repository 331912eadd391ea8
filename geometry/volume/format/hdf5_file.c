#include "geometry/volume/format/hdf5_file.h"
#include "base/option_id.h"
#include "geometry/volume/format/voxel_stream.h"

#include <stdio.h>
#include <string.h>
#include <sys/stat.h>

/* Bytes of chunks that are kept inflated while slices are read, and of one chunk at most. */
static const size_t CACHE_BYTES = (size_t)256 << 20, MOST_CHUNK_BYTES = (size_t)1 << 30;

static status refuse(const struct hdf5_file *h, const char *text, struct error *err)
{
    return error_set_field(err, STATUS_FORMAT, OPTION_SCAN_FILES, "cannot read volume '%s': data set '%.100s' %s",
                           h->name, h->set_name, text);
}

/* ---- the data sets of a file ---- */

struct search {
    const char *wanted;
    size_t n;
    bool is_there; /* the wanted one, whatever its dimensions */
    char first[HDF5_MAX_NAME_BYTES], list[400];
};

/* Whether a data set has three to five dimensions. */
static bool may_be_scan(hid_t group, const char *name)
{
    const hid_t set = H5Dopen2(group, name, H5P_DEFAULT);
    const hid_t space = set >= 0 ? H5Dget_space(set) : -1;
    const int n = space >= 0 ? H5Sget_simple_extent_ndims(space) : 0;
    if (space >= 0) H5Sclose(space);
    if (set >= 0) H5Dclose(set);
    return n >= 3 && n <= HDF5_MAX_DIMENSION;
}

/* Called for each object that hard links reach; links to other files are not among them. */
static herr_t visit(hid_t root, const char *name, const H5O_info_t *info, void *context)
{
    struct search *s = context;
    if (info->type != H5O_TYPE_DATASET) return 0;
    const char *wanted = s->wanted[0] == '/' ? s->wanted + 1 : s->wanted;
    s->is_there = s->is_there || strcmp(name, wanted) == 0;
    if (strlen(name) >= HDF5_MAX_NAME_BYTES || !may_be_scan(root, name)) return 0;
    const size_t used = strlen(s->list);
    snprintf(s->list + used, sizeof s->list - used, "%s'%s'", used > 0 ? ", " : "", name);
    if (s->n++ == 0) snprintf(s->first, sizeof s->first, "%s", name);
    return 0;
}

static status choose_set(struct hdf5_file *h, const char *wanted, struct error *err)
{
    struct search s = {.wanted = wanted};
    if (H5Ovisit2(h->file, H5_INDEX_NAME, H5_ITER_INC, visit, &s, H5O_INFO_BASIC) < 0)
        return error_set_field(err, STATUS_FORMAT, OPTION_SCAN_FILES, "cannot read volume '%s': its groups are damaged",
                               h->name);
    if (wanted[0] != '\0' && !s.is_there)
        return error_set_field(err, STATUS_INVALID, OPTION_SCAN_DATASET,
                               "cannot read volume '%s': it has no data set '%.100s' of its own, but %s", h->name,
                               wanted, s.n > 0 ? s.list : "none with three dimensions");
    if (wanted[0] == '\0' && s.n == 0)
        return error_set_field(err, STATUS_FORMAT, OPTION_SCAN_FILES,
                               "cannot read volume '%s': it has no data set of three dimensions", h->name);
    if (wanted[0] == '\0' && s.n > 1)
        return error_set_field(err, STATUS_INVALID, OPTION_SCAN_DATASET,
                               "cannot read volume '%s': choose one of its %zu data sets with 'dataset': %s", h->name,
                               s.n, s.list);
    h->is_only = wanted[0] == '\0';
    snprintf(h->set_name, sizeof h->set_name, "%s", h->is_only ? s.first : wanted);
    return STATUS_OK;
}

/* ---- checks of the chosen one ---- */

static status check_type(struct hdf5_file *h, struct error *err)
{
    const struct {
        hid_t type[2];
        enum sample_type sample;
    } known[] = {
        {{H5T_STD_U8LE, H5T_STD_U8BE}, SAMPLE_UINT8},       {{H5T_STD_I8LE, H5T_STD_I8BE}, SAMPLE_INT8},
        {{H5T_STD_U16LE, H5T_STD_U16BE}, SAMPLE_UINT16},    {{H5T_STD_I16LE, H5T_STD_I16BE}, SAMPLE_INT16},
        {{H5T_STD_U32LE, H5T_STD_U32BE}, SAMPLE_UINT32},    {{H5T_STD_I32LE, H5T_STD_I32BE}, SAMPLE_INT32},
        {{H5T_IEEE_F32LE, H5T_IEEE_F32BE}, SAMPLE_FLOAT32}, {{H5T_IEEE_F64LE, H5T_IEEE_F64BE}, SAMPLE_FLOAT64}};
    const hid_t type = H5Dget_type(h->set);
    bool found = false;
    for (size_t i = 0; i < sizeof known / sizeof *known && !found; i++) {
        found = type >= 0 && (H5Tequal(type, known[i].type[0]) > 0 || H5Tequal(type, known[i].type[1]) > 0);
        if (found) h->sample = known[i].sample;
    }
    if (type >= 0) H5Tclose(type);
    return found ? STATUS_OK
                 : refuse(h, "holds neither integers of 8 to 32 bits nor floats of 32 or 64: save it as float32", err);
}

static status check_filters(const struct hdf5_file *h, hid_t plan, bool *is_deflated, struct error *err)
{
    const int n = H5Pget_nfilters(plan);
    *is_deflated = false;
    for (int i = 0; i < n; i++) {
        char name[64] = "", text[160];
        size_t n_value = 0;
        unsigned flags, config;
        const H5Z_filter_t id = H5Pget_filter2(plan, (unsigned)i, &flags, &n_value, NULL, sizeof name, name, &config);
        *is_deflated = *is_deflated || id == H5Z_FILTER_DEFLATE;
        if (id == H5Z_FILTER_DEFLATE || id == H5Z_FILTER_SHUFFLE || id == H5Z_FILTER_FLETCHER32) continue;
        snprintf(text, sizeof text, "is packed by filter %d '%.50s', which is not read: save it with gzip", (int)id,
                 name);
        return refuse(h, text, err);
    }
    return n >= 0 ? STATUS_OK : refuse(h, "has damaged filters", err);
}

/* Checks where the samples are, and that the file is long enough for them. */
static status check_storage(const struct hdf5_file *h, hid_t plan, uint64_t file_bytes, struct error *err)
{
    hsize_t chunk[HDF5_MAX_DIMENSION];
    bool is_deflated;
    uint64_t want = sample_bytes(h->sample), chunk_bytes = want;
    const H5D_layout_t layout = H5Pget_layout(plan);
    if (layout == H5D_VIRTUAL) return refuse(h, "is virtual, made of other data sets: save it as one", err);
    if (H5Pget_external_count(plan) != 0) return refuse(h, "has its samples in another file: save them in one", err);
    status s = check_filters(h, plan, &is_deflated, err);
    if (s != STATUS_OK) return s;
    for (size_t a = 0; a < h->n; a++)
        if (__builtin_mul_overflow(want, (uint64_t)h->size[a], &want)) return refuse(h, "has an impossible size", err);
    const int n = layout == H5D_CHUNKED ? H5Pget_chunk(plan, HDF5_MAX_DIMENSION, chunk) : 0;
    for (int a = 0; a < n; a++)
        if (__builtin_mul_overflow(chunk_bytes, (uint64_t)chunk[a], &chunk_bytes) || chunk_bytes > MOST_CHUNK_BYTES)
            return refuse(h, "has chunks of over 1 GiB", err);
    if (want / (is_deflated ? 1100 : 1) > file_bytes) /* the best ratio of deflate is 1032 */
        return refuse(h, "is larger than the file: the file is too short", err);
    return STATUS_OK;
}

static status check_size(struct hdf5_file *h, struct error *err)
{
    hsize_t size[HDF5_MAX_DIMENSION];
    const int n = H5Sget_simple_extent_ndims(h->space);
    if (n < 3 || n > HDF5_MAX_DIMENSION || H5Sget_simple_extent_dims(h->space, size, NULL) != n)
        return refuse(h, "does not have three to five dimensions", err);
    h->n = (size_t)n;
    for (size_t a = 0; a < h->n; a++) {
        if (size[a] < 1 || size[a] > VOXEL_STREAM_MAX_EDGE) return refuse(h, "has an impossible size", err);
        h->size[a] = (size_t)size[a];
    }
    return STATUS_OK;
}

static status open_set(struct hdf5_file *h, uint64_t file_bytes, struct error *err)
{
    const hid_t access = H5Pcreate(H5P_DATASET_ACCESS);
    H5Pset_chunk_cache(access, 12421, CACHE_BYTES, 1.0);
    h->set = H5Dopen2(h->file, h->set_name, access);
    H5Pclose(access);
    h->space = h->set >= 0 ? H5Dget_space(h->set) : -1;
    const hid_t plan = h->space >= 0 ? H5Dget_create_plist(h->set) : -1;
    if (plan < 0) return refuse(h, "is damaged", err);
    status s = check_size(h, err);
    if (s == STATUS_OK) s = check_type(h, err);
    if (s == STATUS_OK) s = check_storage(h, plan, file_bytes, err);
    H5Pclose(plan);
    return s;
}

status hdf5_file_open(struct hdf5_file *h, const char *path, const char *wanted, struct error *err)
{
    struct stat st;
    h->file = h->set = h->space = -1;
    H5Eset_auto2(H5E_DEFAULT, NULL, NULL); /* its messages go to no one */
    H5PLset_loading_state(0);              /* no plug-ins, whatever a file asks for */
    const hid_t access = H5Pcreate(H5P_FILE_ACCESS);
    H5Pset_fapl_sec2(access); /* whatever the environment says */
    h->file = H5Fopen(path, H5F_ACC_RDONLY, access);
    H5Pclose(access);
    if (h->file < 0 || stat(path, &st) != 0)
        return error_set_field(err, STATUS_FORMAT, OPTION_SCAN_FILES,
                               "cannot read volume '%s': it is no HDF5 file, or is damaged or cut off", h->name);
    status s = choose_set(h, wanted != NULL ? wanted : "", err);
    return s == STATUS_OK ? open_set(h, (uint64_t)st.st_size, err) : s;
}

void hdf5_file_close(struct hdf5_file *h)
{
    if (h->space > 0) H5Sclose(h->space);
    if (h->set > 0) H5Dclose(h->set);
    if (h->file > 0) H5Fclose(h->file);
    h->file = h->set = h->space = -1;
}

uint64_t hdf5_file_missing_chunks(const struct hdf5_file *h)
{
    hsize_t chunk[HDF5_MAX_DIMENSION], n_written = 0;
    const hid_t plan = H5Dget_create_plist(h->set);
    uint64_t n_chunk = 1;
    if (plan < 0) return 0;
    const bool is_chunked = H5Pget_layout(plan) == H5D_CHUNKED && H5Pget_chunk(plan, (int)h->n, chunk) == (int)h->n;
    H5Pclose(plan);
    if (!is_chunked || H5Dget_num_chunks(h->set, h->space, &n_written) < 0) return 0;
    for (size_t a = 0; a < h->n; a++) n_chunk *= (h->size[a] + chunk[a] - 1) / chunk[a];
    return n_chunk > n_written ? n_chunk - n_written : 0;
}

status hdf5_file_read(struct hdf5_file *h, const hsize_t *start, const hsize_t *count, float *value, struct error *err)
{
    const hid_t memory = H5Screate_simple((int)h->n, count, NULL);
    const bool whole = memory >= 0 && H5Sselect_hyperslab(h->space, H5S_SELECT_SET, start, NULL, count, NULL) >= 0 &&
                       H5Dread(h->set, H5T_NATIVE_FLOAT, memory, h->space, H5P_DEFAULT, value) >= 0;
    if (memory >= 0) H5Sclose(memory);
    return whole ? STATUS_OK : refuse(h, "ends or is damaged", err);
}
