/* Benchmark of fits: how well they recover known parameters. Prints figures fit.*, one JSON object on each line, and
 * progress on standard error.
 *
 *   bench_fit [OPTION ...] [WHAT ...]
 *
 * WHAT is a name of fit_fabrics.c, or one of these. Without WHAT, all but the last two run.
 *   coverage             20 fits, five of each of four fabrics, each to a fifth of the photographs' paths
 *   seeds                10 fits of gabardine with different seeds
 *   curve                error of one fabric over the course of a fit, for both methods
 *   analytic             both methods with their own budgets on the analytic cloth of the tests, 10 seeds
 *   real                 measured tables, with the cloth turned as they state: 16 rows fitted, 24 held out
 *   grazing              all models fitted to gabardine, seen in mirrored directions up to grazing angles
 *   real_all_rotations   measured tables, with rows as means over all rotations (their data are isotropic)
 *   published            the published method with its own budget (3.3e9 paths, which take hours)
 *
 * Options, with the defaults of the figures:
 *   --folder F              where photographs and estimates are kept
 *   --photograph-paths N    1,000,000 for each photograph
 *   --kept-paths N          2 x 200,000 for each held-out mean of the truth
 *   --score-paths N         2 x 50,000 for each held-out mean of a fit (10,000 of a point of a curve)
 *   --path-budget N         of each fit; the method's default
 *   --prepare               only make photographs
 *   --sgd-budget N          of the published method in "curve": 20 million paths in all
 *   --curve-paths N         for each point of a curve
 *   --fabric NAME           of "curve" and "published": gabardine
 *   --journal FILE          of "published", which continues from it after a stop
 *   --model M               of "grazing" and of measured tables: one of the four models
 *   --sample S              of measured tables: only this one
 *   --yarn FILE|none        of measured tables: yarn of the weave; none: smooth yarns
 *   --flatness F            of measured tables: width over height of the yarns, 3.6
 *   --row-paths N           of measured tables: print rendered / measured of every row
 * The environment variable SELVEDGE_DATA names the folder of measured-reflectance/ and yarns/.
 *
 *   fit.<fabric>.wall_s, .paths          of one fit by the default method from the default start
 *   fit.<fabric>.heldout_rel_rms         relative RMS error of 24 held-out means at the fitted parameters
 *   fit.<fabric>.truth_rel_rms           the same at the true parameters
 *   fit.<fabric>.true_rel_rms            relative RMS error of the held-out means against those at the true parameters,
 *                                        without the photographs' noise
 *   fit.<fabric>.first_order_ratio       held-out error over that of the truth, by derivatives, without noise of paths
 *   fit.<fabric>.published_paths         path budget of the published method
 *   fit.coverage_2sigma                  share of determined parameters within two standard errors
 *   fit.seeds.worst_over_median          held-out error of the worst seed over the median
 *   fit.seeds.first_order_worst_over_median   the same by first_order_ratio
 *   fit.curve.<method>                   held-out error against paths and seconds, one line for each point
 *   fit.analytic.<method>                error of the fitted means against the exact ones, with Gabardine's parameters
 *   fit.published.<fabric>.{wall_s,paths,heldout_rel_rms,truth_rel_rms,first_order_ratio}
 *   fit.real.<sample>.<model>.{fit_rel_rms,heldout_rel_rms}   on a plain weave of plied yarns; felt samples on felt
 *   fit.real_all_rotations.<sample>...   the same
 *   fit.grazing.<model>, .truth, .photograph   radiance in mirrored directions against their angle from the normal. The
 *                                        models are fitted to 16 photographs that are made with two_lobe.v1
 *   fit.grazing.microflake_brightest     largest radiance of any microflakes at 80 degrees
 */
#include "base/catalogue/method_catalogue.h"
#include "optimizer/fit/objective/objective.h"
#include "tests/bench/fit_bench.h"
#include "tests/support/cloth/fit_fabrics.h"

#include <ctype.h>
#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { N_PART = 5, N_SEED = 10, N_CURVE = 14 };

/* Opens cloth and model of a fabric, without photographs. */
static void open_cloth(const struct bench *b, const char *name, struct fit_phantom *f)
{
    const struct fit_fabric *fabric = fit_fabric_find(name);
    fprintf(stderr, "%s\n", name);
    fit_phantom_init(f, b->folder, b->pool, fabric->weave, fabric->model_id, fabric->truth);
    bench_keep_truth_inside(f);
}

static void open_fabric(const struct bench *b, const char *name, struct fit_phantom *f)
{
    open_cloth(b, name, f);
    bench_photograph(b, f);
}

static struct fit_score score(const struct bench *b, const struct fit_phantom *f, const double *param)
{
    return fit_phantom_score(f, JOB_SET_HELD_OUT, f->truth, b->kept_paths, param,
                             param == f->truth ? 0 : b->score_paths);
}

/* Path budget of the published method: 16 configurations x 2 replicas x 64 x 64 pixels x 64 samples for each iteration.
 * There are 6 x 60 iterations, one for the first step length, and up to 10 with short steps at the end. The 5 rescaling
 * curves need nine values each, in one replica. */
static double published_paths(void) { return 16.0 * 64 * 64 * 64 * (2.0 * (6 * 60 + 1 + 10) + 5 * 9); }

/* The held-out error over that of the truth, from the stated errors of the photographs and the error of the fit to
 * first order, so that it has no noise of score paths. Both terms are unbiased; where derivatives are noisy they can
 * therefore be negative. */
static double first_order_ratio(const struct bench *b, const struct fit_phantom *f, const struct fit_result *r)
{
    double photographs = fit_phantom_stated_score(f, JOB_SET_HELD_OUT), square = photographs * photographs;
    double fit = fit_phantom_first_order(f, JOB_SET_HELD_OUT, b->kept_paths, r->param),
           stated = fit_phantom_expected(f, JOB_SET_HELD_OUT, b->kept_paths, r->uncertainty.cov);
    double ratio = sqrt(fmax(1.0 + fit / square, 0.0));
    fprintf(stderr, "  held out to first order %.4f (%.2f times the truth), ", photographs * ratio, ratio);
    if (stated > -square)
        fprintf(stderr, "%.4f expected from the stated errors of photographs and parameters\n", sqrt(square + stated));
    else
        fprintf(stderr, "derivatives are too noisy for the value expected from the stated errors\n");
    return ratio;
}

static void bench_fabric(const struct bench *b, const char *name)
{
    struct fit_phantom f;
    struct fit_result r;
    open_fabric(b, name, &f);
    struct fit_score truth = score(b, &f, f.truth);
    fprintf(stderr, "  the truth scores %.4f +- %.4f, %.4f expected from the photographs' stated errors\n",
            truth.rel_rms, truth.se, fit_phantom_stated_score(&f, JOB_SET_HELD_OUT));
    if (!b->prepare) {
        bench_run_fit(&f, method_gauss_newton.id, 1, b->path_budget, NULL, &r, NULL);
        bench_print_fit(&f, &r);
        struct fit_score s = score(b, &f, r.param);
        fprintf(stderr, "  held out %.4f +- %.4f\n", s.rel_rms, s.se);
        bench_print(name, "first_order_ratio", first_order_ratio(b, &f, &r), "1", "lower");
        bench_print(name, "wall_s", r.wall_s, "s", "lower");
        bench_print(name, "paths", (double)r.n_path, "path", "lower");
        double own = fit_phantom_true_error(&f, JOB_SET_HELD_OUT, b->kept_paths, r.param, b->score_paths);
        fprintf(stderr, "  against means without noise %.4f\n", own);
        bench_print(name, "heldout_rel_rms", s.rel_rms, "1", "lower");
        bench_print(name, "true_rel_rms", own, "1", "lower");
        bench_print(name, "truth_rel_rms", truth.rel_rms, "1", "lower");
        bench_print(name, "published_paths", published_paths(), "path", "lower");
    }
    fit_phantom_release(&f);
}

/* Fits one fabric several times, each time to another part of its photographs' paths. */
static void cover_fabric(const struct bench *b, const char *name, size_t *n_inside, size_t *n_judged)
{
    struct fit_phantom f;
    open_cloth(b, name, &f);
    for (uint64_t i = 0; i < N_PART; i++) {
        struct fit_result r;
        fit_phantom_photograph(&f, &(struct fit_photography){b->photograph_paths / N_PART, BENCH_NOISE, 100 + i, i});
        bench_run_fit(&f, method_gauss_newton.id, 100 + i, b->path_budget, NULL, &r, NULL);
        bench_print_fit(&f, &r);
        for (size_t p = 0; p < f.model.n_param; p++) {
            if (!r.uncertainty.determined[p] || r.uncertainty.at_bound[p]) continue;
            ++*n_judged;
            *n_inside += fabs(r.param[p] - f.truth[p]) < 2.0 * r.uncertainty.se_param[p];
        }
        fprintf(stderr, "  %zu of %zu inside two standard errors so far\n", *n_inside, *n_judged);
    }
    fit_phantom_release(&f);
}

static void bench_coverage(const struct bench *b)
{
    static const char *const name[] = {"gabardine", "mid1", "silk", "mid2"};
    size_t n_inside = 0, n_judged = 0;
    for (size_t k = 0; k < sizeof name / sizeof name[0]; k++) cover_fabric(b, name[k], &n_inside, &n_judged);
    fprintf(stderr, "%zu of %zu determined parameters within two standard errors\n", n_inside, n_judged);
    bench_print("coverage_2sigma", "", (double)n_inside / (double)n_judged, "1", "higher");
}

static int by_size(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* Returns the median, and sorts the values. */
static double median(double value[N_SEED])
{
    qsort(value, N_SEED, sizeof *value, by_size);
    return 0.5 * (value[N_SEED / 2 - 1] + value[N_SEED / 2]);
}

static void bench_seeds(const struct bench *b)
{
    struct fit_phantom f;
    double error[N_SEED], ratio[N_SEED];
    open_fabric(b, "gabardine", &f);
    for (uint64_t i = 0; i < N_SEED; i++) {
        struct fit_result r;
        bench_run_fit(&f, method_gauss_newton.id, 200 + i, b->path_budget, NULL, &r, NULL);
        bench_print_fit(&f, &r);
        struct fit_score s = score(b, &f, r.param);
        fprintf(stderr, "  held out %.4f +- %.4f\n", s.rel_rms, s.se);
        ratio[i] = first_order_ratio(b, &f, &r);
        error[i] = s.rel_rms;
    }
    double middle = median(error);
    bench_print("seeds.worst_over_median", "", error[N_SEED - 1] / middle, "1", "lower");
    bench_print("seeds.median_heldout_rel_rms", "", middle, "1", "lower");
    middle = median(ratio);
    bench_print("seeds.first_order_worst_over_median", "", ratio[N_SEED - 1] / middle, "1", "lower");
    fit_phantom_release(&f);
}

/* Prints points that are evenly spaced in the logarithm of paths, and the result of the fit. */
static void print_curve(const struct bench *b, const struct fit_phantom *f, const char *method,
                        const struct fit_curve *c, const struct fit_result *r)
{
    double next = 0.0, ratio = pow(c->paths[c->n - 1] / c->paths[0], 1.0 / (N_CURVE - 1));
    for (size_t i = 0; i < c->n; i++) {
        if (c->paths[i] < next) continue;
        next = c->paths[i] * ratio;
        struct fit_score s =
            fit_phantom_score(f, JOB_SET_HELD_OUT, f->truth, b->kept_paths, c->param[i], b->curve_paths);
        printf("{\"name\":\"fit.curve.%s\",\"value\":%.5g,\"unit\":\"1\",\"better\":\"lower\",\"paths\":%.6g,\"wall_"
               "s\":%.4g}\n",
               method, s.rel_rms, c->paths[i], c->wall_s[i]);
        fflush(stdout);
    }
    struct fit_score s = score(b, f, r->param);
    printf("{\"name\":\"fit.curve.%s\",\"value\":%.5g,\"unit\":\"1\",\"better\":\"lower\",\"paths\":%.6g,\"wall_s\":%."
           "4g}\n",
           method, s.rel_rms, (double)r->n_path, r->wall_s);
    fflush(stdout);
}

static void bench_curve(const struct bench *b)
{
    const struct {
        const char *method;
        uint64_t budget;
    } run[] = {{method_gauss_newton.id, b->path_budget}, {method_published_sgd.id, b->sgd_budget}};
    struct fit_phantom f;
    struct fit_curve *c = calloc(1, sizeof *c);
    if (c == NULL) exit(1);
    open_fabric(b, b->fabric, &f);
    bench_print("curve.truth_rel_rms", "", score(b, &f, f.truth).rel_rms, "1", "lower");
    for (size_t k = 0; k < 2; k++) {
        struct fit_result r;
        bench_run_fit(&f, run[k].method, 1, run[k].budget, NULL, &r, c);
        bench_print_fit(&f, &r);
        print_curve(b, &f, run[k].method, c, &r);
    }
    fit_phantom_release(&f);
    free(c);
}

static void bench_published(const struct bench *b)
{
    struct fit_phantom f;
    struct fit_result r;
    char of[64];
    snprintf(of, sizeof of, "published.%s", b->fabric);
    open_fabric(b, b->fabric, &f);
    bench_run_fit(&f, method_published_sgd.id, 1, 0, b->journal, &r, NULL);
    bench_print_fit(&f, &r);
    bench_print(of, "wall_s", r.wall_s, "s", "lower");
    bench_print(of, "paths", (double)r.n_path, "path", "lower");
    struct fit_score fitted = score(b, &f, r.param), truth = score(b, &f, f.truth);
    fprintf(stderr, "  held out %.4f +- %.4f, the truth %.4f +- %.4f\n", fitted.rel_rms, fitted.se, truth.rel_rms,
            truth.se);
    bench_print(of, "heldout_rel_rms", fitted.rel_rms, "1", "lower");
    bench_print(of, "truth_rel_rms", truth.rel_rms, "1", "lower");
    bench_print(of, "first_order_ratio", first_order_ratio(b, &f, &r), "1", "lower");
    fit_phantom_release(&f);
}

static void run_one(const struct bench *b, const char *what)
{
    if (strcmp(what, "coverage") == 0)
        bench_coverage(b);
    else if (strcmp(what, "seeds") == 0)
        bench_seeds(b);
    else if (strcmp(what, "curve") == 0)
        bench_curve(b);
    else if (strcmp(what, "analytic") == 0)
        bench_analytic();
    else if (strcmp(what, "published") == 0)
        bench_published(b);
    else if (strcmp(what, "real") == 0)
        bench_real(b, false);
    else if (strcmp(what, "real_all_rotations") == 0)
        bench_real(b, true);
    else if (strcmp(what, "grazing") == 0)
        bench_grazing(b);
    else if (fit_fabric_find(what) != NULL)
        bench_fabric(b, what);
    else {
        fprintf(stderr, "unknown: '%s'\n", what);
        exit(1);
    }
}

/* Reads a text that is a whole number of 1 or more. */
static bool take_count(const char *text, uint64_t *count)
{
    char *end;
    errno = 0;
    *count = strtoull(text, &end, 10);
    return isdigit((unsigned char)text[0]) && *end == '\0' && errno == 0 && *count > 0;
}

static bool take_option(struct bench *b, const char *name, const char *value)
{
    const struct {
        const char *name, **to;
    } text[] = {{"--folder", &b->folder}, {"--fabric", &b->fabric}, {"--sample", &b->sample},
                {"--model", &b->model},   {"--yarn", &b->yarn},     {"--journal", &b->journal}};
    const struct {
        const char *name;
        uint64_t *to;
    } count[] = {{"--row-paths", &b->row_paths},     {"--photograph-paths", &b->photograph_paths},
                 {"--kept-paths", &b->kept_paths},   {"--score-paths", &b->score_paths},
                 {"--curve-paths", &b->curve_paths}, {"--path-budget", &b->path_budget},
                 {"--sgd-budget", &b->sgd_budget}};
    for (size_t i = 0; i < sizeof text / sizeof text[0]; i++) {
        if (strcmp(name, text[i].name) != 0) continue;
        *text[i].to = value;
        return fit_fabric_find(b->fabric) != NULL && bench_has_model(b->model);
    }
    for (size_t i = 0; i < sizeof count / sizeof count[0]; i++)
        if (strcmp(name, count[i].name) == 0) return take_count(value, count[i].to);
    return strcmp(name, "--flatness") == 0 && (b->flatness = strtod(value, NULL)) >= 1.0;
}

int main(int argc, char **argv)
{
    static const char *const more[] = {"coverage", "seeds", "curve", "analytic", "grazing", "real"};
    struct bench b = {
        .folder = "build/bench-fit",
        .fabric = "gabardine",
        .photograph_paths = 1000000,
        .kept_paths = 200000,
        .score_paths = 50000,
        .curve_paths = 10000,
        .flatness = 3.6,
        .sgd_budget = 20000000,
    };
    struct error err = {0};
    int i = 1;
    for (; i < argc && argv[i][0] == '-'; i++) {
        if (strcmp(argv[i], "--prepare") == 0) {
            b.prepare = true;
        } else if (i + 1 == argc || !take_option(&b, argv[i], argv[i + 1])) {
            fprintf(stderr, "option '%s' is unknown, or its value is missing or wrong\n", argv[i]);
            return 1;
        } else {
            i++;
        }
    }
    fit_check(thread_pool_new(0, &b.pool, &err), &err);
    if (i == argc) {
        for (const struct fit_fabric *f = fit_fabric; f->name != NULL; f++) run_one(&b, f->name);
        for (size_t k = 0; k < sizeof more / sizeof more[0]; k++) run_one(&b, more[k]);
    }
    for (; i < argc; i++) run_one(&b, argv[i]);
    thread_pool_free(b.pool);
    return 0;
}
