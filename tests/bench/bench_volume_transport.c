/* Paths per second and core through a volume, with all derivatives (12 parameters and d). Prints one JSON object on
 * each line.
 *
 *   transport.volume.mfp{67,25,6}um.paths_per_s_core   500^3 voxels of 2 um, 28 % of them occupied, mean over 16
 *                                                      configurations; mean free path at the mean occupied density
 *   transport.volume.{mfp...}.bounces_per_path, s_to_1pct_mean
 *   transport.volume.memory_over_stored                bytes of the scene over the stored bytes of its volume
 *
 * Arguments: paths for each configuration (4096), voxels along an edge (500).
 */
#include "base/clock.h"
#include "renderer/estimate/estimate.h"
#include "renderer/transport/volume/volume_scene.h"
#include "tests/support/scan/hand_volume.h"
#include "tests/support/tracer/orbit_configurations.h"
#include "tests/support/tracer/trace_input.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

static void print(const char *set, const char *what, double value, const char *unit, const char *better)
{
    printf("{\"name\":\"transport.volume.%s%s\",\"value\":%.6g,\"unit\":\"%s\",\"better\":\"%s\"}\n", set, what, value,
           unit, better);
    fflush(stdout);
}

/* Measures one mean free path. multiplier_per_m: of the densities. */
static void measure(const char *set, const struct volume_scene *scene, double multiplier_per_m, size_t n_path,
                    struct thread_pool *pool)
{
    const struct phase_model *m = phase_find("phase_two_lobe.v1");
    struct configuration c[16];
    struct estimate e[16];
    struct error err = {0};
    size_t n[16], warm[16];
    double param[SCATTERING_MAX_PARAM];
    orbit_configurations_16(c);
    for (int i = 0; i < 16; i++) {
        n[i] = n_path;
        warm[i] = 256;
    }
    for (size_t p = 0; p < m->n_param; p++) param[p] = m->param[p].start;
    struct trace_volume volume_model;
    struct estimate_request q = {.input = trace_input_volume(scene, m, param, multiplier_per_m, &volume_model),
                                 .configuration = c,
                                 .n_configuration = 16,
                                 .n_path = warm,
                                 .seed = 1};
    q.input.want_derivative = true;
    double t0 = 0;
    for (int pass = 0; pass < 2; pass++) {
        t0 = clock_process_s();
        if (estimate_run(&q, pool, NULL, e, &err) != STATUS_OK) {
            fprintf(stderr, "%s\n", err.text);
            exit(1);
        }
        q.n_path = n;
    }
    double per_path = (clock_process_s() - t0) / (16.0 * (double)n_path), s_mean = 0, bounce = 0;
    for (int i = 0; i < 16; i++) {
        double mean = 0, se = 0;
        for (int ch = 0; ch < 3; ch++) { /* channels are correlated, so their standard errors are added */
            mean += e[i].mean[ch];
            se += sqrt(e[i].var[ch]);
        }
        s_mean += se * se / (mean * mean) * (double)n_path / 1e-4 * per_path / 16;
        bounce += (double)e[i].n_bounce / (double)e[i].n_path / 16;
    }
    print(set, ".paths_per_s_core", 1 / per_path, "1/s", "higher");
    print(set, ".s_to_1pct_mean", s_mean, "s", "lower");
    print(set, ".bounces_per_path", bounce, "", "lower");
}

int main(int argc, char **argv)
{
    size_t n_path = argc > 1 ? strtoul(argv[1], NULL, 10) : 4096, edge = argc > 2 ? strtoul(argv[2], NULL, 10) : 500;
    const double voxel_m = 2e-6, mean_free_path_um[3] = {67, 25, 6};
    const size_t n_voxel[3] = {edge, edge, edge};
    struct direction_volume v;
    struct volume_scene scene;
    struct thread_pool *pool = NULL;
    struct error err = {0};
    size_t occupied = 0;
    double density = 0;
    hand_volume_weave(&v, n_voxel, voxel_m, 0.28);
    for (size_t i = 0; i < volume_n_voxel(n_voxel); i++) {
        occupied += v.density[i] > 0;
        density += v.density[i];
    }
    density /= 255.0 * (double)occupied;
    if (volume_scene_init(&scene, &v, &(struct volume_scene_option){true}, &err) != STATUS_OK ||
        thread_pool_new(1, &pool, &err) != STATUS_OK) {
        fprintf(stderr, "%s\n", err.text);
        return 1;
    }
    direction_volume_release(&v); /* the scene has its own copy */
    print("occupied", "", (double)occupied / (double)volume_n_voxel(n_voxel), "", "higher");
    print("memory_over_stored", "", (double)volume_scene_memory_bytes(&scene) / (5.0 * (double)volume_n_voxel(n_voxel)),
          "", "lower");
    for (int k = 0; k < 3; k++) {
        char set[32];
        snprintf(set, sizeof set, "mfp%.0fum", mean_free_path_um[k]);
        /* directions are uniform, so the mean sine of the angle to the fiber is pi / 4 */
        measure(set, &scene, 1 / (1e-6 * mean_free_path_um[k] * density * M_PI_4), n_path, pool);
    }
    thread_pool_free(pool);
    volume_scene_release(&scene);
    return 0;
}
