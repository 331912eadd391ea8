/* The choice between the models of a job. */
#include "optimizer/job/document/job_fit_option.h"
#include "optimizer/stages/validation/pipeline_choice.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>

#include <cmocka.h>

enum { N_FOLD = 8 };

/* Models with their fits and validations. */
struct models {
    size_t n;
    struct model_setup setup[3];
    struct model_fit fit[3];
    struct validation validation[3];
    struct pipeline_model view[3];
};

static struct models *make_models(size_t n)
{
    struct models *m = calloc(1, sizeof *m);
    m->n = n;
    for (size_t i = 0; i < n; i++)
        m->view[i] = (struct pipeline_model){&m->setup[i], &m->fit[i], &m->validation[i], NULL};
    return m;
}

/* A model with n_free fitted unknowns of nine, and errors of the folds around `mean`, up and down by `scatter`. */
static void make_model(struct models *m, size_t i, size_t n_free, double mean, double scatter)
{
    static const struct job_fit_option option;
    struct cross_validation *v = &m->fit[i].result.cross_validation;
    struct uncertainty *u = &m->fit[i].result.unknown_uncertainty;
    m->setup[i].option = &option;
    u->n_param = 9;
    for (size_t p = 0; p < n_free; p++) u->cov[p * u->n_param + p] = 0.01;
    v->n_fold = N_FOLD;
    for (size_t f = 0; f < N_FOLD; f++) {
        v->fold_count[f] = 3.0;
        v->fold_square[f] = 3.0 * (mean + (f % 2 == 0 ? scatter : -scatter));
    }
    v->rel_square = mean;
}

/* Each job: model 0 with nine unknowns and an error of 0.01, and model 1 with four. The standard error of a difference
 * whose folds scatter by s is s / sqrt(7). */
static void test_of_equal_errors_the_simpler_model(void **state)
{
    (void)state;
    static const struct {
        double mean, scatter;
        size_t best;
    } row[] = {{0.012, 0.0, 0},   /* worse beyond doubt */
               {0.012, 0.006, 1}, /* worse by less than its error of 0.0023 */
               {0.012, 0.004, 0}, /* the error is 0.0015 */
               {0.008, 0.0, 1},   /* better */
               {0.008, 0.006, 1}};
    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        struct models *c = make_models(2);
        make_model(c, 0, 9, 0.01, 0.0);
        make_model(c, 1, 4, row[i].mean, row[i].scatter);
        assert_int_equal(pipeline_choice(c->view, c->n), CHOICE_CROSS_VALIDATION);
        assert_int_equal(pipeline_best_model(c->view, c->n), row[i].best);
        free(c);
    }
}

/* Folds that tell nothing: the model that describes the fitted rows far better than its unknowns explain is the result,
 * although the other one's rows that were left out came out a little better by chance. */
static void test_of_equal_errors_the_one_that_fits(void **state)
{
    (void)state;
    struct models *c = make_models(2);
    make_model(c, 0, 9, 0.197, 0.15);
    make_model(c, 1, 7, 0.151, 0.0);
    c->validation[0].fit.rel_square = 0.0046;
    c->validation[1].fit.rel_square = 0.137;
    assert_int_equal(pipeline_best_model(c->view, c->n), 0);
    c->validation[0].fit.rel_square = 0.13; /* two unknowns more explain that */
    assert_int_equal(pipeline_best_model(c->view, c->n), 1);
    free(c);
}

/* A better model with more unknowns is not taken for chance, and of models with as many the lower error decides. */
static void test_a_clear_difference_decides(void **state)
{
    (void)state;
    struct models *c = make_models(3);
    make_model(c, 0, 4, 0.010, 0.0);
    make_model(c, 1, 9, 0.005, 0.002);
    make_model(c, 2, 9, 0.0051, 0.002);
    assert_int_equal(pipeline_best_model(c->view, c->n), 1);
    c->n = 1;
    assert_int_equal(pipeline_choice(c->view, c->n), CHOICE_ONLY_MODEL);
    assert_int_equal(pipeline_best_model(c->view, c->n), 0);
    free(c);
}

/* Without folds the fitted rows decide, whatever the number of unknowns is. */
static void test_fitted_rows_decide_without_folds(void **state)
{
    (void)state;
    struct models *c = make_models(2);
    make_model(c, 0, 9, 0.010, 0.0);
    make_model(c, 1, 4, 0.010, 0.0);
    c->fit[1].result.cross_validation.n_fold = 0;
    c->validation[0].fit.rel_square = 0.010;
    c->validation[1].fit.rel_square = 0.011;
    c->validation[1].fit.rel_square_se = 0.01;
    assert_int_equal(pipeline_choice(c->view, c->n), CHOICE_FITTED_ROWS);
    assert_int_equal(pipeline_best_model(c->view, c->n), 0);
    free(c);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_of_equal_errors_the_simpler_model),
        cmocka_unit_test(test_of_equal_errors_the_one_that_fits),
        cmocka_unit_test(test_a_clear_difference_decides),
        cmocka_unit_test(test_fitted_rows_decide_without_folds),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
