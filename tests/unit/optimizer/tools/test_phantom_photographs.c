/* Photographs of a phantom: the table of configurations, the parameters, and the files that are written. */
#include "base/angle.h"
#include "geometry/fibers/fiber_set.h"
#include "optimizer/job/document/job_file_name.h"
#include "optimizer/tools/phantom/phantom_photographs.h"
#include "optimizer/tools/phantom/phantom_view_table.h"
#include "renderer/image/image.h"
#include "tests/support/scratch_folder.h"

#include <jansson.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

static void test_builtin_views(void **state)
{
    (void)state;
    static struct phantom_view_table t;
    phantom_view_table_builtin(&t);
    assert_int_equal(t.n, 40);
    for (size_t i = 0; i < t.n; i++) {
        assert_int_equal(t.view[i].set, i < 16 ? JOB_SET_FIT : JOB_SET_HELD_OUT);
        assert_true(job_file_name_valid(t.view[i].file));
        assert_true(t.view[i].light_theta_deg < 90 && t.view[i].camera_theta_deg < 90);
        for (size_t j = 0; j < i; j++) assert_string_not_equal(t.view[i].file, t.view[j].file);
    }
    assert_string_equal(t.view[0].file, "fit-00.exr");
    assert_string_equal(t.view[39].file, "held-out-23.exr");
}

static void test_builtin_views_are_those_of_the_measurements(void **state)
{
    (void)state;
    static struct phantom_view_table builtin, read;
    const char *data = getenv("SELVEDGE_DATA");
    char path[1024];
    snprintf(path, sizeof path, "%s/measured-reflectance/merl-blue-fabric.csv", data != NULL ? data : "../shared/data");
    if (access(path, R_OK) != 0) {
        print_message("skipped: no '%s'\n", path);
        skip();
    }
    phantom_view_table_builtin(&builtin);
    assert_int_equal(phantom_view_table_read(&read, path, NULL), STATUS_OK);
    assert_int_equal(read.n, builtin.n);
    assert_memory_equal(read.view, builtin.view, read.n * sizeof *read.view);
}

static void expect_bad_table(void **state, const char *text, const char *says)
{
    static struct phantom_view_table t;
    const char *path = scratch_path(state, "bad.csv");
    struct error err = {0};
    scratch_write(path, text, strlen(text));
    assert_int_equal(phantom_view_table_read(&t, path, &err), STATUS_FORMAT);
    if (strstr(err.text, says) == NULL) fail_msg("'%s' does not say '%s'", err.text, says);
}

static void test_bad_tables(void **state)
{
    expect_bad_table(state, "", "no rows");
    expect_bad_table(state, "set,light_theta_deg,light_phi_deg,camera_theta_deg\n", "camera_phi_deg");
    expect_bad_table(state, "#\nset,light_theta_deg,light_phi_deg,camera_theta_deg,camera_phi_deg\nfit,1,2,3\n",
                     "line 3");
    expect_bad_table(state, "set,light_theta_deg,light_phi_deg,camera_theta_deg,camera_phi_deg\nfit,1,2,x,4\n",
                     "camera_theta_deg 'x'");
    expect_bad_table(state, "set,light_theta_deg,light_phi_deg,camera_theta_deg,camera_phi_deg\nfit,1,nan,3,4\n",
                     "light_phi_deg");
    expect_bad_table(state, "set,light_theta_deg,light_phi_deg,camera_theta_deg,camera_phi_deg\ntest,1,2,3,4\n",
                     "'test'");
}

static void test_parameters(void **state)
{
    (void)state;
    const struct model_info *m = model_catalogue_find("two_lobe.v1");
    double param[SCATTERING_MAX_PARAM] = {0};
    struct error err;
    assert_non_null(m);
    assert_int_equal(phantom_param_parse(m, "C_TT=0.1,0.2,0.3", param, NULL), STATUS_OK);
    assert_true(param[param_index(m->param, m->n_param, "C_TT.g")] == 0.2);
    assert_int_equal(phantom_param_parse(m, "C_R=0.25", param, NULL), STATUS_OK);
    assert_true(param[param_index(m->param, m->n_param, "C_R.r")] == 0.25 &&
                param[param_index(m->param, m->n_param, "C_R.b")] == 0.25);
    assert_int_equal(phantom_param_parse(m, "C_R.b=0.5", param, NULL), STATUS_OK);
    assert_true(param[param_index(m->param, m->n_param, "C_R.b")] == 0.5);
    assert_int_equal(phantom_param_parse(m, "beta_R=6", param, NULL), STATUS_OK);
    assert_true(fabs(param[param_index(m->param, m->n_param, "beta_R")] - 6.0 * RAD_PER_DEG) < 1e-12);
    const char *const bad[] = {"C_R",   "C_R=", "C_R=1,2", "C_R=0.1,0.2,0.3,0.4", "C_R=x", "beta_R=5,5,5", "C_X=1",
                               "C_R=2", "=1",   ""};
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++)
        assert_int_equal(phantom_param_parse(m, bad[i], param, &err), STATUS_INVALID);
}

static void test_parameters_of_groups(void **state)
{
    (void)state;
    static const char group[2][MODEL_SET_NAME_BYTES] = {"warp", "weft"};
    struct phantom_photograph_option o;
    struct error err;
    phantom_photograph_option_default(&o);
    assert_int_equal(phantom_photograph_model(&o, "two_lobe.v1", group, 2, NULL), STATUS_OK);
    assert_int_equal(o.sets.info.n_param, 18);
    assert_int_equal(phantom_param_parse(&o.sets.info, "C_R=0.25", o.param, NULL), STATUS_OK);
    assert_int_equal(phantom_param_parse(&o.sets.info, "weft.C_R=0.1,0.2,0.3", o.param, NULL), STATUS_OK);
    assert_int_equal(phantom_param_parse(&o.sets.info, "warp.C_R.b=0.5", o.param, NULL), STATUS_OK);
    static const double want[6] = {0.25, 0.25, 0.5, 0.1, 0.2, 0.3};
    for (size_t k = 0; k < 6; k++) assert_true(o.param[k % 3 + k / 3 * 9] == want[k]);
    assert_int_equal(phantom_param_parse(&o.sets.info, "pile.C_R=0.1", o.param, &err), STATUS_INVALID);
    assert_int_equal(phantom_photograph_model(&o, "three_lobe.v1", group, 2, &err), STATUS_INVALID);
}

/* Sixteen touching fibers along x. */
static void write_carpet(const char *path)
{
    struct fiber_set f;
    fiber_set_init(&f);
    f.tile_size_m[0] = f.tile_size_m[1] = 1.6e-4;
    assert_int_equal(fiber_set_reserve(&f, 16, 32, NULL), STATUS_OK);
    for (size_t i = 0; i < 16; i++) {
        for (size_t k = 0; k < 2; k++) {
            f.position_m[3 * (2 * i + k)] = k == 0 ? 0.0f : 1.6e-4f;
            f.position_m[3 * (2 * i + k) + 1] = 1e-5f * ((float)i + 0.5f);
            f.position_m[3 * (2 * i + k) + 2] = i % 2 ? 5e-6f : 9e-6f;
        }
        f.radius_m[i] = 5.5e-6f;
        f.first_vertex[i + 1] = 2 * i + 2;
    }
    assert_int_equal(fiber_set_write_hair(&f, path, NULL), STATUS_OK);
    fiber_set_release(&f);
}

#define TABLE_HEADER "set,light_theta_deg,light_phi_deg,camera_theta_deg,camera_phi_deg,cloth_rotation_deg\n"

/* A carpet, a table of its views and a request for small photographs of them. */
struct request {
    char fibers[1024], csv[1024], folder[1024];
    struct phantom_photograph_option o;
};

static void request_init(void **state, const char *views, struct request *q)
{
    snprintf(q->fibers, sizeof q->fibers, "%s", scratch_path(state, "carpet.hair"));
    snprintf(q->csv, sizeof q->csv, "%s", scratch_path(state, "views.csv"));
    snprintf(q->folder, sizeof q->folder, "%s", scratch_path(state, "photographs"));
    write_carpet(q->fibers);
    scratch_write(q->csv, views, strlen(views));
    phantom_photograph_option_default(&q->o);
    q->o.fiber_file = q->fibers;
    q->o.table_file = q->csv;
    q->o.folder = q->folder;
    assert_int_equal(phantom_photograph_model(&q->o, "two_lobe.v1", NULL, 0, NULL), STATUS_OK);
    q->o.px = 8;
    q->o.n_path = 64 * 20;
    q->o.noise = 0.01;
}

static json_t *truth_of(void **state)
{
    json_t *truth = json_load_file(scratch_path(state, "photographs/truth.json"), 0, NULL);
    assert_non_null(truth);
    return truth;
}

/* The mean of a picture must be the stated mean times the stated gain. */
static void check_picture(const char *folder, const json_t *row)
{
    char path[2048];
    struct image im;
    struct error err = {0};
    snprintf(path, sizeof path, "%s/%s", folder, json_string_value(json_object_get(row, "file")));
    assert_int_equal(image_read_exr(&im, path, 1000, &err), STATUS_OK);
    assert_true(im.width == 8 && im.height == 8);
    for (size_t c = 0; c < 3; c++) {
        double mean = 0, stated = json_real_value(json_array_get(json_object_get(row, "mean_rgb"), c));
        double gain = json_real_value(json_array_get(json_object_get(row, "gain_rgb"), c));
        for (size_t k = 0; k < 64; k++) mean += (double)im.pixel[3 * k + c] / 64.0;
        assert_true(stated > 0.0 && fabs(gain - 1.0) < 0.06 && gain != 1.0);
        assert_true(fabs(mean - stated * gain) < 1e-5 * stated);
    }
    image_release(&im);
}

static void test_what_is_written(void **state)
{
    struct request q;
    struct error err = {0};
    request_init(state, TABLE_HEADER "fit,45,0,45,180,0\nheld-out,30,0,10,90,90\nfit,60,0,0,0,45\n", &q);
    if (phantom_photographs_make(&q.o, NULL, NULL, &err) != STATUS_OK) fail_msg("%s", err.text);
    assert_int_equal(scratch_count_entries(q.folder), 5);
    json_t *list = json_load_file(scratch_path(state, "photographs/photographs.json"), 0, NULL);
    json_t *truth = truth_of(state);
    assert_int_equal(json_array_size(list), 3);
    assert_string_equal(json_string_value(json_object_get(json_array_get(list, 2), "file")), "fit-01.exr");
    for (size_t i = 0; i < 3; i++) check_picture(q.folder, json_array_get(json_object_get(truth, "photographs"), i));
    json_decref(list);
    json_decref(truth);
}

static void test_refused_requests(void **state)
{
    static const struct {
        const char *views, *part;
        double crop_cm;
    } bad[] = {{TABLE_HEADER "fit,45,0,95,180,0\n", "fit-00.exr' makes no sense", 1.0},
               {TABLE_HEADER "fit,45,0,45,180,0\nfit,120,0,0,0,0\n", "fit-01.exr' would be black", 1.0},
               {TABLE_HEADER "fit,45,0,45,180,0\n", "fit-00.exr' makes no sense", -1.0}};
    struct request q;
    struct error err = {0};
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        request_init(state, bad[i].views, &q);
        q.o.crop_cm = bad[i].crop_cm;
        assert_int_equal(phantom_photographs_make(&q.o, NULL, NULL, &err), STATUS_INVALID);
        assert_non_null(strstr(err.text, bad[i].part));
    }
    request_init(state, TABLE_HEADER "fit,45,0,45,180,0\n", &q);
    q.o.px = 0;
    assert_int_equal(phantom_photographs_make(&q.o, NULL, NULL, &err), STATUS_INVALID);
    q.o.px = 8;
    q.o.fiber_file = "absent.hair";
    assert_int_equal(phantom_photographs_make(&q.o, NULL, NULL, &err), STATUS_NOT_FOUND);
}

/* A photograph with fewer paths than pixels still has a standard error. */
static void test_fewest_paths(void **state)
{
    struct request q;
    struct error err = {0};
    request_init(state, TABLE_HEADER "fit,45,0,45,180,0\n", &q);
    q.o.n_path = 1;
    if (phantom_photographs_make(&q.o, NULL, NULL, &err) != STATUS_OK) fail_msg("%s", err.text);
    json_t *truth = truth_of(state);
    const json_t *first = json_array_get(json_object_get(truth, "photographs"), 0);
    assert_true(json_real_value(json_array_get(json_object_get(first, "mean_rgb_se"), 0)) > 0.0);
    json_decref(truth);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_builtin_views),        cmocka_unit_test(test_builtin_views_are_those_of_the_measurements),
        cmocka_unit_test(test_bad_tables),           cmocka_unit_test(test_parameters),
        cmocka_unit_test(test_parameters_of_groups), cmocka_unit_test(test_what_is_written),
        cmocka_unit_test(test_refused_requests),     cmocka_unit_test(test_fewest_paths),
    };
    return cmocka_run_group_tests(tests, scratch_folder_setup, scratch_folder_teardown);
}
