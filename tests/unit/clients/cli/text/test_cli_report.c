/* What the command line client prints of a result. The source files are included here, because the parts of the client
 * are in no library. */
#include "clients/cli/text/cli_text.c" /* NOLINT */

#include "clients/cli/text/cli_report.c" /* NOLINT */
#include "clients/cli/text/text_table.c" /* NOLINT */

#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>

#include <cmocka.h>

/* Prints the result of a job, which is given with ' in place of ". */
static char *printed(const char *job_text)
{
    char *out = NULL, *text = strdup(job_text);
    size_t n = 0;
    FILE *f = open_memstream(&out, &n);
    assert_true(f != NULL && text != NULL);
    for (char *c = text; *c != '\0'; c++)
        if (*c == '\'') *c = '"';
    json_error_t at;
    json_t *job = json_loads(text, 0, &at);
    if (job == NULL) fail_msg("line %d: %s", at.line, at.text);
    report_result(job, f);
    fclose(f);
    json_decref(job);
    free(text);
    return out;
}

static void check(const char *job, const char *expected)
{
    char *got = printed(job);
    assert_string_equal(got, expected);
    free(got);
}

static void test_parameters(void **state)
{
    (void)state;
    check("{'parameters': ["
          "{'name': 'C_R.r', 'value': 0.5, 'standard_error': 0.01, 'unit': '', 'at_bound': 'lower'},"
          "{'name': 'beta_R', 'value': 7.25, 'standard_error': 0.5, 'unit': 'deg', 'at_bound': 'upper'},"
          "{'name': 'w', 'value': 0.3, 'fixed': true, 'at_bound': 'lower', 'determined': false},"
          "{'name': 's', 'value': 0.3, 'at_bound': true, 'determined': false},"
          "{'name': 'C_R.g', 'value': 0.5, 'tied_to': 'C_R.r', 'prior': {}, 'at_bound': false, 'determined': true}]}",
          "fitted parameters (value +- standard error)\n"
          "  C_R.r              0.500 +- 0.010                at lower bound  \n"
          "  beta_R             7.25 +- 0.50             deg  at upper bound  \n"
          "  w                  0.3                           fixed  \n"
          "  s                  0.3                           at a bound  not determined  \n"
          "  C_R.g              0.5                           tied to C_R.r  with a prior  \n");
}

/* Each set stands under its name, and its parameters without it. */
static void test_sets(void **state)
{
    (void)state;
    check("{'parameters': [{'name': 'warp.w', 'set': 'warp', 'value': 1.0}, {'name': 'warp.s', 'set': 'warp', 'value': "
          "2.0},"
          "{'name': 'weft.w', 'set': 'weft', 'value': 3.0}, {'name': 'wefts.s', 'set': 'weft', 'value': 4.0},"
          "{'name': 's', 'set': '', 'value': 5.0}]}",
          "fitted parameters (value +- standard error)\n"
          " warp\n"
          "  w                  1                             \n"
          "  s                  2                             \n"
          " weft\n"
          "  w                  3                             \n"
          "  wefts.s            4                             \n"
          " \n"
          "  s                  5                             \n");
}

/* The meaning stands beside the name, once for the channels of a color. */
static void test_meanings(void **state)
{
    (void)state;
    check("{'parameters': [{'name': 'C_R.r', 'value': 0.5, 'meaning': 'Share of R.'},"
          "{'name': 'C_R.g', 'value': 0.5, 'meaning': 'Share of R.', 'fixed': true},"
          "{'name': 'w', 'value': 0.3, 'meaning': 'Width.', 'determined': false}]}",
          "fitted parameters (value +- standard error)\n"
          "  C_R.r              0.5                           Share of R.\n"
          "  C_R.g              0.5                           fixed  \n"
          "  w                  0.3                           not determined  Width.\n");
}

static void test_residuals(void **state)
{
    (void)state;
    check("{'result': {'fit_rel_rms': 0.0241, 'fit_rel_rms_se': 0.0005, 'heldout_rel_rms': 0.03, 'converged': false,"
          "'cross_validation': {'rel_rms': 0.04, 'rel_rms_se': 0.001},"
          "'radius': {'radius_um': 7.5, 'standard_error_um': 0.25, 'start_um': 8.0, 'determined': false, 'at_bound': "
          "true},"
          "'nuisance': [{'name': 'gain', 'value': 1.5}]}}",
          "fiber radius: 7.50 +- 0.25 um (start 8 um)  not determined  at the edge of its range\n"
          "relative RMS error, fitted: 2.41 +- 0.05 %\n"
          "relative RMS error, held out: 3 %\n"
          "relative RMS error, fitted rows left out one after another: 4.00 +- 0.10 %\n"
          "  gain               1.5                           \n"
          "The fit has NOT converged; see the log.\n");
    check("{'result': {'converged': true, 'fit_rel_rms': null}}", "");
    check("{'result': {'fit_rel_rms': 0.0, 'fit_rel_rms_se': 0.0055, 'heldout_rel_rms': 0.0, 'heldout_rel_rms_se': "
          "0.018}}",
          "relative RMS error, fitted: below 1.1 %\n"
          "relative RMS error, held out: below 3.6 %\n");
}

/* Several models make a table; errors with gains are shown where the models have them. */
static void test_models(void **state)
{
    (void)state;
    char *got =
        printed("{'result': {'chosen_by': 'cross_validation', 'models': ["
                "{'id': 'a.v1', 'fit_rel_rms': 0.02, 'fit_wall_s': 61.0, 'n_path_fit': 1e6, 'best': true},"
                "{'id': 'b.v1', 'fit_rel_rms': 0.03, 'cross_validation': {'rel_rms': 0.05}, 'converged': false}]}}");
    assert_non_null(
        strstr(got, "  a.v1                                2 %                -                -        1e+06     1:01"
                    "  best \n"));
    assert_non_null(strstr(got, "  b.v1                                3 %              5 %                -"));
    assert_non_null(
        strstr(got, "not converged\nof the best model, chosen by fitted rows left out one after another:\n"));
    free(got);
    got = printed(
        "{'result': {'models': [{'id': 'a.v1', 'fit_rel_rms': 0.02, 'fit_rel_rms_with_gains': 0.01},"
        "{'id': 'b.v1', 'fit_rel_rms': 0.03, 'fit_rel_rms_with_gains': 0.015, 'heldout_rel_rms_with_gains': 0.07}]}}");
    assert_non_null(strstr(got, " 1 % "));
    assert_non_null(strstr(got, " 1.5 % "));
    assert_non_null(strstr(got, " 7 % "));
    assert_null(strstr(got, " 2 %"));
    assert_non_null(strstr(got, "(errors: each photograph with its own gain)\nof the best model:\n"));
    free(got);
    check("{'result': {'models': [{'id': 'a.v1', 'fit_rel_rms': 0.02}]}}", "");
}

static void test_verdict(void **state)
{
    (void)state;
    check("{'verdict': {'code': 'pictures_only', 'words': 'usable for pictures only', 'text': 'A sentence.',"
          "'reservations': [{'code': 'a', 'text': 'First.'}, {'code': 'b', 'text': 'Second.'}]}}",
          "verdict      usable for pictures only\n"
          "             A sentence.\n"
          "  -          First.\n"
          "  -          Second.\n");
    check("{'verdict': null}", "");
}

static void test_geometry_only(void **state)
{
    (void)state;
    check("{'parameters': [{'name': 'w', 'value': 1.0}], 'result': {'models': [], 'geometry': {'n_fiber': 120, "
          "'total_length_mm': 45.5,"
          "'mean_radius_um': 7.25, 'grade': {'verdict': 'mostly', 'safe_share': 0.8}}}}",
          "fibers: 120, 45.5 mm in all, mean radius 7.25 um\n"
          "single fibers in the scan: mostly, 80 % of their length is sure\n");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_parameters),    cmocka_unit_test(test_sets),   cmocka_unit_test(test_meanings),
        cmocka_unit_test(test_residuals),     cmocka_unit_test(test_models), cmocka_unit_test(test_verdict),
        cmocka_unit_test(test_geometry_only),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
