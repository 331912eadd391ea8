/* What every surface model of the catalogue costs, and what light it loses. Prints one JSON object on each line.
 *
 *   models.<id>.paths_per_s_core
 *       Paths with all derivatives on the cloth of the benchmarks, under the 16 configurations. All models take turns,
 *       and the median of the rounds counts.
 *   models.<id>.time_over_two_lobe
 *       Median over the rounds of its time for a path over that of two_lobe.v1 in the same round, in which the machine
 *       was equally busy.
 *   models.<id>.furnace_in_error, .furnace_out_error
 *       Largest part of the light that a fiber loses or gains, over 0, 20, 40, 60 and 80 degrees: light that comes from
 *       one direction and leaves to all (in), and comes from all and leaves to one (out; by the widths of sections
 *       whose width the model states). Colors at their upper bounds, everything else at its start.
 *   models.<id>.table_bytes, .table_build_s
 *       Memory of a prepared model, and processor time to prepare it.
 *
 * bench_models [PATHS [ROUNDS [ID ...]]]
 *   PATHS   for each configuration (4096)
 *   ROUNDS  (5)
 *   ID      models; all without
 */
#include "base/angle.h"
#include "base/clock.h"
#include "renderer/estimate/estimate.h"
#include "tests/support/cloth/hand_weave.h"
#include "tests/support/model/model_furnace.h"
#include "tests/support/tracer/orbit_configurations.h"
#include "tests/support/tracer/trace_input.h"

#include <malloc.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { N_CONFIGURATION = 16, MAX_MODEL = 64, MAX_ROUND = 64 };

static void print(const struct scattering_model *m, const char *what, double value, const char *unit,
                  const char *better)
{
    printf("{\"name\":\"models.%s.%s\",\"value\":%.6g,\"unit\":\"%s\",\"better\":\"%s\"}\n", m->id, what, value, unit,
           better);
    fflush(stdout);
}

static void stop(const struct error *err)
{
    fprintf(stderr, "%s\n", err->text);
    exit(1);
}

static void start_of(const struct scattering_model *m, bool brightest, double *param)
{
    for (size_t p = 0; p < m->n_param; p++)
        param[p] = brightest && m->param[p].channel >= 0 ? m->param[p].upper : m->param[p].start;
}

static struct scattering_state *prepare(const struct scattering_model *m, const double *param)
{
    struct scattering_state *s = NULL;
    struct error err = {0};
    if (m->prepare(param, &s, &err) != STATUS_OK) stop(&err);
    return s;
}

/* Integral of S cos th over all directions of one side. The mean over the azimuth of the other direction, where a model
 * distinguishes azimuths about the fiber. */
static double furnace(const struct scattering_model *m, const struct scattering_state *s, double theta, bool in)
{
    enum { N_TURN = 8 };
    struct model_furnace q = {.n_theta = 720, .n_phi = 240, .n_view = 32}; /* fringes of dielectric_diffraction.v1 */
    int n_turn = m->flat_section ? N_TURN : 1;
    double sum = 0;
    for (int turn = 0; turn < n_turn; turn++) {
        double rgb[3];
        q.azimuth_rad = M_PI * (turn + 0.5) / N_TURN;
        model_furnace(m, s, &q, theta, in, rgb);
        sum += rgb[0];
    }
    return sum / n_turn;
}

static double allocated_bytes(void)
{
    struct mallinfo2 now = mallinfo2();
    return (double)(now.uordblks + now.hblkhd);
}

static void bench_light(const struct scattering_model *m)
{
    double param[SCATTERING_MAX_PARAM], worst[2] = {0, 0};
    start_of(m, true, param);
    double before = allocated_bytes();
    struct scattering_state *s = prepare(m, param);
    print(m, "table_bytes", allocated_bytes() - before, "byte", "lower");
    for (int side = 0; side < 2; side++)
        for (int k = 0; k < 5; k++)
            worst[side] = fmax(worst[side], fabs(1 - furnace(m, s, 20 * k * RAD_PER_DEG, side == 0)));
    print(m, "furnace_in_error", worst[0], "1", "lower");
    print(m, "furnace_out_error", worst[1], "1", "lower");
    m->release(s);
}

static void bench_tables(const struct scattering_model *m)
{
    enum { N = 5 };
    double param[SCATTERING_MAX_PARAM];
    start_of(m, false, param);
    double start = clock_process_s();
    for (int i = 0; i < N; i++) m->release(prepare(m, param));
    print(m, "table_build_s", (clock_process_s() - start) / N, "s", "lower");
}

/* Processor time for a path. */
static double trace(const struct scene *scene, struct thread_pool *pool, const struct scattering_model *m,
                    size_t n_path)
{
    static struct estimate e[N_CONFIGURATION];
    struct configuration configuration[N_CONFIGURATION];
    double param[SCATTERING_MAX_PARAM];
    size_t n[N_CONFIGURATION];
    struct appearance model;
    struct error err = {0};
    orbit_configurations_16(configuration);
    start_of(m, false, param);
    for (int i = 0; i < N_CONFIGURATION; i++) n[i] = n_path;
    struct estimate_request q = {.input = trace_input_surface(scene, m, param, &model),
                                 .configuration = configuration,
                                 .n_configuration = N_CONFIGURATION,
                                 .n_path = n,
                                 .seed = 1};
    q.input.want_derivative = true;
    double start = clock_process_s();
    if (estimate_run(&q, pool, NULL, e, &err) != STATUS_OK) stop(&err);
    return (clock_process_s() - start) / (double)(N_CONFIGURATION * n_path);
}

static int by_size(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static double median(double *x, size_t n)
{
    qsort(x, n, sizeof *x, by_size);
    return 0.5 * (x[(n - 1) / 2] + x[n / 2]);
}

static void bench_speed(const struct scattering_model **model, size_t n_path, size_t n_round)
{
    static double time_s[MAX_MODEL][MAX_ROUND], ratio[MAX_MODEL][MAX_ROUND];
    struct fiber_set f;
    struct scene *scene = NULL;
    struct thread_pool *pool = NULL;
    struct error err = {0};
    hand_weave_bench(&f);
    if (scene_new(&f, &(struct scene_option){.black_sheet = true}, &scene, &err) != STATUS_OK) stop(&err);
    if (thread_pool_new(1, &pool, &err) != STATUS_OK) stop(&err);
    fiber_set_release(&f);
    trace(scene, pool, scattering_find("two_lobe.v1"), 256); /* warm up */
    for (size_t round = 0; round < n_round; round++) {
        const double reference_s = trace(scene, pool, scattering_find("two_lobe.v1"), n_path);
        for (size_t k = 0; model[k] != NULL; k++) {
            time_s[k][round] = trace(scene, pool, model[k], n_path);
            ratio[k][round] = time_s[k][round] / reference_s;
        }
    }
    for (size_t k = 0; model[k] != NULL; k++) {
        print(model[k], "paths_per_s_core", 1 / median(time_s[k], n_round), "1/s", "higher");
        print(model[k], "time_over_two_lobe", median(ratio[k], n_round), "1", "lower");
    }
    thread_pool_free(pool);
    scene_free(scene);
}

/* Whether the arguments from `first` on name the model, or are none. */
static bool is_wanted(const struct scattering_model *m, int argc, char **argv, int first)
{
    for (int i = first; i < argc; i++)
        if (strcmp(argv[i], m->id) == 0) return true;
    return argc <= first;
}

int main(int argc, char **argv)
{
    static const struct scattering_model *model[MAX_MODEL + 1];
    size_t n_model = 0;
    size_t n_path = argc > 1 ? strtoul(argv[1], NULL, 10) : 4096, n_round = argc > 2 ? strtoul(argv[2], NULL, 10) : 5;
    if (n_path == 0 || n_round == 0 || n_round > MAX_ROUND) {
        fprintf(stderr, "usage: bench_models [PATHS [ROUNDS [ID ...]]], at most %d rounds\n", MAX_ROUND);
        return 2;
    }
    for (int i = 3; i < argc; i++)
        if (scattering_find(argv[i]) == NULL) {
            fprintf(stderr, "model '%s' is unknown\n", argv[i]);
            return 2;
        }
    for (size_t k = 0; scattering_registry()[k] != NULL && n_model < MAX_MODEL; k++)
        if (is_wanted(scattering_registry()[k], argc, argv, 3)) model[n_model++] = scattering_registry()[k];
    for (size_t k = 0; k < n_model; k++) {
        bench_light(model[k]);
        bench_tables(model[k]);
    }
    bench_speed(model, n_path, n_round);
    return 0;
}
