/* Previews of cloths with a pile against path tracing: dual scattering, and diffusion with different numbers of traced
 * hits, in its own form (diffusion) and without the factor on pairs of directions (product). Prints one JSON object on
 * each line, and details to standard error.
 *
 *   pictures.pile.<cloth>.<method>.rel_rms
 *       Root mean square of the differences between the mean radiances of 27 configurations (three elevations of the
 *       lamp, three azimuths, three of the camera) and 3 channels, over the mean of path tracing. What the noise of
 *       both adds is taken off.
 *   pictures.pile.<cloth>.<method>.rel_mean
 *       Difference of the means over all of them, over that of path tracing.
 *
 * bench_pile [--paths N] [CLOTH...]
 *   CLOTH   dark, medium, bright (the fibers of a velvet whose pile is 0.5 mm high), tall (medium, 1.5 mm)
 */
#include "base/angle.h"
#include "base/clock.h"
#include "geometry/phantom/phantom.h"
#include "renderer/estimate/estimate.h"
#include "renderer/quick/diffusion_tables.h"
#include "renderer/quick/dual_tables.h"
#include "tests/support/tracer/trace_input.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { N_VIEW = 27 };

/* C_R, C_TT, beta_R, beta_TT, gamma_TT of two_lobe.v1 in file units: Velvet and Fleece of Table 5.3 of the fabric
 * thesis, and fibers that lose hardly any light. */
static const struct pile_cloth {
    const char *name;
    double pile_m, param[9];
} cloths[] = {
    {"dark", 5e-4, {0.044, 0.040, 0.040, 0.076, 0.058, 0.057, 1.577, 24.933, 44.881}},
    {"medium", 5e-4, {0.040, 0.087, 0.087, 0.452, 0.725, 0.948, 7.238, 10.0, 25.989}},
    {"bright", 5e-4, {0.10, 0.10, 0.10, 0.89, 0.85, 0.80, 8.0, 20.0, 40.0}},
    {"tall", 1.5e-3, {0.040, 0.087, 0.087, 0.452, 0.725, 0.948, 7.238, 10.0, 25.989}},
};

static struct thread_pool *pool;
static size_t n_path = 4096;

static void check(status s, const struct error *err)
{
    if (s == STATUS_OK) return;
    fprintf(stderr, "%s\n", err->text);
    exit(1);
}

static void view_of(size_t i, struct configuration *c)
{
    static const double light[3] = {15, 45, 75}, around[3] = {0, 90, 180}, camera[3] = {5, 40, 70};
    *c = (struct configuration){.light_theta_rad = light[i % 3] * RAD_PER_DEG,
                                .light_phi_rad = around[i / 3 % 3] * RAD_PER_DEG,
                                .camera_theta_rad = camera[i / 9] * RAD_PER_DEG,
                                .camera_phi_rad = 200 * RAD_PER_DEG,
                                .cloth_rotation_rad = 20 * RAD_PER_DEG,
                                .light_distance_m = 0.61,
                                .lamp_side_m = 0.1,
                                .camera_distance_m = 1.0,
                                .crop_m = 0.01};
}

/* Means of all configurations; the processor seconds. */
static double means_of(const struct radiance_input *input, uint64_t seed, struct estimate e[N_VIEW])
{
    struct error err = {0};
    double start = clock_process_s();
    for (size_t i = 0; i < N_VIEW; i++) {
        struct configuration c;
        view_of(i, &c);
        const struct estimate_request q = {
            .input = *input, .configuration = &c, .n_configuration = 1, .n_path = &n_path, .seed = seed + i};
        check(estimate_run(&q, pool, NULL, e + i, &err), &err);
    }
    return clock_process_s() - start;
}

static void compare(const char *cloth, const char *method, const struct estimate *path, const struct estimate *other,
                    double path_s, double other_s)
{
    double error2 = 0.0, noise2[2] = {0.0, 0.0}, mean = 0.0, difference = 0.0, n = 3.0 * N_VIEW;
    for (size_t i = 0; i < N_VIEW; i++)
        for (int c = 0; c < 3; c++) {
            double d = other[i].mean[c] - path[i].mean[c];
            error2 += d * d / n;
            noise2[0] += path[i].var[c] / n;
            noise2[1] += other[i].var[c] / n;
            mean += path[i].mean[c] / n;
            difference += d / n;
        }
    printf("{\"name\":\"pictures.pile.%s.%s.rel_rms\",\"value\":%.4g,\"unit\":\"\",\"better\":\"lower\"}\n", cloth,
           method, sqrt(fmax(0.0, error2 - noise2[0] - noise2[1])) / mean);
    printf("{\"name\":\"pictures.pile.%s.%s.rel_mean\",\"value\":%.4g,\"unit\":\"\",\"better\":\"zero\"}\n", cloth,
           method, difference / mean);
    fprintf(stderr,
            "%s, %s: mean %.4f; noise %.2f %% in %.1f s, of path tracing %.2f %% in %.1f s: %.2f times faster\n", cloth,
            method, mean, 100.0 * sqrt(noise2[1]) / mean, other_s, 100.0 * sqrt(noise2[0]) / mean, path_s,
            path_s * noise2[0] / (other_s * noise2[1]));
    fflush(stdout);
}

static void bench_diffusion(const struct pile_cloth *k, const struct radiance_input *input,
                            const struct scattering_model *model, const struct estimate *path, double path_s)
{
    static struct estimate other[N_VIEW];
    struct error err = {0};
    for (uint32_t i = 2; i < 10; i++) {
        uint32_t n_traced = i / 2;
        bool product = i % 2 == 0;
        static struct diffusion_tables t;
        const struct diffusion_request q = {.scene = input->scene.fibers,
                                            .model = model,
                                            .param = input->param,
                                            .n_traced = n_traced,
                                            .product = product};
        const struct diffusion_option option = {&t};
        struct radiance_input in = *input;
        char method[32];
        double start = clock_process_s();
        check(diffusion_tables_make(&q, pool, NULL, &t, &err), &err);
        fprintf(stderr, "%s: tables of %u hits in %.2f s; share %.4f +- %.4f, %.4f, %.4f; distance %.3f mm\n", k->name,
                n_traced, clock_process_s() - start, t.share[0][0], t.share_se[0][0], t.share[0][1], t.share[0][2],
                sqrt(t.mean_square_mm2[0][1]));
        in.diffusion = &option;
        snprintf(method, sizeof method, "%s%u", product ? "product" : "diffusion", n_traced);
        double other_s = means_of(&in, 500, other);
        compare(k->name, method, path, other, path_s, other_s);
    }
}

static void bench(const struct pile_cloth *k)
{
    static struct estimate path[N_VIEW], other[N_VIEW];
    struct phantom_option o;
    struct phantom_report report;
    struct error err = {0};
    struct fiber_set f;
    struct scene *scene;
    struct appearance appearance;
    struct dual_tables averages;
    double param[SCATTERING_MAX_PARAM];
    const struct scattering_model *model = scattering_find("two_lobe.v1");
    for (size_t p = 0; p < model->n_param; p++) param[p] = param_from_file_unit(&model->param[p], k->param[p]);
    phantom_option_default(&o, PHANTOM_VELVET);
    o.pile_height_m = k->pile_m;
    fiber_set_init(&f);
    check(phantom_generate(&o, pool, NULL, &f, &report, &err), &err);
    check(scene_new(&f, &(struct scene_option){.black_sheet = true}, &scene, &err), &err);
    struct radiance_input input = trace_input_surface(scene, model, param, &appearance);
    double path_s = means_of(&input, 100, path);
    check(dual_tables_init(&averages, scene, model, param, 1, pool, NULL, &err), &err);
    const struct dual_option dual = {&averages, 1, 1};
    struct radiance_input by_dual = input;
    by_dual.dual = &dual;
    double dual_s = means_of(&by_dual, 300, other);
    compare(k->name, "dual", path, other, path_s, dual_s);
    bench_diffusion(k, &input, model, path, path_s);
    dual_tables_release(&averages);
    scene_free(scene);
    fiber_set_release(&f);
}

int main(int argc, char **argv)
{
    struct error err = {0};
    bool wanted[4] = {false}, any = false;
    for (int i = 1; i < argc; i++) {
        bool known = false;
        if (i + 1 < argc && strcmp(argv[i], "--paths") == 0) {
            n_path = (size_t)strtoul(argv[++i], NULL, 10);
            continue;
        }
        for (size_t k = 0; k < 4; k++)
            if (strcmp(argv[i], cloths[k].name) == 0) wanted[k] = any = known = true;
        if (known) continue;
        fprintf(stderr, "bench_pile: unknown argument '%s'\n", argv[i]);
        return 2;
    }
    check(thread_pool_new(0, &pool, &err), &err);
    for (size_t k = 0; k < 4; k++)
        if (wanted[k] || !any) bench(&cloths[k]);
    thread_pool_free(pool);
    return 0;
}
