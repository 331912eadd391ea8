/* Paths per second and core, and time to a given standard error, on the bench cloth. One JSON object a line.
 *   transport.<set>.paths_per_s_core      with all derivatives
 *   transport.<set>.s_to_1pct_mean        seconds a configuration on one core, mean over the 16 configurations
 *   transport.<set>.s_to_5pct_derivative  the same for the derivative by C_TT (mean of the channels)
 *   transport.<set>.<parameter>.s_to_5pct_derivative   the same for each of C_R, beta_R, beta_TT, gamma_TT. The median
 *       over the 16 configurations: some derivatives pass through 0, where a relative error means nothing
 *   transport.<set>.<width>.s_to_1pct_of_mean   seconds a configuration on one core until the standard error of
 *       d R / d ln(width) is 1 % of R, mean over the configurations: says something where the derivative is nearly 0, too
 *   transport.<set>.shared_camera_speedup   time of the 16 configurations over the time when those that differ in their
 *       lamp only (two and two) share their paths
 *   transport.fleece.peak_bytes   largest resident memory of a process that makes the fibers (as many as the Fleece
 *       cloth has: 31,091 with 580,660 segments) into a scene and traces 16 x 256 paths with derivatives
 *   transport.published_iteration_s.gabardine   16 configurations x 2 replicas x 64 x 64 x 64 paths
 */
#include "base/rng.h"
#include "renderer/transport/estimate.h"
#include "tests/support/hand_weave.h"
#include "tests/support/orbit_configurations.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

static const struct {
    const char *name;
    double param[9]; /* file units; fabric thesis, Tables 5.1 and 5.3 */
} fabric[] = {
    {"defaults", {0.1, 0.1, 0.1, 0.85, 0.85, 0.85, 5, 10, 10}},
    {"gabardine", {0.185, 0.047, 0.069, 0.999, 0.330, 0.354, 2.141, 10, 23.548}},
    {"silk", {0.745, 0.008, 0.070, 0.620, 0.553, 0.562, 1, 10, 19.823}},
    {"cotton", {0.989, 0.959, 0.874, 0.999, 0.999, 0.999, 1, 27.197, 38.269}},
};

/* One thread does all the work: its processor time, so that a busy machine counts less. */
static double processor_s(void)
{
    struct timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

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

/* Seconds on one core to a relative standard error of 5 %, median over the configurations; colours: mean of channels. */
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

/* Seconds on one core until the standard error of d R / d ln p is 1 % of R, mean over the configurations. */
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

/* 31,091 fibers of 18 or 19 segments, 580,660 in all, lying in the plane in every direction. */
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
        double phi = 2 * M_PI * rng_double(&r), climb = 0.3 * (rng_double(&r) - 0.5), bend = 0.2 * (rng_double(&r) - 0.5);
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
    struct estimate_request q = {.scene = scene, .model = m, .param = param, .configuration = c, .n_configuration = 16,
                                 .n_path = n, .seed = 1, .want_jacobian = true};
    if (st == STATUS_OK) st = estimate_run(&q, NULL, NULL, e, &err);
    if (st != STATUS_OK) fprintf(stderr, "%s\n", err.text);
    fprintf(stderr, "fleece: %zu segments, %zu fibers\n", scene_n_segment(scene), f.n_fiber);
    scene_free(scene);
    fiber_set_release(&f);
    return st == STATUS_OK ? 0 : 1;
}

/* In a process of its own, so that nothing else counts. */
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

int main(int argc, char **argv)
{
    if ((argc < 3 || strcmp(argv[2], "fleece") == 0) && bench_fleece() != 0) return 1; /* first: little is in memory */
    size_t n_path = argc > 1 ? strtoul(argv[1], NULL, 10) : 16384;
    const char *only = argc > 2 ? argv[2] : NULL;
    struct fiber_set f;
    struct scene *scene = NULL;
    struct thread_pool *pool = NULL;
    struct error err = {0};
    struct configuration c[16];
    static struct estimate e[16];
    size_t n[16], warm[16];
    hand_weave_bench(&f);
    orbit_configurations_16(c);
    if (scene_new(&f, &(struct scene_option){.black_sheet = true}, &scene, &err) != STATUS_OK ||
        thread_pool_new(1, &pool, &err) != STATUS_OK) {
        fprintf(stderr, "%s\n", err.text);
        return 1;
    }
    for (int i = 0; i < 16; i++) {
        n[i] = n_path;
        warm[i] = 256;
    }
    for (size_t k = 0; k < sizeof fabric / sizeof fabric[0]; k++) {
        if (only != NULL && strcmp(only, fabric[k].name) != 0) continue;
        const struct scattering_model *m = scattering_find("two_lobe.v1");
        double param[9];
        for (int p = 0; p < 9; p++) param[p] = param_from_file_unit(&m->param[p], fabric[k].param[p]);
        struct estimate_request q = {.scene = scene, .model = m, .param = param, .configuration = c, .n_configuration = 16,
                                     .n_path = warm, .seed = 1, .want_jacobian = true};
        if (estimate_run(&q, pool, NULL, e, &err) != STATUS_OK) {
            fprintf(stderr, "%s\n", err.text);
            return 1;
        }
        q.n_path = n;
        double t0 = processor_s();
        if (estimate_run(&q, pool, NULL, e, &err) != STATUS_OK) {
            fprintf(stderr, "%s\n", err.text);
            return 1;
        }
        double spent = processor_s() - t0, per_path = spent / (16.0 * (double)n_path), s_mean = 0, s_derivative = 0,
               sd = 0, vertex = 0;
        for (int i = 0; i < 16; i++) {
            double mean = 0, var = 0, jac = 0, jac_var = 0;
            for (size_t ch = 0; ch < 3; ch++) { /* channels are correlated: add standard errors */
                mean += e[i].mean[ch];
                var += sqrt(e[i].var[ch]);
                jac += e[i].jac[ch * 9 + 3 + ch];
                jac_var += sqrt(e[i].jac_var[ch * 9 + 3 + ch]);
            }
            double rel = var / mean * sqrt((double)n_path), rel_j = jac_var / fabs(jac) * sqrt((double)n_path);
            sd += rel / 16;
            s_mean += rel * rel / 1e-4 * per_path / 16;
            s_derivative += rel_j * rel_j / 25e-4 * per_path / 16;
            vertex += (double)e[i].n_vertex / (double)e[i].n_path / 16;
        }
        print(fabric[k].name, "paths_per_s_core", 1 / per_path, "1/s", "higher");
        print(fabric[k].name, "s_to_1pct_mean", s_mean, "s", "lower");
        print(fabric[k].name, "s_to_5pct_derivative", s_derivative, "s", "lower");
        static const struct {
            const char *name;
            size_t first;
            bool colour;
        } other[] = {{"C_R.s_to_5pct_derivative", 0, true},
                     {"beta_R.s_to_5pct_derivative", 6, false},
                     {"beta_TT.s_to_5pct_derivative", 7, false},
                     {"gamma_TT.s_to_5pct_derivative", 8, false}};
        for (size_t p = 0; p < sizeof other / sizeof other[0]; p++)
            print(fabric[k].name, other[p].name, s_to_derivative(e, other[p].first, other[p].colour, per_path), "s", "lower");
        static const char *const width[3] = {"beta_R.s_to_1pct_of_mean", "beta_TT.s_to_1pct_of_mean",
                                             "gamma_TT.s_to_1pct_of_mean"};
        for (size_t p = 0; p < 3; p++)
            print(fabric[k].name, width[p], s_to_log_derivative(e, 6 + p, param[6 + p], per_path), "s", "lower");
        q.share_camera_paths = true;
        t0 = processor_s();
        if (estimate_run(&q, pool, NULL, e, &err) != STATUS_OK) {
            fprintf(stderr, "%s\n", err.text);
            return 1;
        }
        print(fabric[k].name, "shared_camera_speedup", spent / (processor_s() - t0), "", "higher");
        print(fabric[k].name, "relative_sd_per_path", sd, "", "lower");
        print(fabric[k].name, "vertices_per_path", vertex, "", "lower");
        if (strcmp(fabric[k].name, "gabardine") == 0)
            print("published_iteration_s.gabardine", "", per_path * 16 * 2 * 64 * 64 * 64, "s", "lower");
    }
    thread_pool_free(pool);
    scene_free(scene);
    fiber_set_release(&f);
    return 0;
}
