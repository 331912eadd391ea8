/* Whether a fit of a surface model finds its parameters again: photographs of one cloth are rendered with the model,
 * and the 16 fitted ones of them are fitted with it. Prints one JSON object on each line, and progress on standard
 * error.
 *
 *   models.<id>.recovery_ratio              relative RMS error of the 24 held-out means at the fitted parameters over
 *                                           that at the true ones, in the mean over the noise of held-out photographs:
 *                                           the root of 1 and the square of what the fit adds to their stated errors
 *   models.<id>.recovery_first_order_ratio  the same by derivatives at the truth, with less noise of paths;
 *                                           far too large where a parameter that is not determined lies far from it
 *   models.<id>.recovery_s                  time of the fit
 *
 * bench_recovery FOLDER [--path-budget N] [ID ...]
 *   FOLDER         where photographs and estimates are kept
 *   --path-budget  paths of each fit at most; default: the method's own, 6 million
 *   ID             models; all without
 *
 * True parameters lie between the starts and the bounds, and photographs have a relative error of 0.5 %.
 */
#include "base/catalogue/method_catalogue.h"
#include "optimizer/fit/objective/objective.h"
#include "tests/bench/fit_bench.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { PHOTOGRAPH_PATHS = 100000, KEPT_PATHS = 20000, SCORE_PATHS = 10000 };

static void print(const char *id, const char *what, double value, const char *unit)
{
    printf("{\"name\":\"models.%s.%s\",\"value\":%.6g,\"unit\":\"%s\",\"better\":\"lower\"}\n", id, what, value, unit);
    fflush(stdout);
}

/* A dyed fiber whose other parameters are a quarter of the way from their starts to a bound, upwards and downwards in
 * turn. File units. */
static void truth_of(const struct scattering_model *m, double *truth)
{
    static const double color[3] = {0.75, 0.5, 0.3};
    for (size_t p = 0; p < m->n_param; p++) {
        const struct param_info *i = &m->param[p];
        double bound = p % 2 == 0 ? i->upper : i->lower;
        double value = i->channel >= 0 ? i->start * color[i->channel] / 0.7 : i->start + 0.25 * (bound - i->start);
        truth[p] = param_to_file_unit(i, fmin(fmax(value, i->lower), i->upper));
    }
}

static void recover(const char *folder, struct thread_pool *pool, const struct scattering_model *m, uint64_t budget)
{
    struct fit_phantom f;
    struct fit_result r;
    double truth[SCATTERING_MAX_PARAM];
    truth_of(m, truth);
    fprintf(stderr, "%s\n", m->id);
    fit_phantom_init(&f, folder, pool, PHANTOM_TWILL_2_2, m->id, truth);
    f.guided = true;
    fit_phantom_photograph(
        &f, &(struct fit_photography){.n_path = PHOTOGRAPH_PATHS, .noise = BENCH_NOISE, .noise_seed = 1});
    bench_run_fit(&f, method_gauss_newton.id, 1, budget, NULL, &r, NULL);
    bench_print_fit(&f, &r);
    const double stated = fit_phantom_stated_score(&f, JOB_SET_HELD_OUT),
                 own = fit_phantom_true_error(&f, JOB_SET_HELD_OUT, KEPT_PATHS, r.param, SCORE_PATHS),
                 first_order = fit_phantom_first_order(&f, JOB_SET_HELD_OUT, KEPT_PATHS, r.param);
    const struct fit_score at_truth = fit_phantom_score(&f, JOB_SET_HELD_OUT, f.truth, KEPT_PATHS, f.truth, 0),
                           found = fit_phantom_score(&f, JOB_SET_HELD_OUT, f.truth, KEPT_PATHS, r.param, SCORE_PATHS);
    fprintf(stderr,
            "  held out %.4f +- %.4f, the truth %.4f +- %.4f, by stated errors of photographs %.4f; against means "
            "without noise %.4f\n",
            found.rel_rms, found.se, at_truth.rel_rms, at_truth.se, stated, own);
    print(m->id, "recovery_ratio", hypot(1, own / stated), "1");
    print(m->id, "recovery_first_order_ratio", sqrt(fmax(1 + first_order / (stated * stated), 0)), "1");
    print(m->id, "recovery_s", r.wall_s, "s");
    fit_phantom_release(&f);
}

int main(int argc, char **argv)
{
    struct thread_pool *pool = NULL;
    struct error err = {0};
    const char *folder = argv[1];
    uint64_t budget = 0;
    int first = 2;
    if (argc > 3 && strcmp(argv[2], "--path-budget") == 0) {
        budget = strtoull(argv[3], NULL, 10);
        first = 4;
    }
    if (argc < 2 || (first == 4 && budget == 0)) {
        fprintf(stderr, "usage: bench_recovery FOLDER [--path-budget N] [ID ...]\n");
        return 2;
    }
    for (int i = first; i < argc; i++)
        if (scattering_find(argv[i]) == NULL) {
            fprintf(stderr, "model '%s' is unknown\n", argv[i]);
            return 2;
        }
    fit_check(thread_pool_new(0, &pool, &err), &err);
    for (int i = first; i < argc; i++) recover(folder, pool, scattering_find(argv[i]), budget);
    for (size_t k = 0; argc == first && scattering_registry()[k] != NULL; k++)
        recover(folder, pool, scattering_registry()[k], budget);
    thread_pool_free(pool);
    return 0;
}
