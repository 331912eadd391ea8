/* Recovery of known parameters by fits: figures fit.<fabric>.*, one JSON object a line; progress on standard error.
 *   bench_fit [--folder F] [--photograph-paths N] [--kept-paths N] [--score-paths N] [--path-budget N] [--sample S] [--prepare] [WHAT ...]
 *             [--sgd-budget N] [--curve-paths N] [--coverage-paths N] [--journal FILE] [--model M] [--yarn FILE|none] [--as-stated] [--row-paths N]
 * WHAT: names of fit_fabrics.c, "coverage", "seeds", "curve", "analytic", "real", "grazing"; nothing: all. "published": the published method
 * in full (3.3e9 paths: hours), continued from the file of --journal when it was stopped. --prepare renders photographs only.
 * Defaults are those of the figures: 1,000,000 paths a photograph (250,000 for coverage), 2 x 400,000 a held-out mean of the truth, 2 x 50,000
 * of a fit (10,000 of a point of a curve), the method's own budget. SELVEDGE_DATA: where measured-reflectance/ and yarns/ are.
 * "grazing" takes --model (of the four); "real" --sample (a table), --model, --yarn (file of the weave's yarn; none: smooth
 * yarns), --as-stated (cloth lies as the tables state; rows otherwise are means over all rotations, as isotropic data are)
 * and --row-paths (tells rendered / measured of every row).
 *   fit.<fabric>.wall_s, .paths          of one fit by the default method, from the default start
 *   fit.<fabric>.heldout_rel_rms         relative RMS error of 24 held-out means at the fitted parameters
 *   fit.<fabric>.truth_rel_rms           the same at the true parameters
 *   fit.<fabric>.published_paths         what the published method's own budget comes to
 *   fit.coverage_2sigma                  20 fits of gabardine and mid1 to photographs traced anew, with new noise: share of
 *                                        determined parameters within 2 se
 *   fit.seeds.worst_over_median          10 fits of gabardine with other seeds: held-out error
 *   fit.curve.<method>                   held-out error of gabardine against paths and seconds, one line a point; the
 *                                        published method with --sgd-budget paths (20 million) in all
 *   fit.analytic.<method>                error of the fitted means against the exact ones, Gabardine's parameters on the
 *                                        analytic cloth of the tests, both methods with their own budgets, 10 seeds
 *   fit.published.{wall_s,paths,heldout_rel_rms}   gabardine by the published method
 *   fit.real.<sample>.<model>.fit_rel_rms, .heldout_rel_rms   measured tables on a plain weave of plied yarns, felts on felt
 *   fit.grazing.<model>, .truth, .photograph   radiance of gabardine (photographed as two_lobe.v1) in mirrored directions against their angle
 *                                        from the normal, as fitted by each model to the 16 photographs; _brightest: at 80 degrees, of any microflakes
 */
#include "base/durable.h"
#include "optimizer/descent/descent.h"
#include "optimizer/descent/estimate_journal.h"
#include "optimizer/descent/method_names.h"
#include "optimizer/photographs/measurement_table.h"
#include "tests/support/fake_estimator.h"
#include "tests/support/fit_fabrics.h"
#include "tests/support/fit_phantom.h"

#include <glob.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const double NOISE = 0.005; /* of photographs, relative */

enum { N_COVERAGE = 20, N_SEED = 10, N_CURVE = 14, MAX_STEP = 600 };

struct bench {
    struct thread_pool *pool;
    const char *folder;
    size_t row_paths; /* for each row of a measured table told by itself; 0: none is */
    size_t photograph_paths, coverage_paths, kept_paths, score_paths, curve_paths;
    uint64_t path_budget, sgd_budget;
    const char *journal; /* of the published method; NULL: not kept */
    const char *sample; /* NULL: all measured tables */
    const char *model;  /* NULL: all four on measured tables */
    const char *yarn;   /* file of the measured tables' yarn; NULL: yarns/cotton1.txt of SELVEDGE_DATA; "none": smooth yarns */
    bool as_stated;     /* measured tables at the rotations that they state, not as means over all */
    bool prepare;
};

static void print(const char *of, const char *what, double value, const char *unit, const char *better)
{
    printf("{\"name\":\"fit.%s%s%s\",\"value\":%.6g,\"unit\":\"%s\",\"better\":\"%s\"}\n", of, what[0] ? "." : "", what,
           value, unit, better);
    fflush(stdout);
}

/* ---- one fit ---- */

struct curve {
    size_t n, n_param;
    double wall_s[MAX_STEP], paths[MAX_STEP], objective[MAX_STEP], param[MAX_STEP][SCATTERING_MAX_PARAM];
};

static status on_step(void *context, const struct fit_step *step, struct error *err)
{
    (void)err;
    struct curve *c = context;
    if (c->n == MAX_STEP) return STATUS_OK;
    c->wall_s[c->n] = step->wall_s;
    c->paths[c->n] = (double)step->n_path_total;
    c->objective[c->n] = step->objective.value;
    memcpy(c->param[c->n++], step->param, step->n_param * sizeof *step->param);
    return STATUS_OK;
}

static void run_fit(const struct fit_phantom *f, const char *method, uint64_t seed, uint64_t budget,
                    const char *journal_file, struct fit_result *r, struct curve *curve)
{
    struct error err = {0};
    struct estimate_journal *journal = NULL;
    struct fit_parameter parameter[SCATTERING_MAX_PARAM];
    struct configuration *configuration = trace_configurations(&f->fitted);
    struct trace_estimator trace = {.model = &f->model,
                                    .scene = {f->cloth.scene, f->cloth.has_volume ? &f->cloth.volume_scene : NULL},
                                    .pool = f->pool,
                                    .seed = seed,
                                    .configuration = configuration,
                                    .n_configuration = f->fitted.n};
    const struct estimator live = trace_estimator(&trace);
    struct estimator estimator = live;
    if (journal_file != NULL) {
        fit_check(estimate_journal_open(journal_file, fit_phantom_fingerprint(f), &live, NULL, NULL, &journal, &err), &err);
        estimator = estimate_journal_estimator(journal);
    }
    for (size_t p = 0; p < f->model.n_param; p++) {
        const struct param_info *info = &f->model.param[p];
        parameter[p] = (struct fit_parameter){info->lower, info->upper, info->start,
                                              strcmp(info->name, APPEARANCE_DENSITY_MULTIPLIER) == 0};
    }
    struct curve own = {0};
    if (curve == NULL) curve = &own;
    curve->n = 0;
    curve->n_param = f->model.n_param;
    const struct fit_problem problem = {.n_param = f->model.n_param,
                                        .info = f->model.param,
                                        .param = parameter,
                                        .observation = &f->fitted,
                                        .estimator = &estimator,
                                        .path_budget = budget,
                                        .report = on_step,
                                        .report_context = curve};
    fit_check(descent_find(method)->run(&problem, r, &err), &err);
    estimate_journal_close(journal);
    free(configuration);
}

static void tell_fit(const struct fit_phantom *f, const struct fit_result *r)
{
    fprintf(stderr, "  %s after %zu steps, %.3g paths, %.1f s (%.0f k paths/s), objective %.4g: %s\n",
            r->converged ? "converged" : "NOT converged", r->n_step, (double)r->n_path, r->wall_s,
            1e-3 * (double)r->n_path / r->wall_s, r->objective.value, r->reason);
    for (size_t p = 0; p < f->model.n_param; p++) {
        const struct param_info *info = &f->model.param[p];
        fprintf(stderr, "  %-18s %9.4f +- %-8.4f true %9.4f%s%s\n", info->name, param_to_file_unit(info, r->param[p]),
                param_to_file_unit(info, r->uncertainty.se_param[p]), param_to_file_unit(info, f->truth[p]),
                r->uncertainty.at_bound[p] ? " at bound" : "", r->uncertainty.determined[p] ? "" : " undetermined");
    }
}

static void keep_truth_inside(struct fit_phantom *f)
{
    for (size_t p = 0; p < f->model.n_param; p++) /* tables are rounded: not beyond a bound */
        f->truth[p] = fmin(fmax(f->truth[p], f->model.param[p].lower), f->model.param[p].upper);
}

/* Without photographs. */
static void open_cloth(const struct bench *b, const char *name, struct fit_phantom *f)
{
    const struct fit_fabric *fabric = fit_fabric_find(name);
    fprintf(stderr, "%s\n", name);
    fit_phantom_init(f, b->folder, b->pool, fabric->weave, fabric->model_id, fabric->truth);
    keep_truth_inside(f);
}

static void photograph(const struct bench *b, struct fit_phantom *f)
{
    fit_phantom_photograph(f, &(struct fit_photography){.n_path = b->photograph_paths, .noise = NOISE, .noise_seed = 1});
}

static void open_fabric(const struct bench *b, const char *name, struct fit_phantom *f)
{
    open_cloth(b, name, f);
    photograph(b, f);
}

static struct fit_score score(const struct bench *b, const struct fit_phantom *f, const double *param)
{
    return fit_phantom_score(f, JOB_SET_HELD_OUT, f->truth, b->kept_paths, param, param == f->truth ? 0 : b->score_paths);
}

/* ---- figures ---- */

/* 16 configurations x 2 replicas x 64 x 64 x 64 paths x (6 x 60 iterations, one for the first rate, up to 10 to settle);
 * rescaling curves: 5 of nine values each, one replica. */
static double published_paths(void) { return 16.0 * 64 * 64 * 64 * (2.0 * (6 * 60 + 1 + 10) + 5 * 9); }

static void bench_fabric(const struct bench *b, const char *name)
{
    struct fit_phantom f;
    struct fit_result r;
    open_fabric(b, name, &f);
    struct fit_score truth = score(b, &f, f.truth);
    fprintf(stderr, "  the truth scores %.4f +- %.4f\n", truth.rel_rms, truth.se);
    if (!b->prepare) {
        run_fit(&f, METHOD_GAUSS_NEWTON, 1, b->path_budget, NULL, &r, NULL);
        tell_fit(&f, &r);
        struct fit_score s = score(b, &f, r.param);
        fprintf(stderr, "  held out %.4f +- %.4f\n", s.rel_rms, s.se);
        print(name, "wall_s", r.wall_s, "s", "lower");
        print(name, "paths", (double)r.n_path, "path", "lower");
        print(name, "heldout_rel_rms", s.rel_rms, "1", "lower");
        print(name, "truth_rel_rms", truth.rel_rms, "1", "lower");
        print(name, "published_paths", published_paths(), "path", "lower");
    }
    fit_phantom_release(&f);
}

static void bench_coverage(const struct bench *b)
{
    static const char *const name[] = {"gabardine", "mid1"};
    size_t n_inside = 0, n_judged = 0;
    for (size_t k = 0; k < 2; k++) {
        struct fit_phantom f;
        open_cloth(b, name[k], &f);
        for (uint64_t i = 0; i < N_COVERAGE / 2; i++) {
            struct fit_result r;
            fit_phantom_photograph(&f, &(struct fit_photography){b->coverage_paths, NOISE, 100 + i, 1 + i, true});
            run_fit(&f, METHOD_GAUSS_NEWTON, 100 + i, b->path_budget, NULL, &r, NULL);
            tell_fit(&f, &r);
            size_t n_before = n_judged - n_inside;
            for (size_t p = 0; p < f.model.n_param; p++) {
                if (!r.uncertainty.determined[p] || r.uncertainty.at_bound[p]) continue;
                n_judged++;
                n_inside += fabs(r.param[p] - f.truth[p]) < 2.0 * r.uncertainty.se_param[p];
            }
            fprintf(stderr, "  %zu outside, %zu of %zu inside so far\n", n_judged - n_inside - n_before, n_inside, n_judged);
        }
        fit_phantom_release(&f);
    }
    fprintf(stderr, "%zu of %zu determined parameters within two standard errors\n", n_inside, n_judged);
    print("coverage_2sigma", "", (double)n_inside / (double)n_judged, "1", "higher");
}

static int by_size(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static void bench_seeds(const struct bench *b)
{
    struct fit_phantom f;
    double error[N_SEED];
    open_fabric(b, "gabardine", &f);
    for (uint64_t i = 0; i < N_SEED; i++) {
        struct fit_result r;
        run_fit(&f, METHOD_GAUSS_NEWTON, 200 + i, b->path_budget, NULL, &r, NULL);
        tell_fit(&f, &r);
        struct fit_score s = score(b, &f, r.param);
        fprintf(stderr, "  held out %.4f +- %.4f\n", s.rel_rms, s.se);
        error[i] = s.rel_rms;
    }
    qsort(error, N_SEED, sizeof *error, by_size);
    double median = 0.5 * (error[N_SEED / 2 - 1] + error[N_SEED / 2]);
    print("seeds.worst_over_median", "", error[N_SEED - 1] / median, "1", "lower");
    print("seeds.median_heldout_rel_rms", "", median, "1", "lower");
    fit_phantom_release(&f);
}

/* Points evenly spaced in the logarithm of paths, and the result. */
static void print_curve(const struct bench *b, const struct fit_phantom *f, const char *method, const struct curve *c,
                        const struct fit_result *r)
{
    double next = 0.0, ratio = pow(c->paths[c->n - 1] / c->paths[0], 1.0 / (N_CURVE - 1));
    for (size_t i = 0; i < c->n; i++) {
        if (c->paths[i] < next) continue;
        next = c->paths[i] * ratio;
        struct fit_score s = fit_phantom_score(f, JOB_SET_HELD_OUT, f->truth, b->kept_paths, c->param[i], b->curve_paths);
        printf("{\"name\":\"fit.curve.%s\",\"value\":%.5g,\"unit\":\"1\",\"better\":\"lower\",\"paths\":%.6g,\"wall_s\":%.4g}\n",
               method, s.rel_rms, c->paths[i], c->wall_s[i]);
        fflush(stdout);
    }
    struct fit_score s = score(b, f, r->param);
    printf("{\"name\":\"fit.curve.%s\",\"value\":%.5g,\"unit\":\"1\",\"better\":\"lower\",\"paths\":%.6g,\"wall_s\":%.4g}\n",
           method, s.rel_rms, (double)r->n_path, r->wall_s);
    fflush(stdout);
}

static void bench_curve(const struct bench *b)
{
    const struct {
        const char *method;
        uint64_t budget;
    } run[] = {{METHOD_GAUSS_NEWTON, b->path_budget}, {METHOD_PUBLISHED_SGD, b->sgd_budget}};
    struct fit_phantom f;
    struct curve *c = calloc(1, sizeof *c);
    if (c == NULL) exit(1);
    open_fabric(b, "gabardine", &f);
    print("curve.truth_rel_rms", "", score(b, &f, f.truth).rel_rms, "1", "lower");
    for (size_t k = 0; k < 2; k++) {
        struct fit_result r;
        run_fit(&f, run[k].method, 1, run[k].budget, NULL, &r, c);
        tell_fit(&f, &r);
        print_curve(b, &f, run[k].method, c, &r);
    }
    fit_phantom_release(&f);
    free(c);
}

static void bench_published(const struct bench *b)
{
    struct fit_phantom f;
    struct fit_result r;
    open_fabric(b, "gabardine", &f);
    run_fit(&f, METHOD_PUBLISHED_SGD, 1, 0, b->journal, &r, NULL);
    tell_fit(&f, &r);
    print("published", "wall_s", r.wall_s, "s", "lower");
    print("published", "paths", (double)r.n_path, "path", "lower");
    print("published", "heldout_rel_rms", score(b, &f, r.param).rel_rms, "1", "lower");
    fit_phantom_release(&f);
}

/* ---- both methods with their own budgets, on the cloth without a cloth (fake_estimator.h): seconds ---- */

static void fit_analytic(const char *method, uint64_t seed, struct curve *c)
{
    struct fake_cloth f;
    struct observation_set o;
    struct fit_parameter parameter[FAKE_N_PARAM];
    struct fit_result r;
    struct error err = {0};
    double truth[FAKE_N_PARAM];
    fake_cloth_init(&f, seed, FAKE_N_FIT);
    struct estimator e = fake_estimator(&f);
    fake_param_set(fit_fabric_find("gabardine")->truth, truth);
    observation_set_init(&o);
    fit_check(fake_observe(&f, truth, 0.005, seed, &o), &err);
    for (size_t p = 0; p < FAKE_N_PARAM; p++)
        parameter[p] = (struct fit_parameter){fake_param[p].lower, fake_param[p].upper, fake_param[p].start, false};
    const struct fit_problem problem = {.n_param = FAKE_N_PARAM,
                                        .info = fake_param,
                                        .param = parameter,
                                        .observation = &o,
                                        .estimator = &e,
                                        .report = on_step,
                                        .report_context = c};
    c->n = 0;
    fit_check(descent_find(method)->run(&problem, &r, &err), &err);
    for (size_t i = 0; i <= c->n; i++) /* the result last: the published method returns the best of its runs */
        printf("{\"name\":\"fit.analytic.%s\",\"value\":%.5g,\"unit\":\"1\",\"better\":\"lower\",\"paths\":%.6g,\"seed\":%d}\n",
               method, fake_rel_rms(&f, 0, FAKE_N_FIT, i < c->n ? c->param[i] : r.param, truth),
               i < c->n ? c->paths[i] : (double)r.n_path, (int)seed);
    observation_set_release(&o);
}

static void bench_analytic(void)
{
    struct curve *c = calloc(1, sizeof *c);
    if (c == NULL) exit(1);
    for (uint64_t seed = 1; seed <= N_SEED; seed++) {
        fit_analytic(METHOD_GAUSS_NEWTON, seed, c);
        fit_analytic(METHOD_PUBLISHED_SGD, seed, c);
    }
    free(c);
}

/* ---- measured tables ---- */

enum { N_REAL_MODEL = 4, MAX_REAL = 32 };

static const struct {
    const char *name, *id;
} real_model[N_REAL_MODEL] = {{"two_lobe", "two_lobe.v1"},
                              {"microflake", "microflake.v1"},
                              {"two_lobe_volume", "phase_two_lobe.v1"},
                              {"two_lobe_balanced", "two_lobe_balanced.v1"}};

static bool takes_model(const struct bench *b, size_t k) { return b->model == NULL || strcmp(b->model, real_model[k].name) == 0; }

struct real_row {
    char sample[64];
    struct observation_set observation;
    double error[N_REAL_MODEL][2]; /* fitted, held out */
};

static void tell_rows(const struct fit_phantom *f, const double *param, size_t n_path)
{
    struct estimate e[FIT_MAX_OBSERVATION];
    const double deg = 180.0 / M_PI;
    fit_phantom_render(f, param, n_path, e);
    fprintf(stderr, "  %-12s %5s %5s %5s %5s %5s  %-24s  %s\n", "row", "lamp", "phi", "cam", "phi", "turn", "measured", "rendered / measured");
    for (size_t i = 0; i < f->observation.n; i++) {
        const struct observation *o = &f->observation.item[i];
        const struct configuration *k = &o->configuration;
        fprintf(stderr, "  %-12s %5.0f %5.0f %5.0f %5.0f %5.0f ", o->name, k->light_theta_rad * deg, k->light_phi_rad * deg,
                k->camera_theta_rad * deg, k->camera_phi_rad * deg, k->cloth_rotation_rad * deg);
        for (int c = 0; c < 3; c++) fprintf(stderr, " %7.4f", o->mean_rgb[c]);
        for (int c = 0; c < 3; c++) fprintf(stderr, "  %5.2f +- %.2f", e[i].mean[c] / o->mean_rgb[c], sqrt(e[i].var[c]) / o->mean_rgb[c]);
        fputc('\n', stderr);
    }
}

/* The tables hold each row twice, with the cloth turned by 0 and by 90 degrees, and equal values: one mean over rotations is enough. */
static void take_as_isotropic(struct observation_set *o)
{
    size_t n = 0;
    for (size_t i = 0; i < o->n; i++) {
        if (o->item[i].configuration.cloth_rotation_rad != 0.0) continue;
        o->item[n] = o->item[i];
        o->item[n++].configuration.n_rotation = CONFIGURATION_ALL_ROTATIONS;
    }
    o->n = n;
}

static void read_table(const struct bench *b, const char *path, struct real_row *row)
{
    struct error err = {0};
    char *text = NULL;
    size_t n = 0;
    const struct job_document set_up = {
        .lamp_side_cm = 10.0, .lamp_distance_cm = 61.0, .camera_distance_cm = 100.0, .crop_cm = 1.0, .black_sheet = true};
    observation_set_init(&row->observation);
    fit_check(file_read_all(path, 1 << 20, &text, &n, &err), &err);
    fit_check(measurement_table_parse(text, n, row->sample, &set_up, &row->observation, &err), &err);
    if (!b->as_stated) take_as_isotropic(&row->observation);
    free(text);
}

/* Both errors by fresh paths: the fit's own objective is at its lowest partly by the luck of the paths that it was fitted to. */
static void score_table(const struct bench *b, const struct fit_phantom *f, const double *param, size_t k, struct real_row *row)
{
    for (int held_out = 0; held_out < 2; held_out++) {
        char what[160];
        const struct fit_score s = fit_phantom_score(f, held_out ? JOB_SET_HELD_OUT : JOB_SET_FIT, NULL, 0, param, b->score_paths / 2);
        row->error[k][held_out] = s.rel_rms;
        fprintf(stderr, "  %s %.3f +- %.3f\n", held_out ? "held out" : "fitted", s.rel_rms, s.se);
        snprintf(what, sizeof what, "%s.%s.%s", row->sample, real_model[k].name, held_out ? "heldout_rel_rms" : "fit_rel_rms");
        print("real", what, s.rel_rms, "1", "lower");
    }
}

static void fit_table(const struct bench *b, const struct fit_cloth *cloth, size_t k, struct real_row *row)
{
    struct fit_phantom f;
    struct fit_result r;
    fprintf(stderr, "%s, %s\n", row->sample, real_model[k].name);
    fit_phantom_init_on(&f, b->folder, b->pool, cloth, real_model[k].id, NULL);
    fit_phantom_observe(&f, &row->observation);
    run_fit(&f, METHOD_GAUSS_NEWTON, 1, b->path_budget, NULL, &r, NULL);
    tell_fit(&f, &r);
    if (b->row_paths > 0) tell_rows(&f, r.param, b->row_paths);
    score_table(b, &f, r.param, k, row);
    fit_phantom_release(&f);
}

static void print_table(const struct real_row *row, size_t n)
{
    fprintf(stderr, "%-32s", "relative RMS, fitted / held out");
    for (size_t k = 0; k < N_REAL_MODEL; k++) fprintf(stderr, "%20s", real_model[k].name);
    for (size_t i = 0; i < n; i++) {
        fprintf(stderr, "\n%-32s", row[i].sample);
        for (size_t k = 0; k < N_REAL_MODEL; k++)
            fprintf(stderr, "%12.3f / %.3f", row[i].error[k][0], row[i].error[k][1]);
    }
    fputc('\n', stderr);
}

/* The cloth that a sample is fitted on, made when the first one asks for it. */
static const struct fit_cloth *real_cloth(const struct bench *b, const char *data, const char *sample, struct fit_cloth cloth[2])
{
    const bool felt = strstr(sample, "felt") != NULL;
    char yarn[1024];
    if (cloth[felt].scene != NULL) return &cloth[felt];
    snprintf(yarn, sizeof yarn, "%s/yarns/cotton1.txt", data);
    const char *file = b->yarn == NULL ? yarn : b->yarn;
    fit_cloth_init(&cloth[felt], felt ? PHANTOM_FELT : PHANTOM_PLAIN, felt || strcmp(file, "none") == 0 ? NULL : file, true, b->pool);
    return &cloth[felt];
}

static void bench_real(const struct bench *b)
{
    const char *set = getenv("SELVEDGE_DATA"), *data = set != NULL ? set : "../shared/data";
    char pattern[1024];
    glob_t found;
    struct real_row row[MAX_REAL] = {0};
    struct fit_cloth cloth[2];
    size_t n = 0;
    memset(cloth, 0, sizeof cloth);
    snprintf(pattern, sizeof pattern, "%s/measured-reflectance/*.csv", data);
    if (glob(pattern, 0, NULL, &found) != 0) {
        fprintf(stderr, "skipped: no '%s' (set SELVEDGE_DATA)\n", pattern);
        return;
    }
    for (size_t i = 0; i < found.gl_pathc && n < MAX_REAL; i++) {
        const char *slash = strrchr(found.gl_pathv[i], '/');
        snprintf(row[n].sample, sizeof row[n].sample, "%s", slash != NULL ? slash + 1 : found.gl_pathv[i]);
        row[n].sample[strcspn(row[n].sample, ".")] = '\0';
        if (b->sample != NULL && strcmp(b->sample, row[n].sample) != 0) continue;
        read_table(b, found.gl_pathv[i], &row[n++]);
    }
    for (size_t k = 0; k < N_REAL_MODEL; k++)
        for (size_t i = 0; i < n && takes_model(b, k); i++) fit_table(b, real_cloth(b, data, row[i].sample, cloth), k, &row[i]);
    print_table(row, n);
    for (size_t i = 0; i < n; i++) observation_set_release(&row[i].observation);
    for (size_t k = 0; k < 2; k++)
        if (cloth[k].scene != NULL) fit_cloth_release(&cloth[k]);
    globfree(&found);
}

/* ---- lamp and camera in mirrored directions, from the normal to grazing ---- */

enum { N_MIRROR = 18, MIRROR_STEP_DEG = 5 };

static void print_mirror(const char *of, double angle_deg, const double rgb[3], double se)
{
    printf("{\"name\":\"fit.grazing.%s\",\"value\":%.5g,\"unit\":\"1\",\"better\":\"higher\",\"angle_deg\":%g,\"se\":%.2g}\n", of,
           (rgb[0] + rgb[1] + rgb[2]) / 3.0, angle_deg, se);
}

/* The photographs of the fit that were taken in such directions. */
static void print_mirror_photographs(const struct observation_set *o)
{
    const double deg = 180.0 / M_PI;
    for (size_t i = 0; i < o->n; i++) {
        const struct configuration *k = &o->item[i].configuration;
        if (fabs(k->light_theta_rad - k->camera_theta_rad) > 1e-6 || k->cloth_rotation_rad != 0.0 ||
            fabs(fabs(k->light_phi_rad - k->camera_phi_rad) - M_PI) > 1e-6)
            continue;
        print_mirror("photograph", k->light_theta_rad * deg, o->item[i].mean_rgb, 0.0);
    }
}

/* Replaces f's observations by mirrored directions: n of them from first_deg on. */
static void observe_mirror(struct fit_phantom *f, double first_deg, size_t n)
{
    const struct job_document set_up = {.lamp_side_cm = 10.0, .lamp_distance_cm = 61.0, .camera_distance_cm = 100.0, .crop_cm = 1.0};
    struct observation_set o;
    struct error err = {0};
    observation_set_init(&o);
    for (size_t i = 0; i < n; i++) {
        double theta_deg = first_deg + MIRROR_STEP_DEG * (double)i;
        const struct observation item = {.set = JOB_SET_HELD_OUT, .weight = 1.0,
                                         .configuration = observation_configuration(&set_up, theta_deg, 0.0, theta_deg, 180.0, 0.0)};
        fit_check(observation_set_append(&o, &item, &err), &err);
    }
    fit_phantom_observe(f, &o);
    observation_set_release(&o);
}

static double mean_se(const struct estimate *e) { return sqrt(e->var[0] + e->var[1] + e->var[2]) / 3.0; }

static void print_mirror_curve(const struct bench *b, struct fit_phantom *f, const char *name, const double *param)
{
    struct estimate e[N_MIRROR];
    observe_mirror(f, 0.0, N_MIRROR);
    fit_phantom_render(f, param, b->score_paths, e);
    for (size_t i = 0; i < N_MIRROR; i++) print_mirror(name, MIRROR_STEP_DEG * (double)i, e[i].mean, mean_se(&e[i]));
    fflush(stdout);
}

/* The brightest that microflakes get at 80 degrees (thesis, figure 5.15): albedo at its upper bound, gamma over its range, several d. */
static void print_brightest_microflake(const struct bench *b, const struct fit_cloth *cloth)
{
    enum { N_GAMMA = 7, N_DENSITY = 3 };
    const double at_deg = 80.0;
    struct fit_phantom f;
    struct estimate e, brightest = {0};
    double param[SCATTERING_MAX_PARAM];
    fit_phantom_init_on(&f, b->folder, b->pool, cloth, "microflake.v1", NULL);
    observe_mirror(&f, at_deg, 1);
    size_t i_gamma = f.model.n_param - 2, i_d = f.model.n_param - 1;
    const struct param_info *gamma = &f.model.param[i_gamma];
    for (size_t p = 0; p < i_gamma; p++) param[p] = f.model.param[p].upper;
    for (size_t g = 0; g < N_GAMMA; g++)
        for (size_t d = 0; d < N_DENSITY; d++) {
            param[i_gamma] = gamma->lower * pow(gamma->upper / gamma->lower, (double)g / (N_GAMMA - 1));
            param[i_d] = f.model.param[i_d].start * pow(4.0, (double)d - 1.0);
            fit_phantom_render(&f, param, b->score_paths, &e);
            fprintf(stderr, "  microflake, albedo %.3f, gamma %.3f, d %.0f /cm: %.3f\n", param[0], param[i_gamma], 1e-2 * param[i_d], e.mean[0]);
            if (e.mean[0] > brightest.mean[0]) brightest = e;
        }
    print_mirror("microflake_brightest", at_deg, brightest.mean, mean_se(&brightest));
    fit_phantom_release(&f);
}

/* Gabardine's fibers are known to be two_lobe.v1: what the other models make of photographs of them. */
static void bench_grazing(const struct bench *b)
{
    const struct fit_fabric *fabric = fit_fabric_find("gabardine");
    struct fit_cloth cloth;
    struct fit_phantom truth;
    fit_cloth_init(&cloth, fabric->weave, NULL, true, b->pool);
    fit_phantom_init_on(&truth, b->folder, b->pool, &cloth, fabric->model_id, fabric->truth);
    keep_truth_inside(&truth);
    photograph(b, &truth);
    print_mirror_photographs(&truth.fitted);
    for (size_t k = 0; k < N_REAL_MODEL; k++) {
        struct fit_phantom f;
        struct fit_result r;
        if (!takes_model(b, k)) continue;
        fprintf(stderr, "grazing, %s\n", real_model[k].name);
        fit_phantom_init_on(&f, b->folder, b->pool, &cloth, real_model[k].id, NULL);
        fit_phantom_observe(&f, &truth.observation);
        run_fit(&f, METHOD_GAUSS_NEWTON, 1, b->path_budget, NULL, &r, NULL);
        tell_fit(&f, &r);
        print_mirror_curve(b, &f, real_model[k].name, r.param);
        fit_phantom_release(&f);
    }
    print_mirror_curve(b, &truth, "truth", truth.truth);
    print_brightest_microflake(b, &cloth);
    fit_phantom_release(&truth);
    fit_cloth_release(&cloth);
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
        bench_real(b);
    else if (strcmp(what, "grazing") == 0)
        bench_grazing(b);
    else if (fit_fabric_find(what) != NULL)
        bench_fabric(b, what);
    else {
        fprintf(stderr, "unknown: '%s'\n", what);
        exit(1);
    }
}

static bool take_option(struct bench *b, const char *name, const char *value)
{
    if (strcmp(name, "--folder") == 0)
        b->folder = value;
    else if (strcmp(name, "--sample") == 0)
        b->sample = value;
    else if (strcmp(name, "--model") == 0)
        b->model = value;
    else if (strcmp(name, "--row-paths") == 0)
        b->row_paths = strtoul(value, NULL, 10);
    else if (strcmp(name, "--yarn") == 0)
        b->yarn = value;
    else if (strcmp(name, "--photograph-paths") == 0)
        b->photograph_paths = strtoul(value, NULL, 10);
    else if (strcmp(name, "--coverage-paths") == 0)
        b->coverage_paths = strtoul(value, NULL, 10);
    else if (strcmp(name, "--kept-paths") == 0)
        b->kept_paths = strtoul(value, NULL, 10);
    else if (strcmp(name, "--score-paths") == 0)
        b->score_paths = strtoul(value, NULL, 10);
    else if (strcmp(name, "--curve-paths") == 0)
        b->curve_paths = strtoul(value, NULL, 10);
    else if (strcmp(name, "--path-budget") == 0)
        b->path_budget = strtoull(value, NULL, 10);
    else if (strcmp(name, "--sgd-budget") == 0)
        b->sgd_budget = strtoull(value, NULL, 10);
    else if (strcmp(name, "--journal") == 0)
        b->journal = value;
    else
        return false;
    return true;
}

int main(int argc, char **argv)
{
    static const char *const more[] = {"coverage", "seeds", "curve", "analytic", "real", "grazing"};
    struct bench b = {
        .folder = "build/bench-fit", .photograph_paths = 1000000, .coverage_paths = 250000, .kept_paths = 400000, .score_paths = 50000,
                      .curve_paths = 10000,
                      .sgd_budget = 20000000};
    struct error err = {0};
    int i = 1;
    for (; i < argc && argv[i][0] == '-'; i++) {
        if (strcmp(argv[i], "--prepare") == 0) {
            b.prepare = true;
        } else if (strcmp(argv[i], "--as-stated") == 0) {
            b.as_stated = true;
        } else if (i + 1 == argc || !take_option(&b, argv[i], argv[i + 1])) {
            fprintf(stderr, "unknown option '%s', or its value is missing\n", argv[i]);
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
