/* Densities of voxels by the fibers near them sum to the volume of the fibers, whatever the scan's densities are. */
#include "geometry/reconstruct/line_densities.h"
#include "geometry/reconstruct/line_directions.h"
#include "tests/support/scan/phantom_reconstruction.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>

#include <cmocka.h>

enum { N = 48, N_VERTEX = 40 };
static const size_t n_voxel[3] = {N, N, N};
static const double voxel_m[3] = {2e-6, 2e-6, 2e-6}, radius = 3.3;
static const float direction[3] = {0.8f, 0.48f, 0.36f}, step = 0.9f;

/* A straight fiber in the middle, oblique to all axes. ratio above 1: a flat section, whose long axis is upright. */
static void make_fiber(float ratio, struct fiber_set *f)
{
    static const float long_axis[3] = {-0.6f, 0.64f, 0.48f}; /* perpendicular to `direction`, about */
    fiber_set_init(f);
    assert_int_equal(fiber_set_reserve(f, 1, N_VERTEX, NULL), STATUS_OK);
    f->first_vertex[1] = N_VERTEX;
    f->radius_m[0] = (float)(radius * voxel_m[0]);
    f->tile_size_m[0] = f->tile_size_m[1] = N * voxel_m[0];
    for (size_t i = 0; i < N_VERTEX; i++)
        for (size_t a = 0; a < 3; a++)
            f->position_m[3 * i + a] =
                (float)((24.2 + ((double)i - 19.5) * (double)(step * direction[a])) * voxel_m[0]);
    if (ratio <= 1.0f) return;
    assert_int_equal(fiber_set_add_shapes(f, NULL), STATUS_OK);
    for (size_t i = 0; i < N_VERTEX; i++) {
        f->shape[i].ratio = ratio;
        for (int a = 0; a < 3; a++) f->shape[i].long_axis[a] = long_axis[a];
    }
}

/* Sum of the densities, of a volume whose voxels have the density `before`. */
static double sum_of(const struct fiber_set *f, const struct line_densities *l, uint8_t before, uint8_t *corner)
{
    struct segment_bricks bricks;
    struct direction_volume d;
    double sum = 0.0, told;
    assert_int_equal(direction_volume_init(&d, n_voxel, voxel_m, NULL), STATUS_OK);
    for (size_t at = 0; at < volume_n_voxel(n_voxel); at++) {
        d.density[at] = before;
        direction_volume_set(&d, at, (const float[3]){0.0f, 0.0f, 1.0f});
    }
    const float reach = line_densities_reach(l, f, (float)radius);
    assert_int_equal(segment_bricks_from_fibers(&bricks, f, n_voxel, voxel_m, LINE_DIRECTIONS_BRICK, reach, NULL),
                     STATUS_OK);
    assert_int_equal(line_densities_give(l, &bricks, f, &d, NULL, &told, NULL), STATUS_OK);
    for (size_t at = 0; at < volume_n_voxel(n_voxel); at++) {
        float got[3];
        if (before > 0 && d.density[at] == before) continue;
        sum += d.density[at] / 255.0;
        direction_volume_get(&d, at, got);
        const float cosine = got[0] * direction[0] + got[1] * direction[1] + got[2] * direction[2];
        if (before == 0 && d.density[at] > 0) assert_true(fabsf(cosine) > 0.9999f);
    }
    if (before == 0) assert_true(fabs(told - sum) < 1e-6 * sum);
    *corner = d.density[0];
    segment_bricks_release(&bricks);
    direction_volume_release(&d);
    return sum;
}

static void test_sums_are_volumes(void **state)
{
    (void)state;
    static const float ratio[3] = {1.0f, 1.6f, 2.4f};
    static const double scale[2] = {1.0, 0.95};
    /* round ends belong to the voxels as well: half of a ball each */
    for (int i = 0; i < 6; i++) {
        const struct line_densities l = {scale[i / 3], 1.2};
        const double r = radius * scale[i / 3], cap = i % 3 == 0 ? 4.0 / 3.0 * M_PI * r * r * r : NAN;
        const double body = M_PI * r * r * (N_VERTEX - 1) * (double)step;
        struct fiber_set f;
        uint8_t corner;
        make_fiber(ratio[i % 3], &f);
        const double empty = sum_of(&f, &l, 0, &corner);
        assert_int_equal(corner, 0);
        const double full = sum_of(&f, &l, 200, &corner);
        assert_int_equal(corner, 200);
        print_message("ratio %.1f, scale %.2f: body %.0f, sum %.1f, in material %.1f\n", (double)ratio[i % 3],
                      scale[i / 3], body, empty, full);
        if (isfinite(cap)) assert_true(fabs(empty / (body + cap) - 1.0) < 0.015);
        assert_true(empty > body && empty < 1.2 * body);
        assert_true(full > 0.97 * empty && full < 1.04 * empty); /* material of the halo is nearly empty */
        fiber_set_release(&f);
    }
}

/* On scans of a cloth with little and much blur, and with the bright rims of phase contrast. A blur of 1.5 leaves
 * single fibers unresolved here, and such scans keep their densities. */
static void test_scans_sum_to_the_volume(void **state)
{
    (void)state;
    static const struct {
        double blur, fringes;
    } c[] = {{0.5, 0.0}, {1.0, 0.0}, {0.7, 1.0}};
    for (size_t i = 0; i < sizeof c / sizeof *c; i++) {
        struct phantom_option o;
        struct phantom_scan_option scan;
        struct phantom_reconstruction r = {0};
        phantom_cloth_of_diameter(&o, PHANTOM_PLAIN, 7.0);
        o.n_yarn[0] = o.n_yarn[1] = 2;
        phantom_scan_option_default(&scan);
        scan.snr = 5.0;
        scan.blur_sd_voxel = c[i].blur;
        scan.phase_fringes = c[i].fringes;
        reconstruct_option_default(&r.option);
        assert_int_equal(phantom_reconstruct_scan(&o, &scan, &r, NULL), STATUS_OK);
        print_message("blur %.1f, fringes %.0f: %.3f of the volume\n", c[i].blur, c[i].fringes, r.volume_ratio);
        assert_true(fabs(r.volume_ratio - 1.0) < 0.03);
        phantom_reconstruction_release(&r);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_sums_are_volumes),
                                       cmocka_unit_test(test_scans_sum_to_the_volume)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
