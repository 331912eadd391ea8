/* Files of the MERL database: radiances of BRDFs that are known in closed form, missing samples, damaged files. */
#include "base/option_id.h"
#include "optimizer/photographs/rows/brdf_file.h"
#include "optimizer/photographs/rows/observation_load.h"
#include "tests/support/scratch_folder.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "tests/support/job_document_text.h"

enum { N = 90 * 90 * 180 };
static const double albedo[3] = {0.5, 0.25, 0.125}, width = 0.2;

static double lambert(size_t c, double theta_h, double theta_d) { return albedo[c] / M_PI + 0.0 * (theta_h + theta_d); }
/* A lobe about the half vector, and a rise towards grazing light. */
static double lobe(size_t c, double theta_h, double theta_d)
{
    return albedo[c] / M_PI * (1.0 + exp(-theta_h * theta_h / (width * width)) * (1.0 + theta_d * theta_d));
}
/* Nothing was measured beyond a difference angle of 60 degrees. */
static double cut(size_t c, double theta_h, double theta_d)
{
    return theta_d > 1.05 ? -1500.0 : lambert(c, theta_h, theta_d);
}

static void write_merl(const char *path, double (*f)(size_t c, double theta_h, double theta_d))
{
    static const double scale[3] = {1.0 / 1500.0, 1.15 / 1500.0, 1.66 / 1500.0};
    const int32_t edge[3] = {90, 90, 180};
    double *value = malloc(3 * (size_t)N * sizeof *value);
    FILE *file = fopen(path, "wb");
    assert_true(value != NULL && file != NULL);
    for (size_t i = 0; i < 3 * (size_t)N; i++) {
        size_t half = i % N / 180 / 90, diff = i % N / 180 % 90;
        double h = (double)half / 90.0;
        value[i] = i % 180 == 0 ? f(i / N, h * h * M_PI_2, (double)diff / 90.0 * M_PI_2) / scale[i / N] : value[i - 1];
    }
    assert_true(fwrite(edge, sizeof edge, 1, file) == 1 &&
                fwrite(value, sizeof *value, 3 * (size_t)N, file) == 3 * (size_t)N);
    assert_int_equal(fclose(file), 0);
    free(value);
}

static status load(void **state, const char *measurements, struct observation_set *o, size_t *n_warning,
                   struct error *err);

static void count(void *context, const char *option, const char *text)
{
    assert_string_equal(option, OPTION_MEASUREMENT_FILE);
    assert_non_null(strstr(text, "left out"));
    ++*(size_t *)context;
}

static status load(void **state, const char *measurements, struct observation_set *o, size_t *n_warning,
                   struct error *err)
{
    char text[1024], folder[1024];
    const char *path = scratch_path(state, "x");
    snprintf(folder, sizeof folder, "%.*s", (int)(strrchr(path, '/') - path), path);
    snprintf(text, sizeof text, "{\"sample\":\"s\",\"fibers\":{\"file\":\"c.hair\"},\"measurements\":%s}",
             measurements);
    struct job_document *doc = job_document_of_text(text);
    observation_set_init(o);
    status s = observation_set_load(doc->setup, doc->rows, doc->fit, folder, NULL,
                                    &(struct warning_sink){count, n_warning}, o, err);
    job_document_free(doc);
    return s;
}

static void test_default_rows(void **state)
{
    struct observation_set o;
    struct error err = {0};
    size_t n_warning = 0;
    write_merl(scratch_path(state, "a.binary"), lambert);
    if (load(state, "{\"file\":\"a.binary\"}", &o, &n_warning, &err) != STATUS_OK) fail_msg("%s", err.text);
    assert_int_equal(observation_set_count(&o, JOB_SET_FIT), BRDF_FIT_ROWS);
    assert_int_equal(observation_set_count(&o, JOB_SET_HELD_OUT), BRDF_HELD_OUT_ROWS);
    for (size_t i = 0; i < o.n;
         i++) { /* the mean over the lamp of cos theta is that of its middle to a quarter per cent */
        const struct configuration *k = &o.item[i].configuration;
        assert_int_equal(k->n_rotation, CONFIGURATION_ALL_ROTATIONS);
        for (size_t c = 0; c < 3; c++) {
            double want = albedo[c] * cos(k->light_theta_rad);
            if (!(fabs(o.item[i].mean_rgb[c] / want - 1.0) < 0.004))
                fail_msg("%s: %g, not %g", o.item[i].name, o.item[i].mean_rgb[c], want);
        }
    }
    assert_string_equal(o.item[0].name, "fit-00");
    assert_true(n_warning == 0);
    observation_set_release(&o);
}

static void test_eval(void **state)
{
    static const double deg[4][3] = {{20, 20, 180}, {60, 10, 70}, {75, 70, 175}, {0.5, 45, 30}};
    void *handle;
    struct error err = {0};
    write_merl(scratch_path(state, "lobe.binary"), lobe);
    assert_int_equal(merl_brdf_reader.open(scratch_path(state, "lobe.binary"), JOB_SYMMETRY_FILE, &handle, &err),
                     STATUS_OK);
    for (size_t i = 0; i < 4; i++) {
        double a = deg[i][0] * M_PI / 180, b = deg[i][1] * M_PI / 180, phi = deg[i][2] * M_PI / 180, f[3], g[3];
        const double light[3] = {sin(a), 0, cos(a)}, camera[3] = {sin(b) * cos(phi), sin(b) * sin(phi), cos(b)};
        double h[3], length = 0.0;
        for (int c = 0; c < 3; c++) h[c] = light[c] + camera[c];
        length = sqrt(h[0] * h[0] + h[1] * h[1] + h[2] * h[2]);
        double theta_h = acos(h[2] / length), theta_d = acos(fmin(1.0, 0.5 * length));
        assert_true(merl_brdf_reader.eval(handle, light, camera, f) && merl_brdf_reader.eval(handle, camera, light, g));
        for (size_t c = 0; c < 3; c++) {
            if (!(fabs(f[c] / lobe(c, theta_h, theta_d) - 1.0) < 0.01))
                fail_msg("%zu: %g, not %g", i, f[c], lobe(c, theta_h, theta_d));
            assert_true(fabs(f[c] / g[c] - 1.0) < 1e-6); /* reciprocal */
        }
    }
    merl_brdf_reader.close(handle);
}

#define ROW(set, theta, camera)                                                                                        \
    "{\"set\":\"" set "\",\"light_theta_deg\":" theta ",\"light_phi_deg\":10,\"camera_theta_deg\":" camera             \
    ",\"camera_phi_deg\":190}"

static void test_chosen_rows(void **state)
{
    struct observation_set o;
    struct error err = {0};
    size_t n_warning = 0;
    write_merl(scratch_path(state, "cut.binary"), cut);
    if (load(
            state,
            "{\"file\":\"cut.binary\",\"configurations\":[" ROW("fit", "30", "40") "," ROW("held-out", "75", "70") "]}",
            &o, &n_warning, &err) != STATUS_OK)
        fail_msg("%s", err.text);
    assert_true(o.n == 1 && n_warning == 1 && fabs(o.item[0].mean_rgb[0] / (0.5 * cos(M_PI / 6)) - 1.0) < 0.004);
    observation_set_release(&o);
    assert_int_equal(
        load(state, "{\"file\":\"cut.binary\",\"configurations\":[" ROW("fit", "75", "70") "]}", &o, &n_warning, &err),
        STATUS_INVALID);
    assert_non_null(strstr(err.text, "'cut.binary' has no value for the lamp at (75, 10)"));
    observation_set_release(&o);
    job_document_check_error(
        "{\"sample\":\"s\",\"fibers\":{\"file\":\"c.hair\"},\"measurements\":{\"file\":\"a.binary\","
        "\"configurations\":[" ROW("held-out", "1", "2") "]}}",
        "measurements.configurations", "at least one");
    scratch_write(scratch_path(state, "t.csv"), "set\n", 4);
    assert_int_equal(
        load(state, "{\"file\":\"t.csv\",\"configurations\":[" ROW("fit", "1", "2") "]}", &o, &n_warning, &err),
        STATUS_INVALID);
    assert_string_equal(err.field, OPTION_MEASURED_ROWS);
    observation_set_release(&o);
}

static void test_damaged(void **state)
{
    struct observation_set o;
    struct error err = {0};
    size_t n_warning = 0;
    const int32_t edge[3] = {90, 90, 180}, other[3] = {90, 90, 360};
    scratch_write(scratch_path(state, "short.binary"), (const char *)edge, sizeof edge);
    assert_int_equal(load(state, "{\"file\":\"short.binary\"}", &o, &n_warning, &err), STATUS_FORMAT);
    assert_non_null(strstr(err.text, "'short.binary': it has 12 bytes"));
    assert_string_equal(err.field, OPTION_MEASUREMENT_FILE);
    observation_set_release(&o);
    scratch_write(scratch_path(state, "short.binary"), (const char *)other, sizeof other);
    assert_int_equal(load(state, "{\"file\":\"short.binary\"}", &o, &n_warning, &err), STATUS_FORMAT);
    assert_non_null(strstr(err.text, "does not begin as a MERL file"));
    observation_set_release(&o);
    scratch_write(scratch_path(state, "short.binary"), "abc", 3);
    assert_int_equal(load(state, "{\"file\":\"short.binary\"}", &o, &n_warning, &err), STATUS_FORMAT);
    observation_set_release(&o);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_default_rows),
        cmocka_unit_test(test_eval),
        cmocka_unit_test(test_chosen_rows),
        cmocka_unit_test(test_damaged),
    };
    return cmocka_run_group_tests(tests, scratch_folder_setup, scratch_folder_teardown);
}
