/* The set-up of a job, from its document to the estimates that a fit is made from, against the same set-up put together
 * by hand: kind of lamp, camera, environments, shared camera paths. */
#include "base/angle.h"
#include "base/files/durable.h"
#include "base/option_id.h"
#include "optimizer/job/document/job_fit.h"
#include "optimizer/stages/fit/pipeline_trace.h"
#include "optimizer/stages/geometry_stages.h"
#include "renderer/estimate/estimate.h"
#include "renderer/transport/environment.h"
#include "tests/support/scratch_folder.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "tests/support/refused_job.h"

enum { N_ROW = 3, N_PATH = 1024 };

#define CLOTH                                                                                                          \
    "\"sample\":\"s\",\"fibers\":{\"file\":\"a.txt\",\"tile_mm\":[0.2,0.2]},\"measurements\":{\"file\":\"a.csv\"},"    \
    "\"fit\":{\"model\":\"two_lobe.v1\",\"seed\":5%s}"
static const char fibers[] = "-0.01 0.05 0 0.02\n0.21 0.05 0 0.02\n\n-0.01 0.15 0 0.02\n0.21 0.15 0 0.02\n\n"
                             "0.05 -0.01 0.05 0.02\n0.05 0.21 0.05 0.02\n\n0.15 -0.01 0.05 0.02\n0.15 0.21 0.05 0.02\n";
static const char rows[] =
    "set,light_theta_deg,light_phi_deg,camera_theta_deg,camera_phi_deg,cloth_rotation_deg,r,g,b\n"
    "fit,20,0,30,180,40,.1,.1,.1\nfit,50,90,30,180,40,.1,.1,.1\nfit,60,0,0,180,0,.1,.1,.1\n";

static void configurations(struct configuration c[N_ROW])
{
    static const double light_theta_deg[N_ROW] = {20, 50, 60}, light_phi_deg[N_ROW] = {0, 90, 0},
                        camera_theta_deg[N_ROW] = {30, 30, 0}, rotation_deg[N_ROW] = {40, 40, 0};
    for (size_t i = 0; i < N_ROW; i++)
        c[i] = (struct configuration){.light_theta_rad = light_theta_deg[i] * RAD_PER_DEG,
                                      .light_phi_rad = light_phi_deg[i] * RAD_PER_DEG,
                                      .camera_theta_rad = camera_theta_deg[i] * RAD_PER_DEG,
                                      .camera_phi_rad = 180 * RAD_PER_DEG,
                                      .cloth_rotation_rad = rotation_deg[i] * RAD_PER_DEG,
                                      .light_distance_m = 0.61,
                                      .lamp_side_m = 0.1,
                                      .camera_distance_m = 1.0,
                                      .crop_m = 0.01};
}

static void write_job(void **state, const char *set_up, const char *fit)
{
    char text[2000], inner[1000];
    snprintf(inner, sizeof inner, CLOTH, fit);
    snprintf(text, sizeof text, "{%s%s}", inner, set_up);
    assert_int_equal(durable_make_folder(scratch_path(state, "job/input"), NULL), STATUS_OK);
    scratch_write(scratch_path(state, "job/job.json"), text, strlen(text));
    scratch_write(scratch_path(state, "job/input/a.txt"), fibers, sizeof fibers - 1);
    scratch_write(scratch_path(state, "job/input/a.csv"), rows, sizeof rows - 1);
}

static void write_sky(const char *path)
{
    struct image sky;
    assert_int_equal(image_init(&sky, 8, 4, 3, NULL), STATUS_OK);
    for (size_t i = 0; i < 96; i++) sky.pixel[i] = 0.1f + 0.01f * (float)(i * 37 % 50);
    assert_int_equal(image_write_exr(&sky, path, NULL), STATUS_OK);
    image_release(&sky);
}

/* Estimates of the job's rows as its fit would ask for them; and of configurations put together by hand. */
static void compare(void **state, const char *set_up, const char *fit, const struct configuration *by_hand, bool share)
{
    struct worker_folder f;
    struct job_inputs in;
    struct fibers_output fibers_out;
    struct made_cloth made;
    struct stage_tools tools = {.folder = &f, .warn = {stage_warn, &tools}};
    struct pipeline_trace trace;
    struct error err = {0};
    struct estimate of_job[N_ROW], want[N_ROW];
    double wall_s;
    const size_t n_path[N_ROW] = {N_PATH, N_PATH, N_PATH};
    write_job(state, set_up, fit);
    assert_int_equal(worker_folder_open(&f, scratch_path(state, "job"), NULL), STATUS_OK);
    job_inputs_init(&in);
    memset(&fibers_out, 0, sizeof fibers_out);
    memset(&made, 0, sizeof made);
    fiber_set_init(&fibers_out.fiber);
    if (job_inputs_read(&tools, &in, &err) != STATUS_OK) fail_msg("%s: %s", err.field, err.text);
    const struct job_sections *section = &in.section;
    const struct fibers_input stage = {.tools = &tools, .scan = section->scan, .cloth = section->cloth};
    const struct cloth_job job = {&tools,   section->scan, section->cloth, section->setup, section->fit,
                                  &in.rows, in.n_model,    in.model,       &in.number,     section->fit->seed};
    assert_int_equal(stage_fibers(&stage, &fibers_out, &err), STATUS_OK);
    made.fiber = fibers_out.fiber;
    assert_int_equal(made_cloth_make_scene(&job, &made, &err), STATUS_OK);
    assert_int_equal(in.rows.fitted.n, N_ROW);
    double param[FIT_MAX_PARAM];
    const struct appearance *model = &in.model[0].appearance;
    for (size_t p = 0; p < model->n_param; p++) param[p] = model->param[p].start;
    assert_int_equal(pipeline_trace_open(&trace, &job, &made, "fit", "estimates.journal", 0, &in.rows.fitted, &err),
                     STATUS_OK);
    const struct estimator e = estimate_journal_estimator(trace.journal);
    const struct estimator_call call = {.param = param, .n_path = n_path, .want_jacobian = true};
    assert_int_equal(e.run(e.context, &call, NULL, of_job, &wall_s, &err), STATUS_OK);
    const struct estimate_request q = {
        .input = {.scene = {.fibers = made.scene}, .model = model, .param = param, .want_derivative = true},
        .configuration = by_hand,
        .n_configuration = N_ROW,
        .n_path = n_path,
        .seed = 5,
        .share_camera_paths = share};
    assert_int_equal(estimate_run(&q, NULL, NULL, want, &err), STATUS_OK);
    for (size_t i = 0; i < N_ROW; i++) {
        assert_true(want[i].mean[1] > 0.0);
        assert_memory_equal(of_job[i].mean, want[i].mean, sizeof want[i].mean);
        assert_memory_equal(of_job[i].jac, want[i].jac, 3 * model->n_param * sizeof *want[i].jac);
        assert_int_equal(of_job[i].n_partner, share && i == 1 ? 1 : 0);
        assert_memory_equal(of_job[i].partner, want[i].partner, sizeof want[i].partner);
    }
    pipeline_trace_close(&trace);
    made_cloth_release(&made);
    job_inputs_release(&in);
    worker_folder_close(&f);
}

static void test_left_out(void **state)
{
    struct configuration c[N_ROW];
    configurations(c);
    compare(state, "", "", c, false);
}

static void test_lamp_and_camera(void **state)
{
    struct configuration c[N_ROW];
    configurations(c);
    for (size_t i = 0; i < N_ROW; i++) c[i].light = LIGHT_DIRECTIONAL;
    compare(state, ",\"lamp\":{\"kind\":\"directional\"}", "", c, false);
    for (size_t i = 0; i < N_ROW; i++) c[i].camera = CAMERA_FAR_FIELD;
    compare(state, ",\"lamp\":{\"kind\":\"directional\"},\"camera\":{\"far_field\":true}", "", c, false);
    for (size_t i = 0; i < N_ROW; i++) c[i].blur_m = 0.25e-3;
    compare(state, ",\"lamp\":{\"kind\":\"directional\"},\"camera\":{\"far_field\":true,\"blur_mm\":0.25}", "", c,
            false);
}

static void test_environment(void **state)
{
    struct configuration c[N_ROW];
    struct environment *sky = NULL;
    configurations(c);
    for (size_t i = 0; i < N_ROW; i++)
        for (int k = 0; k < 3; k++) c[i].environment_rgb[k] = 0.1 * (k + 1);
    compare(state, ",\"environment\":{\"radiance\":[0.1,0.2,0.30000000000000004]}", "", c, false);
    assert_int_equal(durable_make_folder(scratch_path(state, "job/input"), NULL), STATUS_OK);
    write_sky(scratch_path(state, "job/input/sky.exr"));
    assert_int_equal(environment_read_exr(scratch_path(state, "job/input/sky.exr"), 2.0, &sky, NULL), STATUS_OK);
    for (size_t i = 0; i < N_ROW; i++) c[i].environment = sky;
    compare(state, ",\"environment\":{\"radiance\":[0.1,0.2,0.30000000000000004],\"file\":\"sky.exr\",\"scale\":2}", "",
            c, false);
    environment_free(sky);
}

/* The first two rows differ in their lamp only. */
static void test_shared_camera_paths(void **state)
{
    struct configuration c[N_ROW];
    configurations(c);
    compare(state, "", ",\"share_camera_paths\":true", c, true);
}

static void refused(void **state, const char *set_up, const char *field)
{
    write_job(state, set_up, "");
    refused_job_check(scratch_path(state, "job"), field);
}

static void test_refused(void **state)
{
    refused(state, ",\"lamp\":{\"kind\":\"round\"}", "lamp.kind");
    refused(state, ",\"environment\":{\"radiance\":[0.1,-0.2,0.3]}", "environment.radiance[1]");
    refused(state, ",\"environment\":{\"file\":\"absent.exr\"}", "environment.file");
    refused(state, ",\"environment\":{\"file\":\"a.csv\"}", "environment.file"); /* each file has one use */
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(test_left_out, scratch_folder_setup, scratch_folder_teardown),
        cmocka_unit_test_setup_teardown(test_lamp_and_camera, scratch_folder_setup, scratch_folder_teardown),
        cmocka_unit_test_setup_teardown(test_environment, scratch_folder_setup, scratch_folder_teardown),
        cmocka_unit_test_setup_teardown(test_shared_camera_paths, scratch_folder_setup, scratch_folder_teardown),
        cmocka_unit_test_setup_teardown(test_refused, scratch_folder_setup, scratch_folder_teardown),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
