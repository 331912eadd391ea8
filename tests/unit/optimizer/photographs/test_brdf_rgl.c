/* Files of RGL's database: values that are known in closed form, symmetries, spectra, samples that were not measured,
 * damaged files. tests/api/photographs/test_measured_brdf.py compares with another writer, and with Mitsuba. */
#include "optimizer/job/document/job_rows.h"
#include "optimizer/photographs/rows/brdf_file.h"
#include "optimizer/photographs/rows/brdf_spectrum.h"
#include "tests/support/rgl_bytes.h"
#include "tests/support/scratch_folder.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>

#include <cmocka.h>

static status open_bytes(void **state, struct rgl_bytes *b, enum job_symmetry symmetry, void **handle,
                         struct error *err)
{
    scratch_write(scratch_path(state, "a.bsdf"), b->bytes, b->n);
    return rgl_brdf_reader.open(scratch_path(state, "a.bsdf"), symmetry, handle, err);
}

static void *must_open(void **state, struct rgl_bytes *b)
{
    void *handle = NULL;
    struct error err = {0};
    rgl_bytes_make(b);
    if (open_bytes(state, b, JOB_SYMMETRY_FILE, &handle, &err) != STATUS_OK) fail_msg("%s", err.text);
    return handle;
}

static void place(double theta_deg, double phi_deg, double v[3])
{
    double t = theta_deg * M_PI / 180.0, p = phi_deg * M_PI / 180.0;
    v[0] = sin(t) * cos(p);
    v[1] = sin(t) * sin(p);
    v[2] = cos(t);
}

/* The closed form; n_fold: the light is brought to an azimuth in the first 1 / n_fold of a turn from -pi. */
static double known(const double light[3], const double camera[3], int n_fold, bool isotropic)
{
    double l[2] = {light[0], light[1]}, c[2] = {camera[0], camera[1]}, sign[2] = {1, 1};
    if (n_fold == 4 && l[0] >= 0) sign[0] = -1;
    if (n_fold >= 2 && l[1] >= 0) sign[1] = -1;
    if (n_fold == 2) sign[0] = sign[1];
    for (int i = 0; i < 2; i++) {
        l[i] *= sign[i];
        c[i] *= sign[i];
    }
    double phi_l = atan2(l[1], l[0]), phi_m = atan2(l[1] + c[1], l[0] + c[0]) - (isotropic ? phi_l : 0.0);
    double theta_m = atan2(hypot(l[0] + c[0], l[1] + c[1]), light[2] + camera[2]);
    double x = sqrt(theta_m * 2.0 / M_PI), y = fmod(phi_m + 3.0 * M_PI, 2.0 * M_PI) / (2.0 * M_PI);
    return (0.1 + 0.1 * (x + x * x) + 0.05 * y + (isotropic ? 0.0 : 0.03 * (phi_l + M_PI))) / camera[2];
}

static void compare(const void *handle, int n_fold, bool isotropic)
{
    for (size_t i = 0; i < 400; i++) {
        double light[3], camera[3], f[3];
        place((double)(i % 10) * 8.0 + 1.0, (double)(i / 2 % 20) * 18.0 - 175.0, light);
        place((double)(i / 10 % 8) * 10.0 + 2.0, (double)(i % 19) * 19.0 + 7.0, camera);
        assert_true(rgl_brdf_reader.eval(handle, light, camera, f));
        double want = known(light, camera, n_fold, isotropic);
        for (size_t c = 0; c < 3; c++)
            if (!(fabs(f[c] / want / (double)(c + 1) - 1.0) < 1e-5)) fail_msg("%zu: %g, not %g", i, f[c], want);
    }
}

static void test_isotropic(void **state)
{
    struct rgl_bytes b = {.n_phi = 1};
    void *handle = must_open(state, &b);
    assert_true(rgl_brdf_reader.isotropic(handle));
    compare(handle, 1, true);
    rgl_brdf_reader.close(handle);
}

static void test_symmetries(void **state)
{
    static const int fold[3] = {1, 2, 4};
    for (size_t i = 0; i < 3; i++) {
        struct rgl_bytes b = {.n_phi = 5, .turn_rad = 2.0 * M_PI / fold[i]};
        void *handle = must_open(state, &b);
        assert_false(rgl_brdf_reader.isotropic(handle));
        compare(handle, fold[i], false);
        rgl_brdf_reader.close(handle);
    }
}

static void test_spectra(void **state)
{
    struct rgl_bytes b = {.n_phi = 1, .n_wavelength = 31, .first_nm = 400, .step_nm = 10};
    double light[3], camera[3], f[3], weight[31][3], nm[31], sum[3] = {0}, step[3] = {0};
    void *handle = must_open(state, &b), *none = NULL;
    struct error err = {0};
    place(30, 0, light);
    place(50, 160, camera);
    assert_true(rgl_brdf_reader.eval(handle, light, camera, f));
    for (size_t c = 0; c < 3; c++) assert_true(fabs(f[c] / known(light, camera, 1, true) - 1.0) < 1e-5);
    rgl_brdf_reader.close(handle);
    for (size_t i = 0; i < 31; i++) nm[i] = 400.0 + 10.0 * (double)i;
    assert_true(brdf_spectrum_weights(nm, 31, weight));
    for (size_t i = 0; i < 31; i++)
        for (size_t c = 0; c < 3; c++) {
            sum[c] += weight[i][c];
            if (nm[i] > 590.0)
                step[c] += weight[i][c]; /* linear sRGB of a long-pass filter: red above 1, blue below 0 */
        }
    for (size_t c = 0; c < 3; c++) assert_true(fabs(sum[c] - 1.0) < 1e-12);
    assert_true(step[0] > 0.9 && step[1] < 0.2 && fabs(step[2]) < 0.05);
    b.step_nm = 5.0; /* up to 550 nm only */
    rgl_bytes_make(&b);
    assert_int_equal(open_bytes(state, &b, JOB_SYMMETRY_FILE, &none, &err), STATUS_FORMAT);
    assert_non_null(strstr(err.text, "'a.bsdf': its wavelengths give no color"));
}

static void test_rgb_has_three_channels(void **state)
{
    for (size_t n_rgb = 1; n_rgb <= 4; n_rgb++) {
        struct rgl_bytes b = {.n_phi = 1, .n_rgb = n_rgb};
        struct error err = {0};
        void *handle = NULL;
        rgl_bytes_make(&b);
        status s = open_bytes(state, &b, JOB_SYMMETRY_FILE, &handle, &err);
        if (n_rgb == 3) {
            assert_int_equal(s, STATUS_OK);
            rgl_brdf_reader.close(handle);
        } else {
            assert_int_equal(s, STATUS_FORMAT);
            assert_non_null(strstr(err.text, "'a.bsdf': its rgb has another shape than RGL's"));
        }
    }
}

/* The numbers of azimuths, inclinations, rows and columns are those of the other fields, and two or more. */
static void test_rgb_has_the_shape_of_the_axes(void **state)
{
    const uint64_t shape[5] = {1, 2, 3, 2, 2};
    const uint64_t other[4][5] = {{2, 1, 3, 2, 2}, {1, 1, 3, 2, 2}, {1, 2, 3, 1, 2}, {1, 2, 3, 2, 1}};
    for (size_t i = 0; i < 4; i++) {
        struct rgl_bytes b = {.n_phi = 1};
        struct error err = {0};
        void *handle = NULL;
        size_t at = 0;
        rgl_bytes_make(&b);
        while (memcmp(b.bytes + at, shape, sizeof shape) != 0) at++;
        memcpy(b.bytes + at, other[i], sizeof shape);
        assert_int_equal(open_bytes(state, &b, JOB_SYMMETRY_FILE, &handle, &err), STATUS_FORMAT);
        if (strstr(err.text, "'a.bsdf': its rgb or spectra have another shape than RGL's") == NULL)
            fail_msg("%zu: %s", i, err.text);
    }
}

/* Between and beyond few wavelengths a spectrum is what the same spectrum is at each nanometre. */
static void test_few_wavelengths(void **state)
{
    (void)state;
    enum { FEW = 15, FINE = 421 };
    double few[FEW], v[FEW], weight[FEW][3], rgb[3] = {0}, fine[FINE], fine_rgb[3] = {0};
    static double fine_weight[FINE][3];
    for (size_t i = 0; i < FEW; i++) {
        few[i] = 410.0 + 20.0 * (double)i;
        v[i] = 0.2 + 0.1 * (double)(i * i % 7);
    }
    for (size_t i = 0; i < FINE; i++) fine[i] = 360.0 + (double)i;
    assert_true(brdf_spectrum_weights(few, FEW, weight) && brdf_spectrum_weights(fine, FINE, fine_weight));
    for (size_t c = 0; c < 3; c++) {
        for (size_t i = 0; i < FEW; i++) rgb[c] += weight[i][c] * v[i];
        for (size_t i = 0; i < FINE; i++) {
            const double at = fmin(fmax((fine[i] - few[0]) / 20.0, 0.0), FEW - 1.0);
            const size_t k = (size_t)fmin(at, FEW - 2.0);
            fine_rgb[c] += fine_weight[i][c] * (v[k] + (at - (double)k) * (v[k + 1] - v[k]));
        }
        if (fabs(rgb[c] - fine_rgb[c]) > 1e-9) fail_msg("channel %zu: %.9g, not %.9g", c, rgb[c], fine_rgb[c]);
    }
}

static void test_not_measured(void **state)
{
    struct rgl_bytes b = {.n_phi = 1, .some_not_measured = true};
    double light[3], near_mirror[3], far[3], f[3];
    void *handle = must_open(state, &b);
    place(20, 0, light);
    place(20, 180, near_mirror);
    place(85, 0, far); /* normals beyond the middle of x' */
    assert_true(rgl_brdf_reader.eval(handle, light, near_mirror, f));
    place(80, 0, light);
    assert_false(rgl_brdf_reader.eval(handle, light, far, f));
    rgl_brdf_reader.close(handle);
}

static void refused(void **state, struct rgl_bytes *b, enum job_symmetry symmetry, const char *text)
{
    void *handle = NULL;
    struct error err = {0};
    assert_int_equal(open_bytes(state, b, symmetry, &handle, &err), STATUS_FORMAT);
    if (strstr(err.text, text) == NULL) fail_msg("%s", err.text);
    assert_non_null(strstr(err.text, "'a.bsdf'"));
}

static void test_refused(void **state)
{
    struct rgl_bytes b = {.n_phi = 1};
    rgl_bytes_make(&b);
    size_t n = b.n;
    refused(state, &b, JOB_SYMMETRY_ANISOTROPIC, "it is isotropic");
    for (b.n = 0; b.n < n; b.n += 7) refused(state, &b, JOB_SYMMETRY_FILE, "");
    b.n = n;
    b.bytes[12] = 2;
    refused(state, &b, JOB_SYMMETRY_FILE, "version");
    b.bytes[0] = 'T';
    refused(state, &b, JOB_SYMMETRY_FILE, "does not begin as an RGL file");
    b.without_sigma = true;
    rgl_bytes_make(&b);
    refused(state, &b, JOB_SYMMETRY_FILE, "it lacks sigma");
    static const float bad[] = {-0.001f, NAN, 2e9f, INFINITY}, half = 0.5f;
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) { /* in place of a value of sigma, and of the last value */
        b.without_sigma = false;
        rgl_bytes_make(&b);
        size_t at = 0;
        while (memcmp(b.bytes + at, &half, 4) != 0 || memcmp(b.bytes + at + 4, &half, 4) != 0) at++;
        memcpy(b.bytes + at + 4, &bad[i], 4);
        refused(state, &b, JOB_SYMMETRY_FILE, "its sigma, ndf or vndf have values below 0");
    }
    struct rgl_bytes third = {.n_phi = 5, .turn_rad = 2.0 * M_PI / 3.0};
    rgl_bytes_make(&third);
    refused(state, &third, JOB_SYMMETRY_FILE, "neither a whole, a half nor a quarter");
    refused(state, &third, JOB_SYMMETRY_FILE, "'a.bsdf'");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_isotropic),
        cmocka_unit_test(test_symmetries),
        cmocka_unit_test(test_spectra),
        cmocka_unit_test(test_few_wavelengths),
        cmocka_unit_test(test_rgb_has_three_channels),
        cmocka_unit_test(test_rgb_has_the_shape_of_the_axes),
        cmocka_unit_test(test_not_measured),
        cmocka_unit_test(test_refused),
    };
    return cmocka_run_group_tests(tests, scratch_folder_setup, scratch_folder_teardown);
}
