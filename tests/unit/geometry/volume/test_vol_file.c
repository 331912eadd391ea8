/* `.vol` files: golden bytes, round trips, and the error of quantised directions. */
#include "base/angle.h"
#include "base/rng.h"
#include "geometry/volume/format/vol_file.h"
#include "tests/support/scan/scan_files.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cmocka.h>

static char folder[64], path[128];
static int n_folder_sync;

/* In place of the system's: counts the folders that are written to disk. */
int fsync(int fd)
{
    struct stat st;
    if (fstat(fd, &st) == 0 && S_ISDIR(st.st_mode)) n_folder_sync++;
    return 0;
}

static int make_folder(void **state)
{
    (void)state;
    test_make_folder(folder);
    snprintf(path, sizeof path, "%s/a.vol", folder);
    return 0;
}

static const uint8_t golden_density[] = {0x56, 0x4f, 0x4c, 3, 1,    0,    0, 0, 2, 0, 0,    0,    1,    0,
                                         0,    0,    1,    0, 0,    0,    1, 0, 0, 0, 0,    0,    0,    0,
                                         0,    0,    0,    0, 0,    0,    0, 0, 0, 0, 0x80, 0x3f, 0,    0,
                                         0x80, 0x3f, 0,    0, 0x80, 0x3f, 0, 0, 0, 0, 0,    0,    0x80, 0x3f};

static void check_bytes(const uint8_t *want, size_t n)
{
    uint8_t have[256];
    FILE *f = fopen(path, "rb");
    size_t m = fread(have, 1, sizeof have, f);
    fclose(f);
    assert_int_equal(m, n);
    assert_memory_equal(have, want, n);
}

/* A box of 1 mm: 2 x 1 x 1 voxels of 0.5 x 1 x 1 mm. */
static const size_t shape[3] = {2, 1, 1};
static const double size_m[3] = {0.5e-3, 1e-3, 1e-3};

static void test_golden(void **state)
{
    (void)state;
    struct volume v;
    struct direction_volume d;
    uint8_t quantised[52];
    const float up[3] = {1.0f, 0.0f, 0.0061599f}; /* theta = 127 pi / 255 */
    assert_int_equal(volume_init(&v, shape, size_m, NULL), STATUS_OK);
    v.density[1] = 1.0f;
    n_folder_sync = 0;
    assert_int_equal(vol_write_density(path, &v, VOL_FLOAT32, NULL), STATUS_OK);
    assert_int_equal(n_folder_sync, 1); /* else the file may be missing after a power cut */
    check_bytes(golden_density, sizeof golden_density);
    memcpy(quantised, golden_density, 48);
    quantised[4] = 4;
    quantised[20] = 3;
    memcpy(quantised + 48, (const uint8_t[4]){0xff, 0xff, 0x7f, 0x00}, 4);
    assert_int_equal(direction_volume_init(&d, shape, size_m, NULL), STATUS_OK);
    d.density[1] = 200;
    direction_volume_set(&d, 1, up);
    assert_int_equal(vol_write_direction(path, &d, VOL_QUANTISED, NULL), STATUS_OK);
    check_bytes(quantised, sizeof quantised);
    assert_int_equal(vol_write_direction(path, &d, VOL_UINT8, NULL), STATUS_INVALID);
    assert_int_equal(vol_write_density(path, &v, VOL_QUANTISED, NULL), STATUS_INVALID);
    volume_release(&v);
    direction_volume_release(&d);
}

static void random_direction(struct rng *r, float d[3])
{
    double z = 2.0 * rng_double(r) - 1.0, phi = 2.0 * M_PI * rng_double(r), s = sqrt(1.0 - z * z);
    d[0] = (float)(s * cos(phi));
    d[1] = (float)(s * sin(phi));
    d[2] = (float)z;
}

static double angle_deg(const float a[3], const float b[3])
{
    double c[3] = {(double)a[1] * b[2] - (double)a[2] * b[1], (double)a[2] * b[0] - (double)a[0] * b[2],
                   (double)a[0] * b[1] - (double)a[1] * b[0]};
    double dot = (double)a[0] * b[0] + (double)a[1] * b[1] + (double)a[2] * b[2];
    return angle_to_deg(atan2(sqrt(c[0] * c[0] + c[1] * c[1] + c[2] * c[2]), fabs(dot)));
}

static void test_round_trips(void **state)
{
    (void)state;
    enum { N = 9 };
    const size_t n[3] = {N, N, N};
    const double voxel_m[3] = {2e-6, 2e-6, 3e-6};
    struct volume v, back;
    struct direction_volume d;
    struct rng r;
    rng_start(&r, &(struct rng_key){.seed = 3}, 0, 0);
    assert_int_equal(volume_init(&v, n, voxel_m, NULL), STATUS_OK);
    assert_int_equal(direction_volume_init(&d, n, voxel_m, NULL), STATUS_OK);
    for (size_t i = 0; i < N * N * N; i++) {
        float x[3];
        v.density[i] = rng_float(&r);
        random_direction(&r, x);
        d.density[i] = i % 3 == 0 ? 0 : 255;
        direction_volume_set(&d, i, x);
    }
    for (int encoding = VOL_FLOAT32; encoding <= VOL_UINT8; encoding += 2) {
        float allowed = encoding == VOL_FLOAT32 ? 0.0f : 0.5f / 255.0f + 1e-6f;
        assert_int_equal(vol_write_density(path, &v, (enum vol_encoding)encoding, NULL), STATUS_OK);
        assert_int_equal(vol_read_density(path, &back, NULL), STATUS_OK);
        for (size_t i = 0; i < N * N * N; i++) assert_true(fabsf(back.density[i] - v.density[i]) <= allowed);
        assert_true(fabs(back.voxel_size_m[2] - 3e-6) < 1e-11);
        volume_release(&back);
    }
    double sum = 0.0, worst = 0.0, n_kept = 0.0;
    for (int encoding = VOL_FLOAT32; encoding <= VOL_QUANTISED; encoding += 3) {
        struct vol_header h;
        float *x = NULL;
        assert_int_equal(vol_write_direction(path, &d, (enum vol_encoding)encoding, NULL), STATUS_OK);
        assert_int_equal(vol_read_direction(path, &h, &x, NULL), STATUS_OK);
        for (size_t i = 0; i < N * N * N; i++) {
            float want[3];
            direction_volume_get(&d, i, want);
            double angle = angle_deg(want, x + 3 * i),
                   length = hypot(hypot((double)x[3 * i], (double)x[3 * i + 1]), (double)x[3 * i + 2]);
            assert_true(fabs(length - (d.density[i] > 0 ? 1.0 : 0.0)) < 1e-5);
            if (d.density[i] == 0) continue;
            assert_true(angle < (encoding == VOL_FLOAT32 ? 0.001 : 0.8));
            if (encoding != VOL_QUANTISED) continue;
            sum += angle;
            worst = fmax(worst, angle);
            n_kept += 1.0;
        }
        free(x);
    }
    assert_true(sum / n_kept > 0.25 && sum / n_kept < 0.45); /* 0.36 over the sphere */
    volume_release(&v);
    direction_volume_release(&d);
}

static void test_octahedral(void **state)
{
    (void)state;
    struct direction_volume d;
    struct rng r;
    rng_start(&r, &(struct rng_key){.seed = 4}, 0, 0);
    assert_int_equal(direction_volume_init(&d, shape, size_m, NULL), STATUS_OK);
    for (int i = 0; i < 20000; i++) {
        float want[3], have[3];
        random_direction(&r, want);
        if (i < 6) want[0] = want[1] = want[2] = 0.0f, want[i / 2] = i % 2 ? -1.0f : 1.0f;
        direction_volume_set(&d, 0, want);
        direction_volume_get(&d, 0, have);
        assert_true(angle_deg(want, have) < 0.005);
    }
    direction_volume_release(&d);
}

/* Reads the header of the golden file with another byte at a place, and n_bytes bytes in all. */
static status read_header(size_t at, uint8_t byte, size_t n_channel, size_t n_bytes, struct error *err)
{
    uint8_t bytes[128] = {0};
    struct vol_header h;
    memcpy(bytes, golden_density, sizeof golden_density);
    bytes[20] = (uint8_t)n_channel;
    bytes[at] = byte;
    FILE *f = fopen(path, "w+b");
    assert_int_equal(fwrite(bytes, 1, n_bytes, f), n_bytes);
    fflush(f);
    status s = vol_read_header(f, "a.vol", &h, err);
    fclose(f);
    return s;
}

/* Each encoding has its numbers of channels. Fewer bytes than voxels are an error, and so is a whole row more. */
static void test_headers(void **state)
{
    (void)state;
    struct error err = {0};
    static const size_t bytes_per_voxel[6][4] = {
        [VOL_FLOAT32] = {0, 4, 0, 12}, [VOL_UINT8] = {0, 1, 0, 0}, [4] = {0, 0, 0, 2}};
    for (uint8_t encoding = 0; encoding < 6; encoding++)
        for (size_t n = 0; n < 4; n++) {
            const size_t each = bytes_per_voxel[encoding][n], whole = 48 + 2 * each;
            assert_int_equal(read_header(4, encoding, n, whole, &err), each > 0 ? STATUS_OK : STATUS_UNSUPPORTED);
            if (each == 0) continue;
            assert_int_equal(read_header(4, encoding, n, whole - 1, &err), STATUS_FORMAT);
            assert_int_equal(read_header(4, encoding, n, whole + 2 * each - 1, &err), STATUS_OK);
            assert_int_equal(read_header(4, encoding, n, whole + 2 * each, &err), STATUS_FORMAT);
            assert_non_null(strstr(err.text, "2 x 1 x 1 voxels need"));
        }
    assert_int_equal(read_header(3, 4, 1, 56, &err), STATUS_FORMAT);
    assert_non_null(strstr(err.text, "not a .vol file of version 3"));
    assert_int_equal(read_header(12, 0, 1, 56, &err), STATUS_FORMAT);
    assert_non_null(strstr(err.text, "an impossible size"));
    assert_int_equal(read_header(11, 0xff, 1, 56, &err), STATUS_FORMAT);
    assert_non_null(strstr(err.text, "an impossible size"));
    assert_int_equal(read_header(4, 1, 1, 47, &err), STATUS_FORMAT);
    assert_non_null(strstr(err.text, "the header is incomplete"));
}

static void test_directions_that_are_missing(void **state)
{
    (void)state;
    struct error err = {0};
    struct vol_header h;
    float *x = (float[1]){0};
    assert_int_equal(vol_read_direction("/nonexistent/none.vol", &h, &x, &err), STATUS_NOT_FOUND);
    assert_non_null(strstr(err.text, "cannot read volume 'none.vol'"));
    assert_null(x);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_golden), cmocka_unit_test(test_round_trips),
                                       cmocka_unit_test(test_octahedral), cmocka_unit_test(test_headers),
                                       cmocka_unit_test(test_directions_that_are_missing)};
    return cmocka_run_group_tests(tests, make_folder, NULL);
}
