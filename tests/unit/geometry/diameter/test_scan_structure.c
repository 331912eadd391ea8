/* Noise of any kind shows no structure, and fibers in strong noise do; a scan of noise alone is refused with the
 * reason. */
#include "base/option_id.h"
#include "base/rng.h"
#include "geometry/diameter/scale_space.h"
#include "geometry/diameter/scan_structure.h"
#include "geometry/reconstruct/noise_refusal.h"
#include "geometry/reconstruct/reconstruct.h"
#include "tests/support/scan/scan_files.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

enum { N_SIDE = 80 };
static const double voxel_m[3] = {2e-6, 2e-6, 2e-6};

enum noise_kind { WHITE, CORRELATED, BYTES, PHOTONS, UNEVEN, N_KIND };

/* Number of events of a Poisson process whose mean is 3. */
static float draw_photons(struct rng *r)
{
    int n = 0;
    for (double p = rng_double(r); p > exp(-3.0); p *= rng_double(r)) n++;
    return (float)n;
}

static void make_noise(struct volume *v, enum noise_kind kind, uint64_t seed)
{
    const size_t side = kind == CORRELATED ? SCALE_EDGE : N_SIDE, n[3] = {side, side, side};
    assert_int_equal(volume_init(v, n, voxel_m, NULL), STATUS_OK);
    test_fill_cylinders(v, NULL, 0, 1.0, seed);
    const struct rng_key key = {.seed = seed};
    struct rng r;
    rng_start(&r, &key, 1, 0);
    for (size_t i = 0; i < volume_n_voxel(n); i++) {
        const float y = (float)(i / N_SIDE % N_SIDE) / N_SIDE;
        if (kind == BYTES) v->density[i] = floorf(256.0f * (float)rng_double(&r));
        if (kind == PHOTONS) v->density[i] = draw_photons(&r);
        if (kind == UNEVEN) v->density[i] = 1000.0f + (1.0f + 0.7f * y) * v->density[i];
    }
    if (kind != CORRELATED) return;
    float *scratch = malloc(volume_n_voxel(n) * sizeof *scratch);
    assert_non_null(scratch);
    scale_blur(v->density, scratch, n, 1.2);
    free(scratch);
}

static double deviation_of(struct volume *v)
{
    double deviation = NAN;
    assert_int_equal(scan_structure_measure(v, NULL, &deviation, NULL), STATUS_OK);
    volume_release(v);
    return deviation;
}

static void test_noise_has_no_structure(void **state)
{
    (void)state;
    for (enum noise_kind kind = WHITE; kind < N_KIND; kind++)
        for (uint64_t seed = 1; seed < 4; seed++) {
            struct volume v;
            make_noise(&v, kind, seed);
            const double deviation = deviation_of(&v);
            print_message("noise %d, seed %u: %.2f standard errors\n", (int)kind, (unsigned)seed, deviation);
            assert_true(deviation < 0.8 * SCAN_STRUCTURE_LEAST);
        }
}

/* One fiber of seven voxels in noise of twice the step from void to material, and fibers of four voxels in noise of the
 * step, are structure. */
static void test_fibers_in_noise_are_structure(void **state)
{
    (void)state;
    static const struct {
        double diameter, noise;
        size_t n_fiber;
    } row[] = {{7.0, 1.0, 1}, {7.0, 2.0, 4}, {4.0, 1.0, 12}, {4.0, 0.5, 3}, {20.0, 1.0, 2}};
    for (size_t k = 0; k < sizeof row / sizeof *row; k++) {
        const size_t n[3] = {N_SIDE, N_SIDE, N_SIDE};
        struct test_cylinder c[12];
        struct volume v;
        for (size_t i = 0; i < row[k].n_fiber; i++)
            c[i] = (struct test_cylinder){
                {40.0, 20.0 + 1.2 * row[k].diameter * (double)(i % 4), 30.0 + 1.2 * row[k].diameter * (double)(i / 4)},
                {1.0, 0.1, 0.02 * (double)i},
                0.5 * row[k].diameter};
        assert_int_equal(volume_init(&v, n, voxel_m, NULL), STATUS_OK);
        test_fill_cylinders(&v, c, row[k].n_fiber, row[k].noise, 11 + k);
        const double deviation = deviation_of(&v);
        print_message("%zu fibers of %.0f voxels, noise %.1f: %.1f\n", row[k].n_fiber, row[k].diameter, row[k].noise,
                      deviation);
        assert_true(deviation > 1.2 * SCAN_STRUCTURE_LEAST);
    }
}

/* Where nothing can be said, as in a scan of few slices, nothing is refused. */
static void test_thin_scans_are_not_judged(void **state)
{
    (void)state;
    const size_t n[3] = {N_SIDE, N_SIDE, 8};
    struct volume v;
    assert_int_equal(volume_init(&v, n, voxel_m, NULL), STATUS_OK);
    test_fill_cylinders(&v, NULL, 0, 1.0, 3);
    assert_true(isinf(deviation_of(&v)));
}

static void count_warning(void *context, const char *option, const char *text)
{
    assert_string_equal(option, OPTION_SCAN_FILES);
    assert_non_null(strstr(text, "slices in the middle of the scan show nothing but noise"));
    ++*(int *)context;
}

/* The check of a job says so before it starts, unless the job states a diameter. */
static void check_early_refusal(const char *path)
{
    int n_warning = 0;
    const struct warning_sink warn = {count_warning, &n_warning};
    struct reconstruct_option o;
    struct error err = {0};
    reconstruct_option_default(&o);
    assert_int_equal(noise_refuse_early(&path, 1, &o, &warn, &err), STATUS_INVALID);
    assert_string_equal(err.field, OPTION_SCAN_FILES);
    assert_non_null(strstr(err.text, "nothing but noise"));
    o.fiber_diameter_voxel = 7.0;
    assert_int_equal(noise_refuse_early(&path, 1, &o, &warn, &err), STATUS_OK);
    assert_int_equal(n_warning, 0);
}

/* A scan whose middle is noise and whose first slices are not: small, it is looked at whole and passes; large, it is
 * warned of. */
static void test_scans_with_noise_in_the_middle(void **state)
{
    (void)state;
    char folder[64], path[96];
    const char *file = path;
    test_make_folder(folder);
    snprintf(path, sizeof path, "%s/scan.raw", folder);
    for (size_t large = 0; large < 2; large++) {
        const size_t side = large > 0 ? 460 : 200;
        struct reconstruct_option o;
        struct error err = {0};
        struct rng r;
        int n_warning = 0;
        const struct warning_sink warn = {count_warning, &n_warning};
        FILE *raw = fopen(path, "wb");
        uint8_t *row = malloc(side);
        assert_true(raw != NULL && row != NULL);
        rng_start(&r, &(struct rng_key){.seed = 9}, 1, 0);
        for (size_t k = 0; k < N_SIDE * side; k++) {
            /* a bright block below, noise of the sum of four draws above */
            for (size_t i = 0; i < side; i++)
                row[i] = k / side < 4 && i > side / 2
                             ? 250
                             : (uint8_t)(25.0 * (rng_double(&r) + rng_double(&r) + rng_double(&r) + rng_double(&r)));
            assert_int_equal(fwrite(row, 1, side, raw), side);
        }
        free(row);
        assert_int_equal(fclose(raw), 0);
        reconstruct_option_default(&o);
        memcpy(o.raw.n, (size_t[3]){side, side, N_SIDE}, sizeof o.raw.n);
        snprintf(o.raw.type, sizeof o.raw.type, "uint8");
        assert_int_equal(noise_refuse_early(&file, 1, &o, &warn, &err), STATUS_OK);
        assert_int_equal(n_warning, large);
    }
    unlink(path);
    rmdir(folder);
}

/* The step that reads a scan of noise says why it ends, unless the job states a diameter. */
static void test_noise_is_refused(void **state)
{
    (void)state;
    char folder[64], path[96];
    const char *file = path;
    static uint16_t pixel[N_SIDE][N_SIDE * N_SIDE];
    struct test_page page[N_SIDE];
    struct volume v;
    test_make_folder(folder);
    snprintf(path, sizeof path, "%s/noise.tif", folder);
    make_noise(&v, WHITE, 5);
    for (size_t i = 0; i < volume_n_voxel(v.n); i++) pixel[0][i] = (uint16_t)(20000.0f + 1000.0f * v.density[i]);
    volume_release(&v);
    for (size_t k = 0; k < N_SIDE; k++) page[k] = (struct test_page){N_SIDE, N_SIDE, 16, pixel[k]};
    test_write_tiff(path, page, N_SIDE, 1, TEST_STRIPS);
    for (int given = 0; given < 2; given++) {
        struct reconstruct_option o;
        struct reconstruct_report report = {0};
        struct error err = {0};
        reconstruct_option_default(&o);
        for (int a = 0; a < 3; a++) o.voxel_size_m[a] = voxel_m[a];
        if (given) o.fiber_diameter_voxel = 7.0;
        const status s = reconstruct_read(&file, 1, &o, NULL, NULL, NULL, &v, &report, &err);
        assert_int_equal(s, given ? STATUS_OK : STATUS_INVALID);
        if (given) {
            volume_release(&v);
            continue;
        }
        print_message("%s\n", err.text);
        assert_string_equal(err.field, OPTION_SCAN_FILES);
        assert_non_null(strstr(err.text, "nothing but noise"));
        assert_non_null(strstr(err.text, "separability 0.6"));
    }
    check_early_refusal(path);
    unlink(path);
    rmdir(folder);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_noise_has_no_structure),         cmocka_unit_test(test_fibers_in_noise_are_structure),
        cmocka_unit_test(test_thin_scans_are_not_judged),      cmocka_unit_test(test_noise_is_refused),
        cmocka_unit_test(test_scans_with_noise_in_the_middle),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
