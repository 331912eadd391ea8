/* Paths per second and core, and time to a given standard error, on the cloth of the benchmarks. Prints one JSON object
 * on each line.
 *
 *   transport.<set>.paths_per_s_core
 *       Paths with all derivatives.
 *   transport.<set>.s_to_1pct_mean
 *       Seconds for each configuration on one core until the mean has a standard error of 1 %; mean over the 16
 *       configurations.
 *   transport.<set>.s_to_5pct_derivative
 *       The same until the derivative by C_TT (mean of the channels) has a standard error of 5 %.
 *   transport.<set>.<parameter>.s_to_5pct_derivative
 *       The same for each of C_R, beta_R, beta_TT, gamma_TT. It is the median over the 16 configurations, because some
 *       derivatives pass through 0, where a relative error has no meaning.
 *   transport.<set>.<width>.s_to_1pct_of_mean
 *       Seconds until the standard error of d R / d ln(width) is 1 % of R; mean over the configurations. This has a
 *       meaning also where the derivative is near 0.
 *   transport.<set>.shared_camera_speedup
 *       Time of the 16 configurations over the time when pairs that differ only in their lamp share their paths.
 *   transport.fleece.peak_bytes
 *       Largest resident memory of a process that makes a scene of as many fibers as the Fleece cloth has (31,091 with
 *       580,660 segments) and traces 16 x 256 paths with derivatives.
 *   transport.published_iteration_s.gabardine
 *       Processor seconds of one iteration of the published method: 16 configurations x 2 replicas x 64 x 64 x 64 plain
 *       paths.
 *
 * bench_transport [PATHS] [NAME]
 *   PATHS   for each configuration (16384); published_iteration has its own number
 *   NAME    run only this set, "fleece" or "published"
 */
#include "base/clock.h"
#include "base/rng.h"
#include "renderer/estimate/estimate.h"
#include "tests/support/cloth/hand_weave.h"
#include "tests/support/tracer/orbit_configurations.h"
#include "tests/support/tracer/trace_input.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

enum { N_CONFIGURATION = 16 };

static const struct {
    const char *name;
    double param[9]; /* file units; fabric thesis, Tables 5.1 and 5.3 */
} fabric[] = {
    {"defaults", {0.1, 0.1, 0.1, 0.85, 0.85, 0.85, 5, 10, 10}},
    {"gabardine", {0.185, 0.047, 0.069, 0.999, 0.330, 0.354, 2.141, 10, 23.548}},
    {"silk", {0.745, 0.008, 0.070, 0.620, 0.553, 0.562, 1, 10, 19.823}},
    {"cotton", {0.989, 0.959, 0.874, 0.999, 0.999, 0.999, 1, 27.197, 38.269}},
};

static void print(const char *set, const char *what, double value, const char *unit, const char *better)
{
    printf("{\"name\":\"transport.%s%s%s\",\"value\":%.6g,\"unit\":\"%s\",\"better\":\"%s\"}\n", set,
           what[0] ? "." : "", what, value, unit, better);
    fflush(stdout);
}

static int by_size(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* Seconds on one core to a relative standard error of 5 %, as a median over the configurations. For a colour it is the
 * error of the mean of its channels. */
static double s_to_derivative(const struct estimate e[16], size_t first, bool colour, double per_path)
{
    double s[16];
    for (int i = 0; i < 16; i++) {
        double jac = 0, se = 0;
        for (size_t ch = 0; ch < 3; ch++) {
            size_t k = ch * 9 + first + (colour ? ch : 0);
            jac += e[i].jac[k];
            se += sqrt(e[i].jac_var[k]);
        }
        s[i] = se * se / (jac * jac) * (double)e[i].n_path / 25e-4 * per_path;
    }
    qsort(s, 16, sizeof *s, by_size);
    return 0.5 * (s[7] + s[8]);
}

/* Seconds on one core until the standard error of d R / d ln p is 1 % of R, as a mean over the configurations. */
static double s_to_log_derivative(const struct estimate e[16], size_t p, double at, double per_path)
{
    double s = 0;
    for (int i = 0; i < 16; i++) {
        double mean = 0, se = 0;
        for (size_t ch = 0; ch < 3; ch++) {
            mean += e[i].mean[ch];
            se += sqrt(e[i].jac_var[ch * 9 + p]) * at;
        }
        s += se * se / (mean * mean) * (double)e[i].n_path / 1e-4 * per_path / 16;
    }
    return s;
}

/* 31,091 fibers with 18 or 19 segments, 580,660 segments in all, that lie in the plane in random directions. */
static void fleece_fibers(struct fiber_set *f)
{
    enum { N_FIBER = 31091, N_SEGMENT = 580660 };
    const double tile_m = 4e-3, step_m = 60e-6;
    fiber_set_init(f);
    if (fiber_set_reserve(f, N_FIBER, N_FIBER + N_SEGMENT, NULL) != STATUS_OK) abort();
    f->tile_size_m[0] = f->tile_size_m[1] = tile_m;
    size_t n = 0;
    struct rng r;
    for (size_t i = 0; i < N_FIBER; i++) {
        rng_start(&r, &(struct rng_key){.seed = 9}, (uint32_t)i, 0);
        double p[3] = {tile_m * rng_double(&r), tile_m * rng_double(&r), 1.2e-3 * rng_double(&r)};
        double phi = 2 * M_PI * rng_double(&r), climb = 0.3 * (rng_double(&r) - 0.5),
               bend = 0.2 * (rng_double(&r) - 0.5);
        size_t n_segment = 18 + (i < N_SEGMENT - 18 * (size_t)N_FIBER);
        f->radius_m[i] = 7e-6f;
        f->axis_class[i] = 0;
        for (size_t v = 0; v <= n_segment; v++, n++) {
            for (int a = 0; a < 3; a++) f->position_m[3 * n + (size_t)a] = (float)p[a];
            p[0] += step_m * cos(phi);
            p[1] += step_m * sin(phi);
            p[2] += step_m * climb;
            phi += bend;
        }
        f->first_vertex[i + 1] = n;
    }
    f->first_vertex[0] = 0;
}

static int trace_fleece(void)
{
    struct fiber_set f;
    struct scene *scene = NULL;
    struct configuration c[16];
    static struct estimate e[16];
    struct error err = {0};
    size_t n[16];
    const struct scattering_model *m = scattering_find("two_lobe.v1");
    double param[9];
    fleece_fibers(&f);
    orbit_configurations_16(c);
    for (int i = 0; i < 16; i++) n[i] = 256;
    for (int p = 0; p < 9; p++) param[p] = m->param[p].start;
    status st = scene_new(&f, &(struct scene_option){.black_sheet = true}, &scene, &err);
    struct appearance model;
    struct estimate_request q = {.input = trace_input_surface(scene, m, param, &model),
                                 .configuration = c,
                                 .n_configuration = 16,
                                 .n_path = n,
                                 .seed = 1};
    q.input.want_derivative = true;
    if (st == STATUS_OK) st = estimate_run(&q, NULL, NULL, e, &err);
    if (st == STATUS_OK)
        fprintf(stderr, "fleece: %zu segments, %zu fibers\n", scene_n_segment(scene), f.n_fiber);
    else
        fprintf(stderr, "%s\n", err.text);
    scene_free(scene);
    fiber_set_release(&f);
    return st == STATUS_OK ? 0 : 1;
}

/* Runs in a process of its own, so that nothing else contributes to its memory. */
static int bench_fleece(void)
{
    int code = 0;
    struct rusage usage;
    pid_t child = fork();
    if (child == 0) _exit(trace_fleece());
    if (child < 0 || wait4(child, &code, 0, &usage) < 0 || !WIFEXITED(code) || WEXITSTATUS(code) != 0) return 1;
    print("fleece", "peak_bytes", 1024.0 * (double)usage.ru_maxrss, "byte", "lower");
    return 0;
}

/* The bench cloth under the 16 configurations, one thread. */
struct bench {
    struct scene *scene;
    struct thread_pool *pool;
    struct configuration configuration[N_CONFIGURATION];
    size_t n_path;
};

/* Estimates with all derivatives. Returns the processor seconds. Ends the program when that fails. */
static double trace(const struct bench *b, const double param[9], size_t n_path, uint32_t replica, bool share,
                    bool plain, struct estimate e[N_CONFIGURATION])
{
    struct error err = {0};
    size_t n[N_CONFIGURATION];
    for (int i = 0; i < N_CONFIGURATION; i++) n[i] = n_path;
    struct appearance model;
    struct estimate_request q = {.input = trace_input_surface(b->scene, scattering_find("two_lobe.v1"), param, &model),
                                 .configuration = b->configuration,
                                 .n_configuration = N_CONFIGURATION,
                                 .n_path = n,
                                 .seed = 1,
                                 .replica = replica,
                                 .share_camera_paths = share};
    q.input.want_derivative = true;
    q.input.plain_paths = plain;
    double t0 = clock_process_s();
    if (estimate_run(&q, b->pool, NULL, e, &err) != STATUS_OK) {
        fprintf(stderr, "%s\n", err.text);
        exit(1);
    }
    return clock_process_s() - t0;
}

/* Prints the times to 1 % of the mean and to 5 % of the derivative by C_TT, as means over the configurations.
 * Channels are correlated, so their standard errors are added. */
static void print_times(const char *set, const struct estimate e[N_CONFIGURATION], double per_path)
{
    double s_mean = 0, s_derivative = 0, sd = 0, bounce = 0;
    for (int i = 0; i < N_CONFIGURATION; i++) {
        double n_path = (double)e[i].n_path, mean = 0, se = 0, jac = 0, jac_se = 0;
        for (size_t ch = 0; ch < 3; ch++) {
            mean += e[i].mean[ch];
            se += sqrt(e[i].var[ch]);
            jac += e[i].jac[ch * 9 + 3 + ch];
            jac_se += sqrt(e[i].jac_var[ch * 9 + 3 + ch]);
        }
        double rel = se / mean * sqrt(n_path), rel_jac = jac_se / fabs(jac) * sqrt(n_path);
        sd += rel / N_CONFIGURATION;
        s_mean += rel * rel / 1e-4 * per_path / N_CONFIGURATION;
        s_derivative += rel_jac * rel_jac / 25e-4 * per_path / N_CONFIGURATION;
        bounce += (double)e[i].n_bounce / n_path / N_CONFIGURATION;
    }
    print(set, "paths_per_s_core", 1 / per_path, "1/s", "higher");
    print(set, "s_to_1pct_mean", s_mean, "s", "lower");
    print(set, "s_to_5pct_derivative", s_derivative, "s", "lower");
    print(set, "relative_sd_per_path", sd, "", "lower");
    print(set, "bounces_per_path", bounce, "", "lower");
}

static void bench_set(const struct bench *b, const char *set, const double param[9])
{
    static const struct {
        const char *name;
        size_t first;
        bool colour;
    } other[] = {{"C_R.s_to_5pct_derivative", 0, true},
                 {"beta_R.s_to_5pct_derivative", 6, false},
                 {"beta_TT.s_to_5pct_derivative", 7, false},
                 {"gamma_TT.s_to_5pct_derivative", 8, false}};
    static const char *const width[3] = {"beta_R.s_to_1pct_of_mean", "beta_TT.s_to_1pct_of_mean",
                                         "gamma_TT.s_to_1pct_of_mean"};
    static struct estimate e[N_CONFIGURATION];
    trace(b, param, 256, 1, false, false, e); /* warm up */
    double alone_s = trace(b, param, b->n_path, 0, false, false, e),
           per_path = alone_s / (N_CONFIGURATION * (double)e[0].n_path);
    print_times(set, e, per_path);
    for (size_t p = 0; p < sizeof other / sizeof other[0]; p++)
        print(set, other[p].name, s_to_derivative(e, other[p].first, other[p].colour, per_path), "s", "lower");
    for (size_t p = 0; p < 3; p++)
        print(set, width[p], s_to_log_derivative(e, 6 + p, param[6 + p], per_path), "s", "lower");
    print(set, "shared_camera_speedup", alone_s / trace(b, param, b->n_path, 0, true, false, e), "", "higher");
}

/* Traces the paths of one iteration of the published method. */
static void bench_published(const struct bench *b, const char *set, const double param[9])
{
    static struct estimate e[N_CONFIGURATION];
    double s = 0;
    for (uint32_t replica = 0; replica < 2; replica++) s += trace(b, param, 64 * 64 * 64, replica, false, true, e);
    print("published_iteration_s", set, s, "s", "lower");
}

static void make_bench(struct bench *b)
{
    struct fiber_set f;
    struct error err = {0};
    hand_weave_bench(&f);
    orbit_configurations_16(b->configuration);
    status s = scene_new(&f, &(struct scene_option){.black_sheet = true}, &b->scene, &err);
    if (s == STATUS_OK) s = thread_pool_new(1, &b->pool, &err);
    fiber_set_release(&f);
    if (s == STATUS_OK) return;
    fprintf(stderr, "%s\n", err.text);
    exit(1);
}

int main(int argc, char **argv)
{
    struct bench b = {.n_path = argc > 1 ? strtoul(argv[1], NULL, 10) : 16384};
    const char *only = argc > 2 ? argv[2] : NULL;
    if ((only == NULL || strcmp(only, "fleece") == 0) && bench_fleece() != 0)
        return 1; /* first, while little memory is in use */
    make_bench(&b);
    const struct scattering_model *m = scattering_find("two_lobe.v1");
    for (size_t k = 0; k < sizeof fabric / sizeof fabric[0]; k++) {
        const char *set = fabric[k].name;
        double param[9];
        for (int p = 0; p < 9; p++) param[p] = param_from_file_unit(&m->param[p], fabric[k].param[p]);
        if (only == NULL || strcmp(only, set) == 0) bench_set(&b, set, param);
        if (strcmp(set, "gabardine") == 0 && (only == NULL || strcmp(only, "published") == 0))
            bench_published(&b, set, param);
    }
    thread_pool_free(b.pool);
    scene_free(b.scene);
    return 0;
}
