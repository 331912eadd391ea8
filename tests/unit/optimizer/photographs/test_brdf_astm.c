/* Files of goniometers: a BRDF that is known in closed form comes back between its samples; columns, units,
 * symmetry, the choice of rows, damaged files. */
#include "base/option_id.h"
#include "optimizer/photographs/rows/brdf_file.h"
#include "optimizer/photographs/rows/observation_load.h"
#include "tests/support/scratch_folder.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "tests/support/job_document_text.h"

static void place(double theta, double phi, double v[3])
{
    v[0] = sin(theta) * cos(phi);
    v[1] = sin(theta) * sin(phi);
    v[2] = cos(theta);
}

static double lambert(const double light[3], const double camera[3]) { return 0.25 + 0.0 * (light[0] + camera[0]); }

/* A lobe about the half vector, narrower across the weft when `squeeze` is above 1. */
static double squeeze = 1.0;
static double lobe(const double light[3], const double camera[3])
{
    double h[3], length = 0.0;
    for (int c = 0; c < 3; c++) h[c] = light[c] + camera[c];
    length = sqrt(h[0] * h[0] + h[1] * h[1] + h[2] * h[2]);
    return 0.05 + 0.2 * exp(-(h[0] * h[0] + squeeze * h[1] * h[1]) / (length * length) / 0.15);
}

static const double degree = M_PI / 180.0;

/* Light at n_phi azimuths, every 15 degrees of elevation; the detector every 7.5 by 15 degrees. */
static const char *write_astm(void **state, const char *name, double (*f)(const double *, const double *), int n_phi,
                              double unit)
{
    const char *path = scratch_path(state, name);
    FILE *file = fopen(path, "w");
    assert_non_null(file);
    fprintf(file, "ASTM\nKEYWORD value\nNUM_POINTS 1\nVARS theta_i,phi_i,theta_s,phi_s,R,G,B\r\n");
    for (int i = 0; i < 6 * n_phi; i++)
        for (int j = 0; j < 11 * 24; j++) {
            double a = 15.0 * (i / n_phi), b = 360.0 / n_phi * (i % n_phi), c = 7.5 * (j / 24), d = 15.0 * (j % 24);
            double light[3], camera[3];
            place(a * degree, b * degree, light);
            place(c * degree, d * degree, camera);
            double value = f(light, camera);
            fprintf(file, "%.9g,%.9g,%.9g,%.9g,%.9g,%.9g,%.9g\n", a * unit, b * unit, c * unit, d * unit, value,
                    2.0 * value, -value);
        }
    assert_int_equal(fclose(file), 0);
    return path;
}

static void *must_open(const char *path, enum job_symmetry symmetry)
{
    void *handle = NULL;
    struct error err = {0};
    if (astm_brdf_reader.open(path, symmetry, &handle, &err) != STATUS_OK) fail_msg("%s", err.text);
    return handle;
}

/* Largest and root mean square relative error between the samples, which are as far apart as half the width of the
 * lobe. */
static double compare(const void *handle, double (*f)(const double *, const double *), double *rms)
{
    double worst = 0.0, sum = 0.0;
    for (size_t i = 0; i < 200; i++) {
        double light[3], camera[3], value[3];
        place((double)(i % 7) * 9.0 * degree + 0.05, (double)(i % 13) * 0.45, light);
        place((double)(i % 11) * 6.0 * degree + 0.1, (double)(i % 17) * 0.37, camera);
        assert_true(astm_brdf_reader.eval(handle, light, camera, value));
        double error = fabs(value[0] / f(light, camera) - 1.0);
        assert_true(fabs(value[1] / value[0] - 2.0) < 1e-6);
        assert_true(value[2] >= 0.0 && value[2] < 1e-300); /* negative values count as 0 */
        worst = fmax(worst, error);
        sum += error * error;
    }
    *rms = sqrt(sum / 200.0);
    return worst;
}

static void test_values_between(void **state)
{
    double rms;
    void *handle = must_open(write_astm(state, "a.astm", lambert, 1, degree), JOB_SYMMETRY_FILE);
    assert_true(astm_brdf_reader.isotropic(handle));
    assert_true(compare(handle, lambert, &rms) < 1e-6);
    astm_brdf_reader.close(handle);
    squeeze = 1.0;
    handle = must_open(write_astm(state, "b.astm", lobe, 1, 1.0), JOB_SYMMETRY_FILE);
    double worst = compare(handle, lobe, &rms);
    if (!(worst < 0.12 && rms < 0.02)) fail_msg("isotropic: %g, %g", worst, rms);
    astm_brdf_reader.close(handle);
    squeeze = 2.0;
    handle = must_open(write_astm(state, "c.astm", lobe, 8, 1.0), JOB_SYMMETRY_FILE);
    assert_false(astm_brdf_reader.isotropic(handle));
    worst = compare(handle, lobe, &rms);
    if (!(worst < 0.15 && rms < 0.025)) fail_msg("anisotropic: %g, %g", worst, rms);
    astm_brdf_reader.close(handle);
}

static void test_one_plane(void **state)
{
    double light[3], camera[3], f[3];
    void *handle = must_open(write_astm(state, "a.astm", lambert, 1, degree), JOB_SYMMETRY_ANISOTROPIC);
    assert_false(astm_brdf_reader.isotropic(handle));
    place(45 * degree, 0, light);
    place(45 * degree, 60 * degree, camera);
    assert_true(astm_brdf_reader.eval(handle, light, camera, f));
    place(45 * degree, 120 * degree, light); /* both turned */
    place(45 * degree, 180 * degree, camera);
    assert_false(astm_brdf_reader.eval(handle, light, camera, f));
    astm_brdf_reader.close(handle);
}

static status load(void **state, const char *measurements, struct observation_set *o, struct error *err)
{
    char text[1024], folder[1024];
    const char *path = scratch_path(state, "x");
    snprintf(folder, sizeof folder, "%.*s", (int)(strrchr(path, '/') - path), path);
    snprintf(text, sizeof text, "{\"sample\":\"s\",\"fibers\":{\"file\":\"c.hair\"},\"measurements\":%s}",
             measurements);
    struct job_document *doc = job_document_of_text(text);
    observation_set_init(o);
    status s = observation_set_load(doc->setup, doc->rows, doc->fit, folder, NULL, NULL, o, err);
    job_document_free(doc);
    return s;
}

static void test_default_rows(void **state)
{
    struct observation_set o;
    struct error err = {0};
    double nearest = INFINITY;
    write_astm(state, "c.astm", lambert, 4, degree);
    if (load(state, "{\"file\":\"c.astm\"}", &o, &err) != STATUS_OK) fail_msg("%s", err.text);
    assert_int_equal(observation_set_count(&o, JOB_SET_FIT), BRDF_FIT_ROWS);
    assert_int_equal(observation_set_count(&o, JOB_SET_HELD_OUT), BRDF_HELD_OUT_ROWS);
    for (size_t i = 0; i < o.n; i++) { /* rows are measured configurations, and no two of them are the same */
        const struct configuration *k = &o.item[i].configuration, *m;
        double steps = k->light_theta_rad / (15.0 * degree), want = M_PI * 0.25 * cos(k->light_theta_rad);
        assert_true(fabs(steps - rint(steps)) < 1e-6 && k->n_rotation == 0);
        assert_true(fabs(o.item[i].mean_rgb[0] / want - 1.0) < 0.01);
        for (size_t j = 0; j < i; j++) {
            m = &o.item[j].configuration;
            nearest =
                fmin(nearest,
                     fabs(k->light_theta_rad - m->light_theta_rad) + fabs(k->camera_theta_rad - m->camera_theta_rad) +
                         fabs(k->light_phi_rad - m->light_phi_rad) + fabs(k->camera_phi_rad - m->camera_phi_rad));
        }
    }
    assert_true(nearest > 0.1);
    observation_set_release(&o);
    assert_int_equal(load(state, "{\"file\":\"t.csv\",\"symmetry\":\"isotropic\"}", &o, &err), STATUS_INVALID);
    assert_string_equal(err.field, OPTION_MEASURED_ROWS);
    observation_set_release(&o);
}

static void test_no_file(void **state)
{
    void *handle = NULL;
    struct error err = {0};
    assert_int_equal(astm_brdf_reader.open(scratch_path(state, "gone.astm"), JOB_SYMMETRY_FILE, &handle, &err),
                     STATUS_NOT_FOUND);
    assert_true(handle == NULL && strstr(err.text, "gone.astm") != NULL);
}

static status open_text(void **state, const char *text, struct error *err)
{
    void *handle = NULL;
    scratch_write(scratch_path(state, "t.astm"), text, strlen(text));
    status s = astm_brdf_reader.open(scratch_path(state, "t.astm"), JOB_SYMMETRY_FILE, &handle, err);
    if (s == STATUS_OK) astm_brdf_reader.close(handle);
    return s;
}

static void test_columns(void **state)
{
    struct error err = {0};
    void *handle;
    double light[3] = {0, 0, 1}, camera[3], f[3];
    place(0.3, 0.0, camera);
    assert_int_equal(open_text(state, "VARS theta_i,phi_i,theta_s,phi_s,633nm\n0,0,0.3,0,0.5\n", &err), STATUS_OK);
    assert_int_equal(open_text(state, "VARS theta_i,phi_i,theta_s,phi_s,X,Y,Z\n0,0,.3,0,.950456,1,1.089058\n", &err),
                     STATUS_OK);
    handle = must_open(scratch_path(state, "t.astm"), JOB_SYMMETRY_FILE);
    assert_true(astm_brdf_reader.eval(handle, light, camera, f)); /* the white of D65 */
    for (size_t c = 0; c < 3; c++) assert_true(fabs(f[c] - 1.0) < 1e-3);
    astm_brdf_reader.close(handle);
}

static void test_damaged(void **state)
{
    static const struct {
        const char *text, *says;
    } bad[] = {
        {"", "no line \"VARS"},
        {"VARS theta_i,phi_i,theta_s,phi_s\n", "line 1: its columns do not begin with"},
        {"VARS theta_i,phi_i,theta_s,phi_s,400nm,700nm\n", "line 1: its columns are neither"},
        {"A b\nVARS theta_i,phi_i,theta_s,phi_s,R,G,B\n0,0,0,0,1,2\n", "line 3: it has another number of values"},
        {"VARS theta_i,phi_i,theta_s,phi_s,f\n0,0,0,0,nan\n", "line 2: it has a value that is not a number"},
        {"VARS theta_i,phi_i,theta_s,phi_s,f\n0,0,100,0,1\n100,0,0,0,1\n", "no row of light that is reflected"}};
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        struct error err = {0};
        assert_int_equal(open_text(state, bad[i].text, &err), STATUS_FORMAT);
        if (strstr(err.text, bad[i].says) == NULL) fail_msg("%s", err.text);
        assert_non_null(strstr(err.text, "'t.astm'"));
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_values_between), cmocka_unit_test(test_one_plane), cmocka_unit_test(test_default_rows),
        cmocka_unit_test(test_columns),        cmocka_unit_test(test_no_file),   cmocka_unit_test(test_damaged),
    };
    return cmocka_run_group_tests(tests, scratch_folder_setup, scratch_folder_teardown);
}
