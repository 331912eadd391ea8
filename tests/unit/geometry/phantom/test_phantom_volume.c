/* Volumes of phantoms have the requested material, noise, rings and gradient, as TIFF and MetaImage files. */
#include "geometry/phantom/phantom.h"
#include "tests/support/scratch_folder.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <tiffio.h>

#include <cmocka.h>

/* One fiber, straight, through the whole tile of 40 voxels in an oblique direction; z in the middle of 30 voxels. */
static struct fiber_set oblique_fiber(double radius_m)
{
    struct fiber_set f;
    fiber_set_init(&f);
    assert_int_equal(fiber_set_reserve(&f, 1, 41, NULL), STATUS_OK);
    f.first_vertex[1] = 41;
    f.tile_size_m[0] = f.tile_size_m[1] = 80e-6;
    f.radius_m[0] = (float)radius_m;
    for (size_t k = 0; k <= 40; k++) {
        f.position_m[3 * k] = 2e-6f * (float)k;
        f.position_m[3 * k + 1] = 1.46e-6f * (float)k + 45.3e-6f; /* leaves through y and comes back */
        f.position_m[3 * k + 2] = 28.7e-6f + 0.11e-6f * (float)k;
    }
    return f;
}

static void test_volume_holds_the_material(void **state)
{
    (void)state;
    const size_t n[3] = {40, 40, 30};
    const double radius_voxel[] = {0.1, 0.3, 0.5, 1.0, 1.7, 3.5, 6.0};
    for (size_t i = 0; i < sizeof radius_voxel / sizeof radius_voxel[0]; i++)
        for (int blurred = 0; blurred < 2; blurred++) {
            struct fiber_set f = oblique_fiber(2e-6 * radius_voxel[i]);
            struct phantom_scan_option o;
            struct volume v;
            double sum = 0;
            phantom_scan_option_default(&o);
            o.snr = 0.0;
            o.blur_sd_voxel = blurred ? 0.9 : 0.0;
            assert_int_equal(phantom_scan(&f, n, &o, NULL, NULL, &v, NULL), STATUS_OK);
            for (size_t k = 0; k < volume_n_voxel(n); k++) {
                assert_true(v.density[k] >= 0.0f && v.density[k] <= 1.0f + 1e-5f);
                sum += (double)v.density[k];
            }
            double want = M_PI * radius_voxel[i] * radius_voxel[i] * 40.0 * sqrt(1.0 + 0.73 * 0.73 + 0.055 * 0.055);
            /* the flat ends are cut to whole voxel centres: at most half a voxel of 49 */
            if (fabs(sum / want - 1.0) >= 0.01) fail_msg("radius %g: %g of the material", radius_voxel[i], sum / want);
            volume_release(&v);
            fiber_set_release(&f);
        }
}

static void test_noise_is_as_asked(void **state)
{
    (void)state;
    const size_t n[3] = {40, 40, 60};
    struct fiber_set f = oblique_fiber(4e-6);
    struct phantom_scan_option o;
    struct volume clean, v[3];
    phantom_scan_option_default(&o);
    o.snr = 0.0;
    assert_int_equal(phantom_scan(&f, n, &o, NULL, NULL, &clean, NULL), STATUS_OK);
    o.snr = 5.0;
    for (size_t i = 0; i < 3; i++) {
        struct thread_pool *pool = NULL;
        if (i > 0) assert_int_equal(thread_pool_new(i, &pool, NULL), STATUS_OK);
        struct scratch_space *space = NULL; /* the last one in slabs of eight slices */
        if (i == 2) assert_int_equal(scratch_space_new(".", 1 << 20, &space, NULL), STATUS_OK);
        assert_int_equal(phantom_scan_in(&f, n, &o, space, pool, NULL, &v[i], NULL), STATUS_OK);
        thread_pool_free(pool);
        assert_memory_equal(v[i].density, v[0].density, volume_n_voxel(n) * sizeof(float));
        if (i == 2) volume_release(&v[2]);
        scratch_space_free(space);
    }
    double sum = 0, square = 0, count = (double)volume_n_voxel(n);
    for (size_t k = 0; k < volume_n_voxel(n); k++) {
        double d = (double)(v[0].density[k] - clean.density[k]);
        sum += d;
        square += d * d;
    }
    assert_true(fabs(sum / count) < 5.0 * 0.2 / sqrt(count));
    assert_true(fabs(square / count - 0.04) < 5.0 * 0.04 * sqrt(2.0 / count));
    for (size_t i = 0; i < 2; i++) volume_release(&v[i]);
    volume_release(&clean);
    /* Poisson: in the void a tenth of the counts, variance 0.1 / N / 0.81 */
    o.snr = 0.0;
    o.poisson_count = 400.0;
    assert_int_equal(phantom_scan(&f, n, &o, NULL, NULL, &v[0], NULL), STATUS_OK);
    square = 0;
    count = 0;
    for (size_t k = 40 * 40 * 35; k < volume_n_voxel(n); k++, count++) square += pow((double)v[0].density[k], 2);
    double want = 0.1 / 400.0 / 0.81,
           fourth = (1.0 + 3.0 * 40.0) / 40.0; /* of the fourth moment to the variance's square */
    assert_true(fabs(square / count - want) < 5.0 * want * sqrt((fourth - 1.0) / count));
    volume_release(&v[0]);
    fiber_set_release(&f);
}

static void test_rings_and_gradient(void **state)
{
    (void)state;
    const size_t n[3] = {40, 40, 30};
    struct fiber_set f = oblique_fiber(4e-6);
    struct phantom_scan_option o;
    struct volume v;
    phantom_scan_option_default(&o);
    o.snr = 0.0;
    o.ring_amplitude = 0.1;
    assert_int_equal(phantom_scan(&f, n, &o, NULL, NULL, &v, NULL), STATUS_OK);
    double square = 0;
    for (size_t k = 0; k < 1600; k++) {
        assert_true(v.density[k] == v.density[k + 1600 * 29]); /* the same in every empty slice */
        square += pow((double)v.density[k], 2);
    }
    assert_true(sqrt(square / 1600) > 0.05 && sqrt(square / 1600) < 0.15);
    volume_release(&v);
    o.ring_amplitude = 0.0;
    o.gradient = 0.5;
    o.blur_sd_voxel = 0.0;
    assert_int_equal(phantom_scan(&f, n, &o, NULL, NULL, &v, NULL), STATUS_OK);
    double highest = 0;
    for (size_t k = 0; k < volume_n_voxel(n); k++) highest = fmax(highest, (double)v.density[k]);
    assert_true(highest > 1.4 && highest < 1.5);
    volume_release(&v);
    o.blur_sd_voxel = -1.0;
    struct error err;
    assert_int_equal(phantom_scan(&f, n, &o, NULL, NULL, &v, &err), STATUS_INVALID);
    assert_string_equal(err.field, "blur_sd_voxel");
    fiber_set_release(&f);
}

static struct volume ramp_volume(void)
{
    const size_t n[3] = {5, 4, 3};
    const double size[3] = {2e-6, 2e-6, 2.5e-6};
    struct volume v;
    assert_int_equal(volume_init(&v, n, size, NULL), STATUS_OK);
    for (size_t k = 0; k < 60; k++) v.density[k] = ((float)k - 10.0f) / 20.0f; /* -0.5 .. 2.45 */
    return v;
}

static double coded(double signal, const struct phantom_file_option *o)
{
    double top = o->bits == 8 ? 255 : 65535;
    return fmin(top, fmax(0, round(o->void_value + (double)(float)signal * (o->fiber_value - o->void_value))));
}

static void test_tiff_pages(void **state)
{
    struct volume v = ramp_volume();
    const char *path = scratch_path(state, "v.tif");
    for (int bits = 8; bits <= 16; bits += 8)
        for (int deflate = 0; deflate < 2; deflate++) {
            const struct phantom_file_option o = {bits, bits == 8 ? 50 : 10000, bits == 8 ? 170 : 40000, deflate == 1};
            assert_int_equal(phantom_write_tiff(&v, &o, path, NULL), STATUS_OK);
            TIFF *t = TIFFOpen(path, "r");
            assert_non_null(t);
            assert_int_equal(TIFFNumberOfDirectories(t), 3);
            for (size_t k = 0; k < 3; k++) {
                uint8_t row[16];
                uint32_t width = 0, height = 0;
                assert_int_equal(TIFFSetDirectory(t, (tdir_t)k), 1);
                TIFFGetField(t, TIFFTAG_IMAGEWIDTH, &width);
                TIFFGetField(t, TIFFTAG_IMAGELENGTH, &height);
                assert_true(width == 5 && height == 4);
                for (uint32_t j = 0; j < 4; j++) {
                    assert_int_equal(TIFFReadScanline(t, row, j, 0), 1);
                    for (size_t i = 0; i < 5; i++) {
                        uint16_t wide;
                        memcpy(&wide, row + 2 * i, 2);
                        double got = bits == 8 ? row[i] : wide;
                        assert_true(got == coded(((double)volume_index(v.n, i, j, k) - 10.0) / 20.0, &o));
                    }
                }
            }
            TIFFClose(t);
        }
    struct error err;
    struct phantom_file_option o;
    phantom_file_option_default(&o);
    assert_int_equal(phantom_write_tiff(&v, &o, scratch_path(state, "none/v.tif"), &err), STATUS_IO);
    o.bits = 12;
    assert_int_equal(phantom_write_tiff(&v, &o, path, &err), STATUS_INVALID);
    volume_release(&v);
}

static void test_metaimage(void **state)
{
    struct volume v = ramp_volume();
    struct phantom_file_option o;
    size_t n;
    uint16_t value[60];
    phantom_file_option_default(&o);
    assert_int_equal(phantom_write_metaimage(&v, &o, scratch_path(state, "w.mhd"), NULL), STATUS_OK);
    char *header = scratch_read(scratch_path(state, "w.mhd"), NULL),
         *data = scratch_read(scratch_path(state, "w.raw"), &n);
    assert_non_null(strstr(
        header,
        "DimSize = 5 4 3\nElementSpacing = 0.002 0.002 0.0025\nElementType = MET_USHORT\nElementDataFile = w.raw\n"));
    assert_int_equal(n, sizeof value);
    memcpy(value, data, sizeof value);
    for (size_t k = 0; k < 60; k++) assert_true(value[k] == coded(((double)k - 10.0) / 20.0, &o));
    free(header);
    free(data);
    struct error err;
    assert_int_equal(phantom_write_metaimage(&v, &o, scratch_path(state, "w.tif"), &err), STATUS_INVALID);
    volume_release(&v);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_volume_holds_the_material),
        cmocka_unit_test(test_noise_is_as_asked),
        cmocka_unit_test(test_rings_and_gradient),
        cmocka_unit_test(test_tiff_pages),
        cmocka_unit_test(test_metaimage),
    };
    return cmocka_run_group_tests(tests, scratch_folder_setup, scratch_folder_teardown);
}
