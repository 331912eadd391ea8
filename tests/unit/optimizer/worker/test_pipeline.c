/* Files of the worker: checkpoints, the lock of a job folder, the series of a resumed fit, the inputs. */
#include "base/files/durable.h"
#include "base/option_id.h"
#include "optimizer/job/job_folder.h"
#include "optimizer/stages/geometry_stages.h"
#include "optimizer/stages/run/work_file.h"
#include "optimizer/stages/run/worker_series.h"
#include "tests/support/scratch_folder.h"
#include "tests/support/tracer/fake_estimator.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

#include "tests/support/refused_job.h"

static void test_work_file(void **state)
{
    const char *path = scratch_path(state, "a.bin");
    double fixed = 3.25;
    char text[] = "sections of any length";
    struct work_section out[] = {{&fixed, sizeof fixed}, {text, sizeof text}, {NULL, 0}};
    struct error err;
    assert_int_equal(work_file_read(path, "t.1", out, 3, &err), STATUS_NOT_FOUND);
    assert_int_equal(work_file_write(path, "t.1", out, 3, NULL), STATUS_OK);
    double back = 0.0;
    struct work_section in[] = {{&back, sizeof back}, {NULL, 0}, {NULL, 0}};
    assert_int_equal(work_file_read(path, "t.1", in, 3, NULL), STATUS_OK);
    assert_true(back == fixed && in[1].n_bytes == sizeof text && in[2].n_bytes == 0);
    assert_string_equal(in[1].data, text);
    free(in[1].data);
    free(in[2].data);
    size_t n;
    char *bytes = scratch_read(path, &n);
    for (size_t i = 0; i < n; i++) { /* every changed bit and every truncation is detected, and no memory leaks */
        struct work_section damaged[] = {{&back, sizeof back}, {NULL, 0}, {NULL, 0}};
        bytes[i] ^= 16;
        scratch_write(path, bytes, n);
        assert_int_not_equal(work_file_read(path, "t.1", damaged, 3, NULL), STATUS_OK);
        bytes[i] ^= 16;
        scratch_write(path, bytes, i);
        assert_int_not_equal(work_file_read(path, "t.1", damaged, 3, NULL), STATUS_OK);
        assert_null(damaged[1].data);
    }
    assert_true(back == fixed); /* the caller's value is unchanged */
    scratch_write(path, bytes, n);
    struct work_section other[] = {{&back, sizeof back}, {NULL, 0}, {NULL, 0}};
    assert_int_equal(work_file_read(path, "t.2", other, 3, NULL), STATUS_FORMAT);
    free(bytes);
}

/* A section that is written and read in more than one piece comes back as it was. */
static void test_work_file_of_a_large_section(void **state)
{
    const char *path = scratch_path(state, "large.bin");
    const size_t n = (8 << 20) + 12345;
    unsigned char *data = malloc(n);
    assert_non_null(data);
    for (size_t i = 0; i < n; i++) data[i] = (unsigned char)(i * 2654435761u >> 13);
    struct work_section out = {data, n}, in = {NULL, 0};
    assert_int_equal(work_file_write(path, "t.1", &out, 1, NULL), STATUS_OK);
    assert_int_equal(work_file_read(path, "t.1", &in, 1, NULL), STATUS_OK);
    assert_int_equal(in.n_bytes, n);
    assert_memory_equal(in.data, data, n);
    free(in.data);
    free(data);
}

/* As many sections as a job with the largest number of models needs, and not one more. */
static void test_work_file_of_many_sections(void **state)
{
    const char *path = scratch_path(state, "many.bin");
    size_t in[WORK_FILE_MAX_SECTION], out[WORK_FILE_MAX_SECTION + 1];
    struct work_section to[WORK_FILE_MAX_SECTION + 1], from[WORK_FILE_MAX_SECTION];
    for (size_t i = 0; i <= WORK_FILE_MAX_SECTION; i++) {
        out[i] = 100 + i;
        to[i] = (struct work_section){&out[i], sizeof out[i]};
        if (i < WORK_FILE_MAX_SECTION) from[i] = (struct work_section){&in[i], sizeof in[i]};
    }
    assert_int_equal(work_file_write(path, "m.1", to, WORK_FILE_MAX_SECTION, NULL), STATUS_OK);
    assert_int_equal(work_file_read(path, "m.1", from, WORK_FILE_MAX_SECTION, NULL), STATUS_OK);
    for (size_t i = 0; i < WORK_FILE_MAX_SECTION; i++) assert_int_equal(in[i], out[i]);
    assert_int_equal(work_file_write(path, "m.1", to, WORK_FILE_MAX_SECTION + 1, NULL), STATUS_INTERNAL);
    assert_int_equal(work_file_read(path, "m.1", to, WORK_FILE_MAX_SECTION + 1, NULL), STATUS_INTERNAL);
}

static void test_folder_sweep(void **state)
{
    static const char *const gone[] = {"work/fit.bin.part", "results/result.json.tmp-AbCdEf", "results/scan/.part"},
                             *const kept[] = {"work/fit.bin", "results/result.json", "results/scan/x.part.png",
                                              "results/x.tmp-AbCde"};
    struct worker_folder f;
    char path[2000];
    assert_int_equal(durable_make_folder(scratch_path(state, "swept/results/scan"), NULL), STATUS_OK);
    snprintf(path, sizeof path, "%s", scratch_path(state, "swept"));
    assert_int_equal(worker_folder_open(&f, path, NULL), STATUS_OK);
    for (size_t i = 0; i < 3; i++) {
        snprintf(path, sizeof path, "swept/%s", gone[i]);
        scratch_write(scratch_path(state, path), "x", 1);
    }
    for (size_t i = 0; i < 4; i++) {
        snprintf(path, sizeof path, "swept/%s", kept[i]);
        scratch_write(scratch_path(state, path), "x", 1);
    }
    worker_folder_sweep(&f);
    for (size_t i = 0; i < 3; i++) {
        snprintf(path, sizeof path, "swept/%s", gone[i]);
        assert_int_equal(access(scratch_path(state, path), F_OK), -1);
    }
    for (size_t i = 0; i < 4; i++) {
        snprintf(path, sizeof path, "swept/%s", kept[i]);
        assert_int_equal(access(scratch_path(state, path), F_OK), 0);
    }
    worker_folder_close(&f);
}

static void test_folder(void **state)
{
    struct worker_folder a, b;
    struct error err;
    assert_int_equal(worker_folder_open(&a, scratch_path(state, "absent"), &err), STATUS_NOT_FOUND);
    assert_int_equal(durable_make_folder(scratch_path(state, "job"), NULL), STATUS_OK);
    const char *attempt = "{\"attempt\":3,\"token\":\"abc\"}";
    scratch_write(scratch_path(state, "job/attempt.json"), attempt, strlen(attempt));
    char path[2000];
    snprintf(path, sizeof path, "%s/", scratch_path(state, "job")); /* a slash at the end does no harm */
    assert_int_equal(worker_folder_open(&a, path, NULL), STATUS_OK);
    assert_int_equal(a.attempt, 3);
    assert_int_equal(worker_folder_open(&b, scratch_path(state, "job"), &err), STATUS_STALE);
    assert_int_equal(worker_folder_check(&a, NULL), STATUS_OK);
    assert_false(worker_folder_stage_done(&a, "fit"));
    assert_int_equal(worker_folder_mark_stage(&a, "fit", NULL), STATUS_OK);
    assert_true(worker_folder_stage_done(&a, "fit"));
    attempt = "{\"attempt\":4,\"token\":\"def\"}";
    scratch_write(scratch_path(state, "job/attempt.json"), attempt, strlen(attempt));
    assert_int_equal(worker_folder_check(&a, &err), STATUS_STALE);
    assert_int_equal(worker_folder_mark_stage(&a, "validation", NULL), STATUS_STALE);
    assert_false(worker_folder_stage_done(&a, "validation"));
    worker_folder_close(&a);
    assert_int_equal(worker_folder_open(&b, scratch_path(state, "job"), NULL), STATUS_OK);
    assert_int_equal(b.attempt, 4);
    worker_folder_close(&b);
}

static bool count_record(void *context, const char *json, size_t n_json)
{
    size_t *n = context, step;
    char want[40];
    (void)n_json;
    assert_int_equal(sscanf(json, "{\"step\":%zu", &step), 1);
    snprintf(want, sizeof want, "{\"step\":%zu,", *n);
    assert_memory_equal(json, want, strlen(want));
    (*n)++;
    return true;
}

static void add_steps(struct worker_series *s, size_t first, size_t n, bool replayed)
{
    static struct estimate estimate[2];
    double param[FAKE_N_PARAM] = {0};
    const struct model_info info = {.id = "fake", .n_param = FAKE_N_PARAM, .param = fake_param};
    struct fit_parameter parameter[FAKE_N_PARAM] = {{0.0, 1.0, 0.5, false}};
    const struct worker_series_model model = {&info, parameter, 0, 0};
    for (size_t i = first; i < first + n; i++) {
        struct fit_step step = {.step = i,
                                .phase = "p",
                                .n_param = FAKE_N_PARAM,
                                .n_configuration = 1,
                                .param = param,
                                .replica = {&estimate[0], &estimate[1]}};
        assert_int_equal(worker_series_add(s, &step, &model, replayed, NULL), STATUS_OK);
    }
}

/* A resumed fit repeats its earlier steps. No step is written twice, and records after the point of resumption, also a
 * torn one, are removed. */
static void test_series(void **state)
{
    struct worker_folder f;
    struct worker_series *s = NULL;
    const char *folder = scratch_path(state, "series");
    assert_int_equal(durable_make_folder(folder, NULL), STATUS_OK);
    assert_int_equal(worker_folder_open(&f, folder, NULL), STATUS_OK);
    static const struct {
        size_t n_replayed, n_new, n_after;
    } attempt[] = {{0, 5, 5}, {5, 2, 7}, {3, 1, 4}, {4, 0, 4}, {2, 3, 5}};
    for (size_t k = 0; k < sizeof attempt / sizeof attempt[0]; k++) {
        size_t n = 0;
        assert_int_equal(worker_series_open(&f, &s, NULL), STATUS_OK);
        add_steps(s, 0, attempt[k].n_replayed, true);
        add_steps(s, attempt[k].n_replayed, attempt[k].n_new, false);
        worker_series_close(s);
        assert_int_equal(record_read(scratch_path(state, "series/series.rec"), 0, count_record, &n, NULL, NULL),
                         STATUS_OK);
        assert_int_equal(n, attempt[k].n_after);
        FILE *torn = fopen(scratch_path(state, "series/series.rec"), "ab");
        assert_non_null(torn);
        fputs("0123abcd {\"step\":99", torn);
        fclose(torn);
    }
    worker_folder_close(&f);
}

static void check_input_error(void **state, const char *document, const char *field)
{
    assert_int_equal(durable_make_folder(scratch_path(state, "inputs/input"), NULL), STATUS_OK);
    scratch_write(scratch_path(state, "inputs/job.json"), document, strlen(document));
    refused_job_check(scratch_path(state, "inputs"), field);
}

static void test_inputs(void **state)
{
    check_input_error(state,
                      "{\"sample\":\"s\",\"fibers\":{\"file\":\"a.hair\"},\"measurements\":{\"file\":\"absent.csv\"}}",
                      "measurements.file");
    check_input_error(state,
                      "{\"sample\":\"s\",\"fibers\":{\"file\":\"a.hair\"},\"measurements\":{\"file\":\"a.csv\"},"
                      "\"fit\":{\"model\":\"x\"}}",
                      "fit.model");
    check_input_error(state,
                      "{\"sample\":\"s\",\"fibers\":{\"file\":\"a.hair\"},\"photographs\":[{\"file\":\"p.exr\",\"light_"
                      "theta_deg\":1,\"light_phi_deg\":1,"
                      "\"camera_theta_deg\":1,\"camera_phi_deg\":1}]}",
                      "photographs[0].file");
}

/* Radii in a wrong unit are refused before all ends on the faces are compared with each other. */
static void test_fibers_wider_than_the_tile(void **state)
{
    static const char document[] = "{\"sample\":\"s\",\"fibers\":{\"file\":\"a.txt\",\"tile_mm\":[0.1,0.2]},"
                                   "\"measurements\":{\"file\":\"a.csv\"}}";
    static const char rows[] = "set,light_theta_deg,light_phi_deg,camera_theta_deg,camera_phi_deg,r,g,b\n"
                               "fit,20,0,20,180,.1,.1,.1\nfit,30,0,20,180,.1,.1,.1\nfit,40,0,20,180,.1,.1,.1\n"
                               "fit,50,0,20,180,.1,.1,.1\nfit,60,0,20,180,.1,.1,.1\nfit,70,0,20,180,.1,.1,.1\n";
    static const char *const fibers[2] = {"0 0 0 0.0499\n0.1 0.2 0 0.0499\n",
                                          "0 0.05 0 0.01\n0.1 0.05 0 0.01\n\n0 0.05 0 0.0501\n0.1 0.05 0 0.0501\n"};
    assert_int_equal(durable_make_folder(scratch_path(state, "wide/input"), NULL), STATUS_OK);
    scratch_write(scratch_path(state, "wide/job.json"), document, sizeof document - 1);
    scratch_write(scratch_path(state, "wide/input/a.csv"), rows, sizeof rows - 1);
    for (int i = 0; i < 2; i++) {
        struct worker_folder f;
        struct job_inputs in;
        struct fibers_output out;
        struct stage_tools tools = {.folder = &f, .warn = {stage_warn, &tools}};
        struct error err = {0};
        scratch_write(scratch_path(state, "wide/input/a.txt"), fibers[i], strlen(fibers[i]));
        assert_int_equal(worker_folder_open(&f, scratch_path(state, "wide"), NULL), STATUS_OK);
        job_inputs_init(&in);
        memset(&out, 0, sizeof out);
        fiber_set_init(&out.fiber);
        if (job_inputs_read(&tools, &in, &err) != STATUS_OK) fail_msg("%s", err.text);
        const struct fibers_input stage = {.tools = &tools, .scan = in.section.scan, .cloth = in.section.cloth};
        assert_int_equal(stage_fibers(&stage, &out, &err), i == 0 ? STATUS_OK : STATUS_INVALID);
        if (i == 1) {
            assert_string_equal(err.field, OPTION_FIBER_FILE);
            assert_non_null(
                strstr(err.text,
                       "'a.txt': fiber 1 has a radius of 0.0501 mm, the tile is 0.1 x 0.2 mm: the unit may be wrong"));
        }
        fiber_set_release(&out.fiber);
        job_inputs_release(&in);
        worker_folder_close(&f);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_work_file_of_a_large_section),
                                       cmocka_unit_test(test_work_file),
                                       cmocka_unit_test(test_work_file_of_many_sections),
                                       cmocka_unit_test(test_folder),
                                       cmocka_unit_test(test_folder_sweep),
                                       cmocka_unit_test(test_series),
                                       cmocka_unit_test(test_inputs),
                                       cmocka_unit_test(test_fibers_wider_than_the_tile)};
    return cmocka_run_group_tests(tests, scratch_folder_setup, scratch_folder_teardown);
}
