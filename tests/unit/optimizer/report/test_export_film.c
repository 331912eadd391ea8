/* Films of a cloth belong to no group of exported fibers, with one set of parameters and with one for each group. */
#include "optimizer/report/export/export_scene.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>

#include <cmocka.h>

static void test_films_are_in_no_group(void **state)
{
    (void)state;
    uint8_t group[4] = {0, 1, 2, 3};
    struct made_cloth *made = calloc(1, sizeof *made);
    struct report *report = calloc(1, sizeof *report);
    struct model_setup *setup = calloc(1, sizeof *setup);
    assert_true(made != NULL && report != NULL && setup != NULL);
    made->fiber.group = group;
    report->in.made = made;
    const struct pipeline_model model = {.setup = setup};
    const struct export_scene e = {.report = report, .model = &model, .films = {.first_group = 2, .n = 2}};
    for (size_t n_set = 1; n_set <= 2; n_set++) {
        setup->sets.n_set = n_set;
        for (size_t g = 0; g < n_set; g++)
            for (size_t i = 0; i < 4; i++) assert_int_equal(export_fiber_in(&e, i, g), i < 2 && (n_set == 1 || i == g));
    }
    free(setup);
    free(report);
    free(made);
}

int main(void)
{
    const struct CMUnitTest test[] = {cmocka_unit_test(test_films_are_in_no_group)};
    return cmocka_run_group_tests(test, NULL, NULL);
}
