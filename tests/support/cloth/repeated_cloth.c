#include "tests/support/cloth/repeated_cloth.h"

#include "base/rng.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>

#include <cmocka.h>

void repeated_cloth(enum phantom_weave weave, double diameter_voxel, const double n_repeat[2], struct fiber_set *f,
                    struct volume *v, size_t n_tile[3])
{
    struct phantom_option o;
    struct phantom_scan_option scan;
    struct phantom_report report;
    struct volume tile;
    struct error err = {0};
    phantom_option_default(&o, weave);
    phantom_scan_option_default(&scan);
    scan.voxel_size_m = o.voxel_size_m;
    scan.snr = 0.0;
    for (int a = 0; a < 3; a++) o.fiber_radius_m[a] = 0.5 * diameter_voxel * o.voxel_size_m;
    fiber_set_init(f);
    assert_int_equal(phantom_generate(&o, NULL, NULL, f, &report, &err), STATUS_OK);
    assert_int_equal(phantom_scan(f, report.n_voxel, &scan, NULL, NULL, &tile, &err), STATUS_OK);
    for (int a = 0; a < 3; a++) n_tile[a] = tile.n[a];
    const size_t n[3] = {(size_t)llround(n_repeat[0] * (double)tile.n[0]),
                         (size_t)llround(n_repeat[1] * (double)tile.n[1]), tile.n[2]};
    assert_int_equal(volume_init(v, n, tile.voxel_size_m, &err), STATUS_OK);
    const struct rng_key key = {.seed = 11};
    for (size_t k = 0; k < n[2]; k++)
        for (size_t j = 0; j < n[1]; j++) {
            struct rng r;
            double noise[2];
            rng_start(&r, &key, (uint32_t)k, (uint32_t)j);
            for (size_t i = 0; i < n[0]; i++) {
                rng_normal_pair(&r, noise);
                v->density[volume_index(n, i, j, k)] =
                    tile.density[volume_index(tile.n, i % tile.n[0], j % tile.n[1], k)] + (float)(0.2 * noise[0]);
            }
        }
    volume_release(&tile);
}
