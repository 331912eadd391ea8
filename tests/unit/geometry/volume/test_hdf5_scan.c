/* Scans in HDF5: the choice of a data set, lengths, and everything that reaches out of the file. */
#include "base/option_id.h"
#include "geometry/volume/format/volume_source.h"
#include "tests/support/scan/scan_expectation.h"
#include "tests/support/scratch_folder.h"

#include <hdf5.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { X = 4, Y = 3, Z = 2 };
static const hsize_t zyx[3] = {Z, Y, X};
static const size_t xyz[3] = {X, Y, Z};

static hid_t new_file(const char *path) { return H5Fcreate(path, H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT); }

/* Writes a data set of 0, 1, 2, .. in a type. Returns it. */
static hid_t put(hid_t file, const char *name, hid_t type, int n, const hsize_t *size, hid_t plan)
{
    uint16_t value[64];
    for (uint16_t i = 0; i < 64; i++) value[i] = i;
    const hid_t links = H5Pcreate(H5P_LINK_CREATE), space = H5Screate_simple(n, size, NULL);
    H5Pset_create_intermediate_group(links, 1);
    const hid_t set = H5Dcreate2(file, name, type, space, links, plan, H5P_DEFAULT);
    assert_true(set >= 0);
    H5Dwrite(set, H5T_NATIVE_UINT16, H5S_ALL, H5S_ALL, H5P_DEFAULT, value);
    H5Sclose(space);
    H5Pclose(links);
    return set;
}

static void state_edges(hid_t set, const char *name, const double edge[3])
{
    const hsize_t three = 3;
    const hid_t space = H5Screate_simple(1, &three, NULL);
    const hid_t a = H5Acreate2(set, name, H5T_IEEE_F32BE, space, H5P_DEFAULT, H5P_DEFAULT);
    H5Awrite(a, H5T_NATIVE_DOUBLE, edge);
    H5Aclose(a);
    H5Sclose(space);
}

static hid_t packed(void)
{
    static const hsize_t chunk[3] = {2, 2, 3};
    const hid_t plan = H5Pcreate(H5P_DATASET_CREATE);
    H5Pset_chunk(plan, 3, chunk);
    H5Pset_shuffle(plan);
    H5Pset_deflate(plan, 6);
    H5Pset_fletcher32(plan);
    return plan;
}

/* The chunks that an interrupted program did not write are counted. */
static void test_missing_chunks(void **state)
{
    const char *path = scratch_path(state, "half.h5");
    const hid_t file = new_file(path), plan = packed(), space = H5Screate_simple(3, zyx, NULL);
    H5Dclose(H5Dcreate2(file, "v", H5T_STD_U16LE, space, H5P_DEFAULT, plan, H5P_DEFAULT));
    H5Sclose(space);
    H5Pclose(plan);
    H5Fclose(file);
    struct volume_source *source;
    struct error err = {0};
    assert_int_equal(volume_source_open(&path, 1, &source, &err), STATUS_OK);
    const struct file_statement *said = file_ledger_find(&volume_source_describe(source)->ledger, "missing chunks");
    assert_non_null(said);
    assert_string_equal(said->value, "4, which hold the fill value"); /* 1 x 2 x 2 chunks */
    volume_source_close(source);
}

static void test_types(void **state)
{
    static const double none[3] = {0, 0, 0};
    float want[X * Y * Z];
    const char *path = scratch_path(state, "t.h5");
    const hid_t type[] = {H5T_STD_U8LE,  H5T_STD_I8LE,  H5T_STD_U16LE,  H5T_STD_U16BE,  H5T_STD_I16LE,
                          H5T_STD_U32BE, H5T_STD_I32LE, H5T_IEEE_F32LE, H5T_IEEE_F32BE, H5T_IEEE_F64LE};
    for (int i = 0; i < X * Y * Z; i++) want[i] = (float)i;
    for (size_t k = 0; k < 2 * sizeof type / sizeof *type; k++) {
        const hid_t file = new_file(path), plan = k % 2 == 0 ? H5Pcreate(H5P_DATASET_CREATE) : packed();
        H5Dclose(put(file, "entry/data", type[k / 2], 3, zyx, plan));
        H5Pclose(plan);
        H5Fclose(file);
        scan_expect_values(&path, 1, NULL, xyz, none, want);
    }
    const hid_t refused[] = {H5T_STD_I64LE, H5T_STD_B8LE};
    for (size_t k = 0; k < 2; k++) {
        const hid_t file = new_file(path);
        const hid_t space = H5Screate_simple(3, zyx, NULL);
        H5Dclose(H5Dcreate2(file, "d", refused[k], space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT));
        H5Sclose(space);
        H5Fclose(file);
        scan_expect_refused(path, NULL, STATUS_FORMAT, OPTION_SCAN_FILES, "save it as float32");
    }
}

static status open_part(const char *path, const char *dataset, size_t channel, struct volume_source_info *info,
                        float *first, struct error *err)
{
    struct volume_part part = {.channel = channel};
    struct volume_source *source = NULL;
    strncpy(part.dataset, dataset, sizeof part.dataset - 1);
    status s = volume_source_open_declared(&path, 1, NULL, &part, &source, err);
    if (s != STATUS_OK) return s;
    *info = *volume_source_describe(source);
    assert_int_equal(volume_source_read(source, 0, 1, first, NULL), STATUS_OK);
    volume_source_close(source);
    return STATUS_OK;
}

static void test_choice(void **state)
{
    static const double edge[3] = {4, 3, 2};
    struct volume_source_info info;
    struct error err = {0};
    float first[64];
    const char *path = scratch_path(state, "c.h5");
    const hid_t file = new_file(path), set = put(file, "a/raw", H5T_STD_U16LE, 3, zyx, H5P_DEFAULT);
    state_edges(set, "element_size_um", edge);
    state_edges(set, "spacing", edge);
    H5Dclose(set);
    H5Dclose(put(file, "flat", H5T_STD_U16LE, 2, zyx, H5P_DEFAULT));
    H5Fclose(file);
    assert_int_equal(open_part(path, "", 0, &info, first, &err), STATUS_OK);
    assert_true(fabs(info.voxel_size_m[0] - 2e-6) < 1e-12 && fabs(info.voxel_size_m[2] - 4e-6) < 1e-12);
    assert_string_equal(file_ledger_find(&info.ledger, "data set")->value, "a/raw (the only one)");
    assert_int_equal(file_ledger_find(&info.ledger, "attribute spacing")->use, FILE_STATEMENT_NOT_USED);
    const hid_t again = H5Fopen(path, H5F_ACC_RDWR, H5P_DEFAULT);
    H5Dclose(put(again, "b", H5T_STD_U16LE, 3, zyx, H5P_DEFAULT));
    H5Fclose(again);
    scan_expect_refused(path, NULL, STATUS_INVALID, OPTION_SCAN_DATASET, "with 'dataset': 'a/raw', 'b'");
    assert_int_equal(open_part(path, "b", 0, &info, first, &err), STATUS_OK);
    assert_int_equal(open_part(path, "/a/raw", 0, &info, first, &err), STATUS_OK);
    assert_int_equal(open_part(path, "c", 0, &info, first, &err), STATUS_INVALID);
    assert_non_null(strstr(err.text, "no data set 'c' of its own, but 'a/raw', 'b'"));
    assert_int_equal(open_part(path, "flat", 0, &info, first, &err), STATUS_FORMAT);
    assert_non_null(strstr(err.text, "three to five dimensions"));
}

static void test_channels(void **state)
{
    static const hsize_t last[5] = {1, 4, 3, 3, 2}, before[4] = {2, 3, 3, 3};
    struct volume_source_info info;
    float first[64];
    const char *path = scratch_path(state, "4.h5");
    for (int k = 0; k < 2; k++) {
        const hid_t file = new_file(path);
        hid_t space = H5Screate_simple(k == 0 ? 5 : 4, k == 0 ? last : before, NULL);
        hid_t set = H5Dcreate2(file, "d", H5T_STD_U16LE, space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
        uint16_t value[72];
        for (uint16_t i = 0; i < 72; i++) value[i] = i;
        H5Dwrite(set, H5T_NATIVE_UINT16, H5S_ALL, H5S_ALL, H5P_DEFAULT, value);
        H5Sclose(space);
        H5Dclose(set);
        H5Fclose(file);
        scan_expect_refused(path, NULL, STATUS_INVALID, OPTION_SCAN_CHANNEL, "2 channels");
        assert_int_equal(open_part(path, "", 2, &info, first, NULL), STATUS_OK);
        assert_true(info.n[0] == 3 && info.n[1] == 3 && info.n[2] == (k == 0 ? 4 : 3));
        assert_true(first[0] == (k == 0 ? 1.0f : 27.0f) && first[4] == (k == 0 ? 9.0f : 31.0f));
    }
}

/* Links to another file are never followed, neither by the search nor by name. */
static void test_other_files(void **state)
{
    struct volume_source_info info;
    struct error err = {0};
    float first[64];
    char other[512];
    snprintf(other, sizeof other, "%s", scratch_path(state, "other.h5"));
    hid_t file = new_file(other);
    H5Dclose(put(file, "d", H5T_STD_U16LE, 3, zyx, H5P_DEFAULT));
    H5Fclose(file);
    const char *path = scratch_path(state, "o.h5");
    file = new_file(path);
    H5Lcreate_external(other, "d", file, "linked", H5P_DEFAULT, H5P_DEFAULT);
    H5Fclose(file);
    scan_expect_refused(path, NULL, STATUS_FORMAT, OPTION_SCAN_FILES, "no data set of three dimensions");
    assert_int_equal(open_part(path, "linked", 0, &info, first, &err), STATUS_INVALID);
    assert_non_null(strstr(err.text, "of its own"));

    file = new_file(path);
    hid_t plan = H5Pcreate(H5P_DATASET_CREATE);
    H5Pset_external(plan, other, 0, H5F_UNLIMITED);
    hid_t space = H5Screate_simple(3, zyx, NULL);
    H5Dclose(H5Dcreate2(file, "d", H5T_STD_U16LE, space, H5P_DEFAULT, plan, H5P_DEFAULT));
    H5Pclose(plan);
    H5Fclose(file);
    scan_expect_refused(path, NULL, STATUS_FORMAT, OPTION_SCAN_FILES, "in another file");

    file = new_file(path);
    plan = H5Pcreate(H5P_DATASET_CREATE);
    H5Pset_virtual(plan, space, other, "d", space);
    H5Dclose(H5Dcreate2(file, "d", H5T_STD_U16LE, space, H5P_DEFAULT, plan, H5P_DEFAULT));
    H5Pclose(plan);
    H5Fclose(file);
    scan_expect_refused(path, NULL, STATUS_FORMAT, OPTION_SCAN_FILES, "is virtual");

    file = new_file(path);
    plan = packed();
    H5Premove_filter(plan, H5Z_FILTER_ALL);
    H5Pset_scaleoffset(plan, H5Z_SO_INT, 6);
    H5Dclose(put(file, "d", H5T_STD_U16LE, 3, zyx, plan));
    H5Pclose(plan);
    H5Sclose(space);
    H5Fclose(file);
    scan_expect_refused(path, NULL, STATUS_FORMAT, OPTION_SCAN_FILES, "save it with gzip");
}

static void test_damaged(void **state)
{
    static const hsize_t huge[3] = {1 << 20, 1 << 20, 1 << 20}, chunk[3] = {1, 64, 64};
    const char *path = scratch_path(state, "h.h5");
    hid_t file = new_file(path), plan = packed(), space = H5Screate_simple(3, huge, NULL);
    H5Pset_chunk(plan, 3, chunk);
    H5Dclose(H5Dcreate2(file, "d", H5T_STD_U16LE, space, H5P_DEFAULT, plan, H5P_DEFAULT));
    H5Pclose(plan);
    H5Sclose(space);
    H5Fclose(file);
    scan_expect_refused(path, NULL, STATUS_FORMAT, OPTION_SCAN_FILES, "too short");
    file = new_file(path);
    plan = packed();
    H5Dclose(put(file, "d", H5T_STD_U16LE, 3, zyx, plan));
    H5Pclose(plan);
    H5Fclose(file);
    size_t n;
    char *bytes = scratch_read(path, &n);
    scratch_write(path, bytes, n / 2);
    scan_expect_refused(path, NULL, STATUS_FORMAT, OPTION_SCAN_FILES, "damaged or cut off");
    free(bytes);
    struct volume_source_info info;
    struct error err = {0};
    const char *npy = scratch_path(state, "n.vol");
    scratch_write(npy, "VOL\3", 4);
    assert_int_equal(open_part(npy, "d", 0, &info, NULL, &err), STATUS_INVALID);
    assert_string_equal(err.field, OPTION_SCAN_DATASET);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_types),    cmocka_unit_test(test_missing_chunks), cmocka_unit_test(test_choice),
        cmocka_unit_test(test_channels), cmocka_unit_test(test_other_files),    cmocka_unit_test(test_damaged),
    };
    return cmocka_run_group_tests(tests, scratch_folder_setup, scratch_folder_teardown);
}
