/* The word that somebody meant. */
#include "base/word_guess.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

static const char *const list[] = {"model", "models", "method", "volume", "path_budget", "seed", "fit", NULL};

static void test_distances(void **state)
{
    (void)state;
    assert_int_equal(word_distance("kitten", "sitting"), 3);
    assert_int_equal(word_distance("", "abc"), 3);
    assert_int_equal(word_distance("a word of more than thirty-one characters", "a"), 99);
}

static void test_guesses(void **state)
{
    (void)state;
    assert_string_equal(word_guess("modell", list), "model");
    assert_string_equal(word_guess("FIT", list), "fit");
    assert_string_equal(word_guess("volumne", list), "volume");
    assert_string_equal(word_guess("path_budget_s", list), "path_budget");
    assert_string_equal(word_guess("path", list), "path_budget");
    assert_null(word_guess("lamp", list));
    /* two of three letters are another word */
    assert_null(word_guess("fur", list));
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_distances), cmocka_unit_test(test_guesses)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
