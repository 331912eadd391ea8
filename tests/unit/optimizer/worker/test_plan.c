/* What a job expects of its fit and its pictures: paths of the fit by its rows, size and samples of the renderings. */
#include "optimizer/job/document/job_document.h"
#include "optimizer/job/document/job_fit.h"
#include "optimizer/job/document/job_results.h"
#include "optimizer/job/document/job_rows.h"
#include "optimizer/report/report_work.h"
#include "optimizer/report/result/result_pictures.h"
#include "optimizer/worker/pipeline_plan.h"
#include "optimizer/worker/plan_probe.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>
#include <math.h>

enum { N_ROW = 16, N_ALL = 40 };
enum {
#define EXPORT(name, ...) EXPORT_##name,
#include "generated/exports.def"
#undef EXPORT
    N_EXPORT
};

struct job {
    struct job_plan plan;
    struct job_inputs in;
    struct job_document *doc;
    struct observation row[N_ROW];
};

/* A job with 16 fitted rows of 40, by the default method. */
static struct job *make_job(void)
{
    static struct job j;
    job_document_free(j.doc);
    memset(&j, 0, sizeof j);
    j.doc = job_document_new();
    assert_non_null(j.doc);
    snprintf(j.doc->fit->method, sizeof j.doc->fit->method, "gauss_newton.v1");
    j.in.section = job_document_sections(j.doc);
    j.in.rows.fitted.item = j.row;
    j.in.rows.fitted.n = N_ROW;
    j.in.rows.observation.n = N_ALL;
    j.plan = (struct job_plan){.in = &j.in};
    return &j;
}

static void test_paths_follow_from_the_rows(void **state)
{
    (void)state;
    struct job *j = make_job();
    const double of_table = pipeline_plan_usual_paths(&j->plan);
    assert_true(of_table > 0.5e6 && of_table < 2e6);
    j->doc->rows->n_photograph = N_ALL; /* their errors end a fit much later */
    const double of_photographs = pipeline_plan_usual_paths(&j->plan);
    assert_true(of_photographs > 3e6 && of_photographs < 6e6);
    j->in.rows.fitted.n = N_ROW / 2; /* fewer rows, fewer paths */
    assert_true(pipeline_plan_usual_paths(&j->plan) == 0.5 * of_photographs);
    j->doc->fit->path_budget = 300000; /* is used up */
    assert_true(pipeline_plan_usual_paths(&j->plan) == 300000.0);
    j->doc->rows->n_photograph = 0;
    assert_true(pipeline_plan_usual_paths(&j->plan) == 300000.0);
    j->doc->fit->path_budget = 3000000; /* more than misfit leaves to do */
    assert_true(pipeline_plan_usual_paths(&j->plan) == 0.5 * of_table);
}

/* Renderings with their guides take at most half of the time of the fit where that allows 48 pixels with four samples.
 */
static void test_pictures_cost_less_than_the_fit(void **state)
{
    (void)state;
    struct job *j = make_job();
    size_t before = 0;
    for (double n_path = 1e4; n_path < 1e8; n_path *= 1.7) {
        const size_t px = result_picture_px(j->doc->results, N_ALL, n_path),
                     sample = result_picture_samples(j->doc->results, N_ALL, n_path);
        const double all = result_renderings_paths(j->doc->results, N_ALL, n_path);
        assert_true(px >= 48 && px <= 192 && px >= before && sample >= 4 && sample <= 16);
        assert_true(fabs(all / (double)(px * px * sample * N_ALL) - 1.2) < 1e-9);
        assert_true(all <= 0.5 * n_path * (1 + 1e-9) || (px == 48 && sample == 4));
        assert_true(px == 192 || sample == 4); /* first more pixels, then more samples */
        before = px;
    }
    assert_true(before == 192);
    j->doc->results->render_px = 200; /* the document says so */
    assert_true(result_picture_px(j->doc->results, N_ALL, 1e4) == 200 &&
                result_picture_samples(j->doc->results, N_ALL, 1e4) == 4);
    j->doc->results->render_sample = 7;
    assert_true(result_picture_px(j->doc->results, N_ALL, 1e4) == 200 &&
                result_picture_samples(j->doc->results, N_ALL, 1e4) == 7);
    j->doc->results->render_px = 0;
    assert_true(result_picture_px(j->doc->results, N_ALL, 1e4) == 48);
}

/* Processor seconds that the reports of three jobs have taken, without the pages: pictures of a dense twill of 1,284
 * fibers and of a loose plain weave of 387, and a fit to a table on a plain weave of 640 with all exports. */
static void test_reports_that_were_measured(void **state)
{
    (void)state;
    static const struct {
        enum job_kind kind;
        size_t n_twin_path, n_texel;
        double n_segment, took_s;
    } row[] = {{JOB_OF_PICTURES, 40000, 256, 76770.0, 9.14},
               {JOB_OF_PICTURES, 20000, 1024, 12668.0, 4.25},
               {JOB_OF_FIT, 20000, 256, 19330.0, 64.3}};
    for (size_t i = 0; i < sizeof row / sizeof *row; i++) {
        struct job_results *r = make_job()->doc->results;
        struct job_surface_picture picture = {.px = 128, .sample = 8};
        double part_s[REPORT_N_PART], at = 0.0;
        r->n_surface_picture = 1;
        r->surface_picture = &picture;
        r->twin = true;
        r->twin_paths = row[i].n_twin_path;
        r->twin_texels = row[i].n_texel;
        for (size_t k = 0; k < JOB_MAX_EXPORT; k++) r->exported[k] = row[i].kind == JOB_OF_FIT && k < N_EXPORT;
        r->export_pdf = row[i].kind == JOB_OF_FIT;
        const struct report_work_input in = {.kind = row[i].kind,
                                             .results = r,
                                             .n_row = 12,
                                             .n_fit_path = 2e5,
                                             .n_fit_path_of_models = 2e5,
                                             .path_s = 8e-6,
                                             .n_thread = 1.0,
                                             .n_segment = row[i].n_segment};
        report_work(&in, part_s);
        const double expected_s = report_work_sum(part_s) - part_s[REPORT_PAGES];
        print_message("expected %.1f s, took %.1f s\n", expected_s, row[i].took_s);
        assert_true(fmax(expected_s, row[i].took_s) < 2.5 * fmin(expected_s, row[i].took_s));
        for (size_t k = 0; k <= REPORT_N_PART; k++) {
            const double before = report_work_before(part_s, k);
            assert_true(before >= at && before <= 1.0);
            at = before;
        }
        assert_true(at == 1.0 && report_work_before(part_s, REPORT_FINDINGS) == 0.0);
        assert_true((part_s[REPORT_EXPORTS] > 5.0 && part_s[REPORT_PAGES] > 1.0) == (row[i].kind == JOB_OF_FIT));
        r->surface_picture = NULL;
        r->n_surface_picture = 0;
    }
}

/* n straight fibers of 10 um radius and 1 mm length, each of two pieces, in a tile of 1 mm x 1 mm. */
static void make_layers(struct fiber_set *f, size_t n)
{
    fiber_set_init(f);
    assert_int_equal(fiber_set_reserve(f, n, 3 * n, NULL), STATUS_OK);
    f->tile_size_m[0] = f->tile_size_m[1] = 1e-3;
    for (size_t i = 0; i < n; i++) {
        f->first_vertex[i] = 3 * i;
        f->radius_m[i] = 1e-5f;
        for (size_t k = 0; k < 3; k++)
            memcpy(f->position_m + 9 * i + 3 * k, (float[3]){5e-4f * (float)k, 1e-5f * (float)i, 0.0f},
                   3 * sizeof(float));
    }
    f->first_vertex[n] = 3 * n;
}

/* 125 fibers of 0.02 mm2 cover the tile 2.5 times. */
static void test_paths_in_a_thin_cloth_are_shorter(void **state)
{
    (void)state;
    static const struct {
        size_t n;
        double share;
    } row[] = {{1, 0.1}, {125, 0.63212}, {250, 0.86466}, {2500, 1.0}};
    for (size_t i = 0; i < sizeof row / sizeof *row; i++) {
        struct fiber_set f;
        make_layers(&f, row[i].n);
        assert_true(fabs(plan_probe_path_share(&f) - row[i].share) < 1e-4);
        fiber_set_release(&f);
    }
}

static double certificate_s_of(const char *id, size_t n_fixed)
{
    struct job_document *doc = job_document_new();
    struct model_setup *m = calloc(1, sizeof *m);
    struct job_inputs in = {.section = job_document_sections(doc), .kind = JOB_OF_FIT, .n_model = 1, .model = m};
    struct job_plan plan = {.in = &in};
    assert_non_null(m);
    assert_non_null(doc);
    snprintf(doc->rows->measurement_file, sizeof doc->rows->measurement_file, "rows.csv");
    doc->fit->n_model = 1;
    assert_true(appearance_find(id, &m->appearance));
    assert_int_equal(model_sets_init(&m->sets, model_catalogue_find(id), NULL, 0, NULL), STATUS_OK);
    for (size_t p = 0; p < m->sets.info.n_param; p++)
        m->parameter[p] = (struct fit_parameter){.start = m->sets.info.param[p].start, .fixed = p < n_fixed};
    plan_probe_take(&plan);
    assert_true(plan.path_share == 1.0);
    free(m);
    job_document_free(doc);
    return plan.certificate_s;
}

/* The tables of an elliptical fiber take some hundred times as long as those of an isotropic one. */
static void test_the_certificate_goes_with_the_model(void **state)
{
    (void)state;
    const double tables = certificate_s_of("elliptical.v1", 0);
    assert_true(tables > 10.0 * certificate_s_of("isotropic.v1", 0) && tables > 0.0);
    assert_true(certificate_s_of("elliptical.v1", MODEL_MAX_PARAM) == 0.0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_paths_follow_from_the_rows), cmocka_unit_test(test_pictures_cost_less_than_the_fit),
        cmocka_unit_test(test_reports_that_were_measured), cmocka_unit_test(test_paths_in_a_thin_cloth_are_shorter),
        cmocka_unit_test(test_the_certificate_goes_with_the_model)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
