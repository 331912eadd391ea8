/* Paths per second and core, and time to a given standard error, on the bench cloth. One JSON object a line.
 *   transport.<set>.paths_per_s_core      with all derivatives
 *   transport.<set>.s_to_1pct_mean        seconds a configuration on one core, mean over the 16 configurations
 *   transport.<set>.s_to_5pct_derivative  the same for the derivative by C_TT (mean of the channels)
 *   transport.published_iteration_s.gabardine   16 configurations x 2 replicas x 64 x 64 x 64 paths
 */
#include "renderer/transport/estimate.h"
#include "tests/support/hand_weave.h"
#include "tests/support/orbit_configurations.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

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

int main(int argc, char **argv)
{
    size_t n_path = argc > 1 ? strtoul(argv[1], NULL, 10) : 16384;
    const char *only = argc > 2 ? argv[2] : NULL;
    struct fiber_set f;
    struct scene *scene = NULL;
    struct thread_pool *pool = NULL;
    struct error err = {0};
    struct configuration c[16];
    struct estimate e[16];
    size_t n[16], warm[16];
    hand_weave_bench(&f);
    orbit_configurations_16(c);
    if (scene_new(&f, &(struct scene_option){true}, &scene, &err) != STATUS_OK ||
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
        struct estimate_request q = {scene, m, param, c, 16, warm, 1, 0, 0, true};
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
            for (int ch = 0; ch < 3; ch++) { /* channels are correlated: add standard errors */
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
