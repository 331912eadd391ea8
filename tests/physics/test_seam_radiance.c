/* A tile that is cut out of a larger cloth, and repeated, has the mean radiance of that cloth, also after the ends
 * of its fibers are joined across the seams. */
#include "base/angle.h"
#include "geometry/fibers/seam/fiber_seam.h"
#include "geometry/phantom/phantom.h"
#include "renderer/estimate/estimate.h"
#include "tests/support/cloth/cut_tile.h"
#include "tests/support/tracer/orbit_configurations.h"
#include "tests/support/tracer/trace_input.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>

#include <cmocka.h>

enum { N_CONFIGURATION = 16, N_CLOTH = 3 };
static const double param[9] = {0.2, 0.1, 0.3, 0.8, 0.6, 0.4, 4 * RAD_PER_DEG, 14 * RAD_PER_DEG, 20 * RAD_PER_DEG};
static struct scene *scene[N_CLOTH]; /* the large cloth, the cut tile, the joined tile */

static int set_up(void **state)
{
    (void)state;
    struct phantom_option o;
    struct phantom_report report;
    struct seam_join join;
    struct fiber_seam found, joined;
    struct fiber_set f, tile;
    fiber_set_init(&f);
    fiber_set_init(&tile);
    phantom_option_default(&o, PHANTOM_TWILL_2_2);
    o.n_yarn[0] = o.n_yarn[1] = 8;
    o.n_fiber_per_yarn = 7;
    o.migration = 0.2;
    status st = phantom_generate(&o, NULL, NULL, &f, &report, NULL);
    if (st == STATUS_OK) st = scene_new(&f, &(struct scene_option){.black_sheet = true}, &scene[0], NULL);
    if (st != STATUS_OK) return 1;
    cut_tile(&f, (const double[2]){0.5 * f.tile_size_m[0], 0.5 * f.tile_size_m[1]}, 0.02, &tile);
    st = scene_new(&tile, &(struct scene_option){.black_sheet = true}, &scene[1], NULL);
    if (st == STATUS_OK) st = fiber_seam_measure(&tile, &found, NULL);
    if (st == STATUS_OK) st = fiber_seam_join(&tile, &join, NULL);
    if (st == STATUS_OK) st = fiber_seam_measure(&tile, &joined, NULL);
    if (st == STATUS_OK) st = scene_new(&tile, &(struct scene_option){.black_sheet = true}, &scene[2], NULL);
    for (int a = 0; a < 2 && st == STATUS_OK; a++)
        print_message("%c: %zu ends, warp %.2f um, shift %.2f um; continue %.2f -> %.2f, angle %.1f -> %.1f degrees, "
                      "step %.2f -> %.2f (%.2f within)\n",
                      "xy"[a], found.n_end[a], join.warp_m[a] * 1e6, join.shift_m[a] * 1e6, found.share[a],
                      joined.share[a], found.angle_rad[a] / RAD_PER_DEG, joined.angle_rad[a] / RAD_PER_DEG,
                      found.step[a], joined.step[a], joined.step_inside[a]);
    fiber_set_release(&tile);
    fiber_set_release(&f);
    return st != STATUS_OK || !(joined.share[0] > 0.9 && joined.share[1] > 0.9);
}

static int tear_down(void **state)
{
    (void)state;
    for (int i = 0; i < N_CLOTH; i++) scene_free(scene[i]);
    return 0;
}

static struct estimate run(const struct scene *s, const struct configuration *c)
{
    struct estimate e;
    struct error err = {0};
    struct appearance model;
    const size_t n_path = 32768;
    struct estimate_request q = {.input = trace_input_surface(s, scattering_find("two_lobe.v1"), param, &model),
                                 .configuration = c,
                                 .n_configuration = 1,
                                 .n_path = &n_path,
                                 .seed = 31};
    if (estimate_run(&q, NULL, NULL, &e, &err) != STATUS_OK) fail_msg("%s", err.text);
    return e;
}

/* Radiances are means over places of an endless cloth. The quarter of the cloth that the tile holds differs from
 * the whole by some per cent in single directions, so those are compared with each other loosely (10 %), and their mean
 * closely: with a standard error of 0.3 % of each cloth an error of 2.2 % is beyond what noise and 1 % explain. */
static void tiles_keep_the_mean(void **state)
{
    (void)state;
    struct configuration configuration[N_CONFIGURATION];
    double mean[N_CLOTH] = {0.0}, variance[N_CLOTH] = {0.0};
    orbit_configurations_16(configuration);
    for (int i = 0; i < N_CONFIGURATION; i++) {
        struct estimate e[N_CLOTH];
        for (int k = 0; k < N_CLOTH; k++) {
            e[k] = run(scene[k], &configuration[i]);
            mean[k] += e[k].mean[1];
            variance[k] += e[k].var[1];
        }
        const double error = sqrt(e[1].var[1] + e[2].var[1]);
        if (!(fabs(e[2].mean[1] - e[1].mean[1]) < 4.0 * error + 0.04 * e[1].mean[1]))
            fail_msg("configuration %d: %g +- %g joined, %g cut, %g of the whole cloth", i, e[2].mean[1], error,
                     e[1].mean[1], e[0].mean[1]);
    }
    print_message("mean of %d directions: whole cloth %.5f, cut tile %.5f, joined tile %.5f, standard error %.5f\n",
                  N_CONFIGURATION, mean[0] / N_CONFIGURATION, mean[1] / N_CONFIGURATION, mean[2] / N_CONFIGURATION,
                  sqrt(variance[0]) / N_CONFIGURATION);
    for (int k = 0; k < 2; k++)
        assert_true(fabs(mean[2] - mean[k]) < 3.0 * sqrt(variance[2] + variance[k]) + 0.01 * mean[k]);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(tiles_keep_the_mean)};
    return cmocka_run_group_tests(tests, set_up, tear_down);
}
