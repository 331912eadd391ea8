/* What a job expects of its fit and its pictures: paths of the fit by its rows, size and samples of the renderings. */
#include "optimizer/worker/progress/pipeline_plan.h"
#include "optimizer/worker/report/result_pictures.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

enum { N_ROW = 16, N_ALL = 40 };

struct job {
    struct pipeline_context c;
    struct job_document doc;
    struct observation row[N_ROW];
};

/* A job with 16 fitted rows of 40, by the default method. */
static struct job *make_job(void)
{
    static struct job j;
    memset(&j, 0, sizeof j);
    snprintf(j.doc.method, sizeof j.doc.method, "gauss_newton.v1");
    j.c.doc = &j.doc;
    j.c.fitted.item = j.row;
    j.c.fitted.n = N_ROW;
    j.c.observation.n = N_ALL;
    return &j;
}

static void test_paths_follow_from_the_rows(void **state)
{
    (void)state;
    struct job *j = make_job();
    const double of_table = pipeline_plan_usual_paths(&j->c);
    assert_true(of_table > 0.5e6 && of_table < 2e6);
    j->doc.n_photograph = N_ALL; /* their errors end a fit much later */
    const double of_photographs = pipeline_plan_usual_paths(&j->c);
    assert_true(of_photographs > 3e6 && of_photographs < 6e6);
    j->c.fitted.n = N_ROW / 2; /* fewer rows, fewer paths */
    assert_true(pipeline_plan_usual_paths(&j->c) == 0.5 * of_photographs);
    j->doc.path_budget = 300000; /* is used up */
    assert_true(pipeline_plan_usual_paths(&j->c) == 300000.0);
    j->doc.n_photograph = 0;
    assert_true(pipeline_plan_usual_paths(&j->c) == 300000.0);
    j->doc.path_budget = 3000000; /* more than misfit leaves to do */
    assert_true(pipeline_plan_usual_paths(&j->c) == 0.5 * of_table);
}

/* Renderings take at most half of the paths of the fit where that allows 48 pixels with two samples. */
static void test_pictures_cost_less_than_the_fit(void **state)
{
    (void)state;
    struct job *j = make_job();
    size_t before = 0;
    for (double n_path = 1e4; n_path < 1e8; n_path *= 1.7) {
        const size_t px = result_picture_px(&j->c, n_path), sample = result_picture_samples(&j->c, n_path);
        const double all = result_renderings_paths(&j->c, n_path);
        assert_true(px >= 48 && px <= 96 && px >= before && sample >= 2 && sample <= 16);
        assert_true(all == (double)(px * px * sample * N_ALL));
        assert_true(all <= 0.5 * n_path || (px == 48 && sample == 2));
        assert_true(px == 96 || sample == 2); /* first more pixels, then more samples */
        before = px;
    }
    assert_true(before == 96);
    j->doc.render_px = 200; /* the document says so */
    assert_true(result_picture_px(&j->c, 1e4) == 200 && result_picture_samples(&j->c, 1e4) == 2);
    j->doc.render_sample = 7;
    assert_true(result_picture_px(&j->c, 1e4) == 200 && result_picture_samples(&j->c, 1e4) == 7);
    j->doc.render_px = 0;
    assert_true(result_picture_px(&j->c, 1e4) == 48);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_paths_follow_from_the_rows),
                                       cmocka_unit_test(test_pictures_cost_less_than_the_fit)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
