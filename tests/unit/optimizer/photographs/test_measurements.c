/* Tables of measured radiances: values are read correctly, and errors name file, line and column. */
#include "base/option_id.h"
#include "optimizer/job/document/job_file_name.h"
#include "optimizer/job/document/job_fit.h"
#include "optimizer/job/document/job_rows.h"
#include "optimizer/job/document/job_setup.h"
#include "optimizer/photographs/rows/measurement_table.h"
#include "optimizer/photographs/rows/observation_load.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#define HEAD "set,index,light_theta_deg,light_phi_deg,camera_theta_deg,camera_phi_deg,cloth_rotation_deg,r,g,b\n"

static const struct job_setup set_up = {
    .lamp_side_cm = 10, .lamp_distance_cm = 61, .camera_distance_cm = 100, .crop_cm = 1, .black_sheet = true};

static void check_error(const char *text, status code, const char *part)
{
    struct observation_set o;
    struct error err = {0};
    observation_set_init(&o);
    assert_int_equal(measurement_table_parse(text, strlen(text), "t.csv", &set_up, &o, &err), code);
    assert_string_equal(err.field, OPTION_MEASUREMENT_FILE);
    if (strstr(err.text, part) == NULL || strstr(err.text, "t.csv") == NULL)
        fail_msg("'%s' is not in '%s'", part, err.text);
    observation_set_release(&o);
}

static void test_read(void **state)
{
    (void)state;
    const char *text =
        "\xef\xbb\xbf# comment, with commas\r\n\n"
        "b_se, r_se ,g_se,g,r,b,weight,camera_phi_deg,camera_theta_deg,light_phi_deg,light_theta_deg,set\r\n"
        "0.3,0.1,0.2, 2 ,1,3,0.5,180,45,-30,60,fit\r\n"
        "0,0,0,0,0,0,1,0,0,0,0,held-out\n"
        "0.3,0.1,0.2,2,1,3,0.5,180,45,-30,60,fit";
    struct observation_set o;
    struct error err = {0};
    observation_set_init(&o);
    if (measurement_table_parse(text, strlen(text), "t.csv", &set_up, &o, &err) != STATUS_OK) fail_msg("%s", err.text);
    assert_int_equal(o.n, 3);
    assert_int_equal(observation_set_count(&o, JOB_SET_FIT), 2);
    const struct observation *a = &o.item[0];
    assert_true(a->mean_rgb[0] == 1 && a->mean_rgb[1] == 2 && a->mean_rgb[2] == 3);
    assert_true(a->se_rgb[0] == 0.1 && a->se_rgb[1] == 0.2 && a->se_rgb[2] == 0.3 && a->weight == 0.5);
    assert_true(fabs(a->configuration.light_theta_rad - M_PI / 3) < 1e-12 &&
                fabs(a->configuration.light_phi_rad + M_PI / 6) < 1e-12);
    assert_true(fabs(a->configuration.light_distance_m - 0.61) < 1e-12 && fabs(a->configuration.crop_m - 0.01) < 1e-12);
    assert_true(a->configuration.cloth_rotation_rad == 0.0 && o.item[1].weight == 1.0);
    assert_string_equal(a->name, "fit-00");
    assert_string_equal(o.item[1].name, "held-out-00");
    assert_string_equal(o.item[2].name, "fit-01");
    observation_set_release(&o);
}

/* The same two rows as spreadsheet programs write them. */
static void test_spreadsheets(void **state)
{
    static const char *const text[] = {
        "\xef\xbb\xbfset;light_theta_deg;light_phi_deg;camera_theta_deg;camera_phi_deg;r;g;b;name\r\n"
        "fit;20,5;0;30;180;0,125;2,5e-1;1;a, b\r\n;;;;;;;;\r\nheld-out;10;0;0;0;1;1;1;\r\n",
        "sep=;\nset;light_theta_deg;light_phi_deg;camera_theta_deg;camera_phi_deg;r;g;b;name;;\n"
        "fit;20.5;0;30;180;0.125;0.25;1;a, b;;\nheld-out;10;0;0;0;1;1;1;;;\n",
        "# by hand\nset\tlight_theta_deg\tlight_phi_deg\tcamera_theta_deg\tcamera_phi_deg\tr\tg\tb\tname\n"
        "fit\t20,5\t0\t30\t180\t0,125\t0.25\t1\ta, b\nheld-out\t10\t0\t0\t0\t1\t1\t1\t\n",
        "set,light_theta_deg,light_phi_deg,camera_theta_deg,camera_phi_deg,r,g,b,name\r"
        "fit,\"20,5\",0,30,180,\"0,125\",0.25,1,\"a, b\"\rheld-out,10,0,0,0,1,1,1,\r",
    };
    (void)state;
    for (size_t i = 0; i < sizeof text / sizeof *text; i++) {
        struct observation_set o;
        struct error err = {0};
        observation_set_init(&o);
        if (measurement_table_parse(text[i], strlen(text[i]), "t.csv", &set_up, &o, &err) != STATUS_OK)
            fail_msg("%zu: %s", i, err.text);
        assert_int_equal(o.n, 2);
        assert_true(fabs(o.item[0].configuration.light_theta_rad * 180.0 / M_PI - 20.5) < 1e-12);
        assert_true(o.item[0].mean_rgb[0] == 0.125 && o.item[0].mean_rgb[1] == 0.25 && o.item[1].mean_rgb[2] == 1.0);
        assert_string_equal(o.item[0].name, "a__b");
        assert_string_equal(o.item[1].name, "held-out-00");
        observation_set_release(&o);
    }
    check_error("set;light_theta_deg;light_phi_deg;camera_theta_deg;camera_phi_deg;r;g;b\nfit;1;0;30;180;1.234,5;1;1\n",
                STATUS_FORMAT, "column 'r': '1.234,5' is not a number");
    check_error("\xff\xfes", STATUS_FORMAT, "UTF-16");
    check_error("sep=;\n", STATUS_FORMAT, "no header line");
}

static void test_rotations(void **state)
{
    (void)state;
    const char *text = HEAD "fit,0,20,0,20,180,all,0.1,0.1,0.1\nfit,0,20,0,20,180,90,0.1,0.1,0.1\n";
    struct observation_set o;
    struct error err = {0};
    observation_set_init(&o);
    if (measurement_table_parse(text, strlen(text), "t.csv", &set_up, &o, &err) != STATUS_OK) fail_msg("%s", err.text);
    assert_int_equal(o.item[0].configuration.n_rotation, CONFIGURATION_ALL_ROTATIONS);
    assert_true(o.item[0].configuration.cloth_rotation_rad == 0.0);
    assert_int_equal(o.item[1].configuration.n_rotation, 0);
    assert_true(fabs(o.item[1].configuration.cloth_rotation_rad - M_PI / 2) < 1e-12);
    observation_set_release(&o);
    check_error(HEAD "fit,0,20,0,20,all,0,0.1,0.1,0.1\n", STATUS_FORMAT, "column 'camera_phi_deg'");
    check_error(HEAD "fit,0,20,0,20,180,any,0.1,0.1,0.1\n", STATUS_FORMAT, "column 'cloth_rotation_deg': 'any'");
}

/* A row name that is no valid file name is changed into one, and the row is kept. */
static void test_names(void **state)
{
    (void)state;
    static const struct {
        const char *given, *kept;
    } golden[] = {{"a-b_c.9", "a-b_c.9"}, {"warp 45", "warp_45"}, {" blank ", "blank"},  {"", "fit-03"},
                  {".hidden", "_hidden"}, {"../up", "_._up"},     {"r\xc3\xb6t", "r__t"}};
    char text[2000] = "name,set,light_theta_deg,light_phi_deg,camera_theta_deg,camera_phi_deg,r,g,b\n", longer[200];
    struct observation_set o;
    struct error err = {0};
    size_t n = sizeof golden / sizeof golden[0];
    for (size_t i = 0; i < n; i++) {
        size_t used = strlen(text);
        snprintf(text + used, sizeof text - used, "%s,fit,20,0,20,180,0.1,0.1,0.1\n", golden[i].given);
    }
    memset(longer, 'x', sizeof longer - 1);
    longer[sizeof longer - 1] = '\0';
    size_t used = strlen(text);
    snprintf(text + used, sizeof text - used, "%s,fit,20,0,20,180,0.1,0.1,0.1\n", longer);
    observation_set_init(&o);
    if (measurement_table_parse(text, strlen(text), "t.csv", &set_up, &o, &err) != STATUS_OK) fail_msg("%s", err.text);
    for (size_t i = 0; i < n; i++) assert_string_equal(o.item[i].name, golden[i].kept);
    assert_int_equal(strlen(o.item[n].name), JOB_MAX_NAME_BYTES - 1);
    for (size_t i = 0; i <= n; i++) assert_true(job_file_name_valid(o.item[i].name));
    observation_set_release(&o);
}

/* A table with a header, n_all rows over all rotations and n_one rows at one rotation. The caller frees it. */
static char *long_table(size_t n_all, size_t n_one)
{
    static const char all[] = "held-out,0,20,0,20,180,all,0.1,0.1,0.1\n", one[] = "fit,0,20,0,20,180,0,0.1,0.1,0.1\n";
    char *text = malloc(sizeof HEAD + n_all * sizeof all + n_one * sizeof one), *end = text;
    assert_non_null(text);
    end = mempcpy(end, HEAD, sizeof HEAD - 1);
    for (size_t i = 0; i < n_one; i++) end = mempcpy(end, one, sizeof one - 1);
    for (size_t i = 0; i < n_all; i++) end = mempcpy(end, all, sizeof all - 1);
    *end = '\0';
    return text;
}

/* The limit of renderings at once: a row over all rotations needs nine of them. */
static void test_too_many_renderings(void **state)
{
    (void)state;
    static const struct {
        size_t n_all, n_one;
        bool good;
    } golden[] = {{455, 1, true},  {455, 2, false},  {456, 1, false},
                  {0, 4096, true}, {0, 4097, false}, {1, 4088, false}};
    for (size_t i = 0; i < sizeof golden / sizeof golden[0]; i++) {
        char *text = long_table(golden[i].n_all, golden[i].n_one);
        struct observation_set o;
        observation_set_init(&o);
        if (golden[i].good)
            assert_int_equal(measurement_table_parse(text, strlen(text), "t.csv", &set_up, &o, NULL), STATUS_OK);
        else
            check_error(text, STATUS_TOO_LARGE,
                        golden[i].n_all > 0 ? "'all' takes 9, so at most 455" : "more than 4096 rows");
        observation_set_release(&o);
        free(text);
    }
}

static void test_errors(void **state)
{
    (void)state;
    check_error("", STATUS_FORMAT, "no header");
    check_error("# only a comment\n", STATUS_FORMAT, "no header");
    check_error(HEAD, STATUS_INVALID, "no row of the set 'fit'");
    check_error("set,light_theta_deg,light_phi_deg,camera_theta_deg,camera_phi_deg,r,g\n", STATUS_FORMAT,
                "line 1: column 'b' is missing");
    check_error("set,colour\n", STATUS_FORMAT, "unknown column 'colour'");
    check_error("set,r,r\n", STATUS_FORMAT, "'r' appears twice");
    check_error(HEAD "fit,0,20,0,20,180,0,nan,0.1,0.1\n", STATUS_INVALID, "line 2: column 'r' is 'nan'");
    check_error(HEAD "fit,0,20,0,20,180,0,inf,0.1,0.1\n", STATUS_INVALID, "finite");
    check_error("# c\n" HEAD "fit,0,20,0,20,180,0,0.1,-0.1,0.1\n", STATUS_INVALID, "line 3: column 'g' is -0.1");
    check_error(HEAD "fit,0,20,0,20,180,0,0.1,x,0.1\n", STATUS_FORMAT, "'x' is not a number");
    check_error(HEAD "fit,0,20,0,20,180,0,0.1,,0.1\n", STATUS_FORMAT, "column 'g'");
    check_error(HEAD "fit,0,95,0,20,180,0,0.1,0.1,0.1\n", STATUS_INVALID, "column 'light_theta_deg' is 95");
    check_error(HEAD "fit,0,20,0,90,180,0,0.1,0.1,0.1\n", STATUS_INVALID, "column 'camera_theta_deg' is 90");
    check_error(HEAD "fit,0,20,0,20,180,0,0.1,0.1\n", STATUS_FORMAT, "9 cells, but the header has 10");
    check_error(HEAD "train,0,20,0,20,180,0,0.1,0.1,0.1\n", STATUS_INVALID, "fit, held-out");
    check_error(HEAD "held-out,0,20,0,20,180,0,0.1,0.1,0.1\n", STATUS_INVALID, "no row of the set 'fit'");
    struct observation_set o;
    observation_set_init(&o);
    assert_int_equal(measurement_table_parse(HEAD "\0fit", sizeof HEAD + 3, "t.csv", &set_up, &o, NULL), STATUS_FORMAT);
    observation_set_release(&o);
}

/* All measured tables, when the data folder is there. */
static void test_real_tables(void **state)
{
    (void)state;
    const char *data = getenv("SELVEDGE_DATA"), *name[] = {"merl-blue-fabric", "nielsen-greencloth", "merl-pink-felt"};
    for (size_t i = 0; i < 3; i++) {
        struct job_rows asked = {.measurement_file = ""};
        const struct job_fit fit = {0};
        struct observation_set o;
        struct error err = {0};
        char folder[1000], path[1200];
        snprintf(folder, sizeof folder, "%s/measured-reflectance", data != NULL ? data : "../shared/data");
        snprintf(asked.measurement_file, sizeof asked.measurement_file, "%s.csv", name[i]);
        snprintf(path, sizeof path, "%s/%s", folder, asked.measurement_file);
        FILE *f = fopen(path, "rb");
        if (f == NULL) {
            print_message("real data absent: %s (set SELVEDGE_DATA)\n", path);
            skip();
        }
        fclose(f);
        observation_set_init(&o);
        if (observation_set_load(&set_up, &asked, &fit, folder, NULL, NULL, &o, &err) != STATUS_OK)
            fail_msg("%s", err.text);
        assert_int_equal(observation_set_count(&o, JOB_SET_FIT), 16);
        assert_int_equal(observation_set_count(&o, JOB_SET_HELD_OUT), 24);
        observation_set_release(&o);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_read),
                                       cmocka_unit_test(test_rotations),
                                       cmocka_unit_test(test_spreadsheets),
                                       cmocka_unit_test(test_names),
                                       cmocka_unit_test(test_too_many_renderings),
                                       cmocka_unit_test(test_errors),
                                       cmocka_unit_test(test_real_tables)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
