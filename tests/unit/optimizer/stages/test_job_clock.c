/* The predicted end of a job: what speeds of earlier jobs, finished stages and the running stage say, and a fraction
 * that neither falls nor leaps. */
#include "base/files/durable.h"
#include "optimizer/stages/run/job_clock.h"
#include "tests/support/scratch_folder.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

static const struct speed_book empty = {.n = 0};

/* Runs stage i for `seconds`, with a fraction that rises as the power `bend` of time. Returns the largest factor
 * between predicted and true remaining time, from a tenth of total_s, the time of the job, on. */
static double run_stage(struct job_clock *c, size_t i, double *now_s, double seconds, double bend, double total_s)
{
    double worst = 1.0, shown = c->shown;
    job_clock_begin(c, i, *now_s);
    for (int k = 1; k < 200; k++) {
        double t = *now_s + seconds * k / 200.0, rest = total_s - t;
        job_clock_fraction(c, pow(k / 200.0, bend), t);
        struct job_clock_look look = job_clock_look(c, t);
        assert_true(look.fraction >= shown && look.fraction <= shown + JOB_CLOCK_STEP + 1e-12);
        assert_true(isnan(look.eta_low_s) || (look.eta_low_s < look.eta_s && look.eta_s < look.eta_high_s));
        shown = look.fraction;
        if (t > 0.1 * total_s && rest > 0.05 * total_s)
            worst = fmax(worst, fmax(look.eta_s, rest) / fmin(look.eta_s, rest));
    }
    *now_s += seconds;
    job_clock_fraction(c, 1.0, *now_s);
    job_clock_end(c, false, *now_s);
    return worst;
}

static void plan(struct job_clock *c, size_t i, const char *key, double units, double usual_s)
{
    const struct job_clock_work work = {.key = key, .units = units, .usual_s = usual_s, .log_sd = 0.8};
    job_clock_plan(c, i, &work);
}

/* A job of two stages of 30 s and 70 s, `slower` times as long. */
static double run_job(struct speed_book *book, double slower, struct job_clock *c)
{
    double now_s = 0.0, worst;
    job_clock_init(c, 2, book, now_s);
    plan(c, 0, "first", 1000.0, 0.001);
    plan(c, 1, "second", 10.0, 100.0);
    worst = run_stage(c, 0, &now_s, 30.0 * slower, 2.0, 100.0 * slower);
    plan(c, 1, "second", 10.0, 100.0);
    worst = fmax(worst, run_stage(c, 1, &now_s, 70.0 * slower, 0.5, 100.0 * slower));
    job_clock_remember(c, book);
    return worst;
}

static void test_remembered_speeds_predict_the_next_job(void **state)
{
    (void)state;
    static struct job_clock c;
    static struct speed_book book;
    book = empty;
    assert_true(run_job(&book, 1.0, &c) > 1.25); /* nothing is known, and the fractions are not even */
    assert_int_equal(book.n, 2);
    assert_true(run_job(&book, 1.0, &c) < 1.1);
    assert_true(run_job(&book, 1.0, &c) < 1.05);
    assert_true(run_job(&book, 1.2, &c) < 1.25); /* another program runs beside it */
}

/* A fraction that waits for 60 of 100 s, as between the parts of a stage: once that is known, the remaining time
 * falls with the time. */
static double waiting_job(struct speed_book *book, struct job_clock *c)
{
    double worst = 1.0;
    job_clock_init(c, 1, book, 0.0);
    plan(c, 0, "waits", 100.0, 1.0);
    job_clock_begin(c, 0, 0.0);
    for (int t = 1; t < 100; t++) {
        job_clock_fraction(c, t < 20 ? 0.02 * t : t < 80 ? 0.42 : 0.42 + 0.029 * (t - 80), t);
        double eta = job_clock_look(c, t).eta_s, rest = 100.0 - t;
        if (t > 10 && t < 97) worst = fmax(worst, fmax(eta, rest) / fmin(eta, rest));
    }
    job_clock_fraction(c, 1.0, 100.0);
    job_clock_end(c, false, 100.0);
    job_clock_remember(c, book);
    return worst;
}

static void test_a_fraction_that_waits(void **state)
{
    (void)state;
    static struct job_clock c;
    static struct speed_book book;
    book = empty;
    double first = waiting_job(&book, &c), second = waiting_job(&book, &c);
    print_message("worst factor %.2f, then %.2f\n", first, second);
    assert_true(first > 2.0 && second < 1.2);
}

/* A stage that predicts its own end overrules what earlier ones took, and makes the other stages no slower. */
static void test_a_stage_that_predicts_its_end(void **state)
{
    (void)state;
    static struct job_clock c;
    static struct speed_book book;
    book = empty;
    const struct job_clock_work fit = {
        .key = "fit", .units = 100.0, .usual_s = 1.0, .log_sd = 0.8, .predicts_end = true};
    job_clock_init(&c, 2, &book, 0.0);
    job_clock_plan(&c, 0, &fit);
    plan(&c, 1, "after", 10.0, 1.0);
    job_clock_begin(&c, 0, 0.0);
    job_clock_fraction(&c, 0.5, 10.0); /* 20 s, not 100 s */
    double eta = job_clock_look(&c, 10.0).eta_s;
    assert_true(eta > 19.0 && eta < 27.0);
    job_clock_fraction(&c, 1.0, 20.0);
    job_clock_end(&c, false, 20.0);
    assert_true(fabs(job_clock_expected_s(&c, 1) - 10.0) < 1e-9);
}

/* A stage that took four times as long says that the machine is slow only if its time hardly varies between jobs. */
static void test_which_stages_tell_the_speed(void **state)
{
    (void)state;
    static struct job_clock c;
    for (int steady = 0; steady < 2; steady++) {
        const struct job_clock_work first = {
            .key = "first", .units = 10.0, .usual_s = 1.0, .log_sd = steady ? 0.4 : 0.8};
        job_clock_init(&c, 2, &empty, 0.0);
        job_clock_plan(&c, 0, &first);
        plan(&c, 1, "after", 10.0, 1.0);
        job_clock_begin(&c, 0, 0.0);
        job_clock_fraction(&c, 1.0, 40.0);
        job_clock_end(&c, false, 40.0);
        const double expected = job_clock_expected_s(&c, 1);
        assert_true(steady ? expected > 15.0 && expected < 40.0 : fabs(expected - 10.0) < 1e-9);
    }
}

/* A first job whose stage is known to spend most of its time at the beginning. */
static void test_a_usual_curve(void **state)
{
    (void)state;
    static struct job_clock c;
    static struct speed_book book;
    double curve[SPEED_CURVE_POINTS];
    for (size_t k = 0; k < SPEED_CURVE_POINTS; k++) curve[k] = sqrt((double)(k + 1) / SPEED_CURVE_POINTS);
    book = empty;
    for (int known = 0; known < 2; known++) {
        const struct job_clock_work work = {
            .key = "felt", .units = 100.0, .usual_s = 1.0, .log_sd = 0.8, .usual_curve = known ? curve : NULL};
        job_clock_init(&c, 1, &book, 0.0);
        job_clock_plan(&c, 0, &work);
        job_clock_begin(&c, 0, 0.0);
        for (int t = 1; t <= 50; t++) job_clock_fraction(&c, t * t / 1e4, t);
        double eta = job_clock_look(&c, 50.0).eta_s; /* a quarter of the fraction, half of the time */
        assert_true(known ? fabs(eta - 50.0) < 3.0 : eta > 60.0);
    }
}

/* A fit of which half of the time has passed at a third of its fraction, again and again: the clock learns it. */
static void test_predictions_that_were_off(void **state)
{
    (void)state;
    static struct job_clock c;
    static struct speed_book book;
    double eta[4];
    book = empty;
    const struct job_clock_work fit = {
        .key = "fit", .units = 100.0, .usual_s = 1.0, .log_sd = 0.8, .predicts_end = true};
    for (int k = 0; k < 4; k++) {
        job_clock_init(&c, 1, &book, 0.0);
        job_clock_plan(&c, 0, &fit);
        job_clock_begin(&c, 0, 0.0);
        for (int t = 1; t <= 50; t++) job_clock_fraction(&c, 0.3 * t / 50.0, t);
        eta[k] = job_clock_look(&c, 50.0).eta_s;
        for (int t = 51; t <= 100; t++) job_clock_fraction(&c, 0.3 + 0.7 * (t - 50) / 50.0, t);
        job_clock_end(&c, false, 100.0);
        job_clock_remember(&c, &book);
    }
    assert_true(eta[0] > 60.0);
    for (int k = 1; k < 4; k++) assert_true(fabs(eta[k] - 50.0) < fabs(eta[k - 1] - 50.0));
    assert_true(fabs(eta[3] - 50.0) < 7.0);
}

static void test_nothing_known_is_a_range(void **state)
{
    (void)state;
    static struct job_clock c;
    static struct speed_book book;
    book = empty;
    job_clock_init(&c, 1, &book, 0.0);
    assert_true(isnan(job_clock_look(&c, 0.0).eta_s));
    plan(&c, 0, "only", 100.0, 1.0);
    job_clock_begin(&c, 0, 0.0);
    struct job_clock_look look = job_clock_look(&c, 0.0);
    assert_true(look.eta_s > 50.0 && look.eta_low_s < 0.5 * look.eta_s && look.eta_high_s > 2.0 * look.eta_s);
    for (int k = 0; k < 5; k++) run_job(&book, 1.0, &c);
    job_clock_init(&c, 1, &book, 0.0);
    plan(&c, 0, "first", 1000.0, 1.0);
    job_clock_begin(&c, 0, 0.0);
    look = job_clock_look(&c, 0.0);
    assert_true(fabs(look.eta_s - 30.0) < 0.1 && isnan(look.eta_low_s) == (isnan(look.eta_high_s)));
}

/* A last stage of 10 s by its plan takes 200 s and says after one second that nothing is left: a remaining time is
 * stated all along, and the fraction rises in every ten seconds. */
static void test_a_fraction_that_does_not_stand_still(void **state)
{
    (void)state;
    static struct job_clock c;
    double before = 0.0;
    job_clock_init(&c, 1, &empty, 0.0);
    plan(&c, 0, "last", 10.0, 1.0);
    job_clock_begin(&c, 0, 0.0);
    for (int t = 1; t <= 200; t++) {
        job_clock_fraction(&c, 1.0, t);
        const struct job_clock_look look = job_clock_look(&c, t);
        assert_true(look.eta_s > 0.0 && look.fraction < 1.0 && look.fraction >= before);
        if (t % 10 != 0) continue;
        print_message("%d s: %.4f\n", t, look.fraction);
        assert_true(look.fraction > before + 5e-5);
        before = look.fraction;
    }
    assert_true(before > 0.99 && before < 0.9995);
}

/* What an earlier attempt has done counts as done, and its time says nothing about the speed. */
static void test_a_resumed_job(void **state)
{
    (void)state;
    static struct job_clock c;
    static struct speed_book book;
    book = empty;
    for (int k = 0; k < 3; k++) run_job(&book, 1.0, &c);
    job_clock_init(&c, 2, &book, 0.0);
    plan(&c, 0, "first", 1000.0, 1.0);
    plan(&c, 1, "second", 10.0, 1.0);
    job_clock_begin(&c, 0, 0.0);
    job_clock_end(&c, true, 0.01);
    job_clock_begin(&c, 1, 0.01);
    assert_true(fabs(job_clock_look(&c, 0.01).eta_s - 70.0) < 0.5);
    job_clock_fraction(&c, 0.7, 0.02); /* half of the time, which the journal gives back at once */
    job_clock_restart(&c, 0.02);
    assert_true(fabs(job_clock_look(&c, 0.02).eta_s - 35.0) < 2.0);
    for (int k = 1; k <= 40; k++) {
        const double was = c.shown, shown = job_clock_look(&c, 0.02 + 0.5 * k).fraction;
        assert_true(shown >= was && shown - was <= 0.5 * JOB_CLOCK_STEP + 1e-9); /* in half a second */
    }
    assert_true(c.shown > 0.65 && c.shown < 0.9);
    job_clock_fraction(&c, 1.0, 30.0);
    job_clock_end(&c, false, 30.0);
    size_t n = book.n;
    double before = speed_book_find(&book, "second")->log_s_per_unit;
    job_clock_remember(&c, &book);
    assert_true(book.n == n && speed_book_find(&book, "second")->log_s_per_unit == before);
}

static void test_the_book_is_a_file(void **state)
{
    const char *folder = *state;
    char path[512];
    static struct speed_book book, again;
    static struct job_clock c;
    book = empty;
    snprintf(path, sizeof path, "%s/speeds.json", folder);
    speed_book_read(path, &again);
    assert_int_equal(again.n, 0);
    for (int k = 0; k < 3; k++) run_job(&book, 1.0 + 0.1 * k, &c);
    assert_int_equal(speed_book_write(path, &book, NULL), STATUS_OK);
    speed_book_read(path, &again);
    assert_int_equal(again.n, 2);
    for (size_t i = 0; i < 2; i++) {
        assert_string_equal(again.entry[i].key, book.entry[i].key);
        assert_true(fabs(again.entry[i].log_s_per_unit - book.entry[i].log_s_per_unit) < 1e-4);
        assert_true(again.entry[i].n_job == 3.0 && fabs(again.entry[i].log_var - book.entry[i].log_var) < 1e-4);
    }
    static const char *const damaged[] = {"",
                                          "{",
                                          "[]",
                                          "{\"speeds\":3}",
                                          "{\"speeds\":{\"a\":{\"n_job\":-1}}}",
                                          ("{\"speeds\":{\"a\":{\"n_job\":1,\"log_s_per_unit\":0,\"log_var\":0,"
                                           "\"curve\":[0.5,0.4]}}}")};
    for (size_t i = 0; i < sizeof damaged / sizeof damaged[0]; i++) {
        assert_int_equal(durable_replace(path, damaged[i], strlen(damaged[i]), NULL), STATUS_OK);
        speed_book_read(path, &again);
        assert_int_equal(again.n, 0);
    }
}

static void test_a_full_book_forgets_the_first(void **state)
{
    (void)state;
    static struct speed_book book;
    double curve[SPEED_CURVE_POINTS] = {0};
    char key[16];
    book = empty;
    for (int i = 0; i <= SPEED_BOOK_MAX_ENTRY; i++) {
        snprintf(key, sizeof key, "key %d", i);
        speed_book_add(&book, key, 1.0, 1.0, curve);
    }
    assert_int_equal(book.n, SPEED_BOOK_MAX_ENTRY);
    assert_null(speed_book_find(&book, "key 0"));
    assert_non_null(speed_book_find(&book, "key 1"));
    assert_non_null(speed_book_find(&book, key));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_remembered_speeds_predict_the_next_job),
        cmocka_unit_test(test_a_fraction_that_waits),
        cmocka_unit_test(test_a_stage_that_predicts_its_end),
        cmocka_unit_test(test_which_stages_tell_the_speed),
        cmocka_unit_test(test_a_usual_curve),
        cmocka_unit_test(test_predictions_that_were_off),
        cmocka_unit_test(test_nothing_known_is_a_range),
        cmocka_unit_test(test_a_fraction_that_does_not_stand_still),
        cmocka_unit_test(test_a_resumed_job),
        cmocka_unit_test_setup_teardown(test_the_book_is_a_file, scratch_folder_setup, scratch_folder_teardown),
        cmocka_unit_test(test_a_full_book_forgets_the_first),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
