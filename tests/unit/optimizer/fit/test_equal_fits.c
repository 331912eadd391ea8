/* Fits to the same photographs with other random numbers: the errors that they state do not jump. */
#include "base/catalogue/method_catalogue.h"
#include "tests/support/descent_fixture.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

enum { FITS = 10, LEAST = 5 };

/* Smallest and largest stated error of each parameter over all fits that determine it. */
struct spread {
    double low[FAKE_N_PARAM], high[FAKE_N_PARAM];
    size_t n[FAKE_N_PARAM];
};

static void add_fit(struct spread *s, const struct fit_result *r)
{
    for (size_t p = 0; p < FAKE_N_PARAM; p++) {
        const double se = r->uncertainty.se_param[p];
        if (!r->uncertainty.determined[p] || r->uncertainty.at_bound[p]) continue;
        s->low[p] = s->n[p] == 0 ? se : fmin(s->low[p], se);
        s->high[p] = fmax(s->high[p], se);
        s->n[p]++;
    }
}

/* Fits the photographs of one seed, known to 2 %, FITS times. Writes the geometric mean over the parameters that LEAST
 * fits determine of the largest over the smallest error, and the largest of these ratios. */
static void equal_fits(uint64_t photographs, double *mean, double *worst)
{
    struct spread spread = {0};
    size_t n = 0;
    for (uint64_t k = 0; k < FITS; k++) {
        struct descent_fixture x;
        struct fit_result r;
        descent_fixture_init(&x, photographs, 0);
        observation_set_release(&x.observation);
        observation_set_init(&x.observation);
        assert_int_equal(fake_observe(&x.cloth, x.truth, 0.02, photographs, &x.observation), STATUS_OK);
        x.cloth.seed = 100 + k;
        descent_fixture_run(&x, descent_find(method_gauss_newton.id), &r);
        add_fit(&spread, &r);
        observation_set_release(&x.observation);
    }
    *mean = 0.0;
    *worst = 1.0;
    for (size_t p = 0; p < FAKE_N_PARAM; p++) {
        if (spread.n[p] < LEAST) continue;
        *mean += log(spread.high[p] / spread.low[p]);
        *worst = fmax(*worst, spread.high[p] / spread.low[p]);
        n++;
    }
    assert_true(n >= LEAST);
    *mean = exp(*mean / (double)n);
}

static void test_equal_fits(void **state)
{
    (void)state;
    enum { PHOTOGRAPHS = 6 };
    double all = 0.0;
    for (uint64_t k = 1; k <= PHOTOGRAPHS; k++) {
        double mean, worst;
        equal_fits(k, &mean, &worst);
        print_message("photographs %d: errors of %d equal fits differ by %.2f (geometric mean), %.2f (worst)\n", (int)k,
                      FITS, mean, worst);
        assert_true(worst < 3.0);
        all += log(mean) / PHOTOGRAPHS;
    }
    assert_true(exp(all) < 2.0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_equal_fits)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
