/* Main directions of cloths that are turned and sheared by known matrices, and the choice of a box that tiles. */
#include "base/angle.h"
#include "base/files/scratch_space.h"
#include "geometry/orientation/alignment.h"
#include "geometry/orientation/repeat_direction.h"
#include "geometry/reconstruct/reconstruct.h"
#include "geometry/volume/density_map.h"
#include "geometry/volume/tile_crop.h"
#include "geometry/volume/volume_align.h"
#include "tests/support/cloth/repeated_cloth.h"
#include "tests/support/scan/scan_files.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static const double deg = RAD_PER_DEG;

struct cloth {
    struct fiber_set truth;
    struct volume v;
    size_t n_tile[3];
};

static int make_cloth(void **state)
{
    static struct cloth c;
    repeated_cloth(PHANTOM_PLAIN, 5.0, (const double[2]){2.3, 2.4}, &c.truth, &c.v, c.n_tile);
    *state = &c;
    return 0;
}

static int release_cloth(void **state)
{
    struct cloth *c = *state;
    fiber_set_release(&c->truth);
    volume_release(&c->v);
    return 0;
}

/* rotation about z, then about x, and a shear of y along x, as one matrix that moves the cloth. */
static void motion(double rotation_deg, double tilt_deg, double shear, double m[9])
{
    double c = cos(rotation_deg * deg), s = sin(rotation_deg * deg), ct = cos(tilt_deg * deg), st = sin(tilt_deg * deg);
    const double in_plane[9] = {c, c * shear - s, 0.0, s, s * shear + c, 0.0, 0.0, 0.0, 1.0},
                 tilt[9] = {1.0, 0.0, 0.0, 0.0, ct, -st, 0.0, st, ct};
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            m[3 * i + j] = 0.0;
            for (int k = 0; k < 3; k++) m[3 * i + j] += tilt[3 * i + k] * in_plane[3 * k + j];
        }
}

static void moved(const struct volume *v, const double m[9], struct volume *out)
{
    const size_t box[6] = {0, 0, 0, v->n[0], v->n[1], v->n[2]};
    struct error err = {0};
    assert_int_equal(volume_resample(v, m, v->voxel_size_m[0], box, NULL, NULL, out, &err), STATUS_OK);
}

static void find(const struct volume *v, struct main_directions *m)
{
    struct error err = {0};
    assert_int_equal(main_directions_find(v, 0.5, NULL, NULL, m, &err), STATUS_OK);
    assert_int_equal(repeat_directions_refine(v, 0.0, NULL, m, &err), STATUS_OK);
}

static double angle_deg(const double a[3], const double b[3])
{
    double ab = 0.0, aa = 0.0, bb = 0.0;
    for (int i = 0; i < 3; i++) ab += a[i] * b[i], aa += a[i] * a[i], bb += b[i] * b[i];
    return acos(fmin(1.0, fabs(ab) / sqrt(aa * bb))) / deg;
}

/* A cloth is transformed by m. Weft and warp must be found in the directions to which m moves x and y, and the matrix
 * of the alignment must move them back. */
static void check_moved(const struct volume *v, const double m[9], double within_deg)
{
    struct volume x;
    struct main_directions found;
    struct alignment a;
    moved(v, m, &x);
    find(&x, &found);
    volume_release(&x);
    alignment_from_directions(&found, &a);
    assert_int_equal(a.outcome, ALIGN_DONE);
    assert_int_equal(found.n, 2);
    for (int p = 0; p < 2; p++) {
        const double want[3] = {m[p], m[3 + p], m[6 + p]}, *got = found.direction[p];
        double in_plane = remainder(atan2(got[1], got[0]) - atan2(want[1], want[0]), M_PI) / deg, back[3],
               axis[3] = {0.0};
        double tilt =
            asin(got[2]) / deg - asin(want[2] / sqrt(want[0] * want[0] + want[1] * want[1] + want[2] * want[2])) / deg;
        print_message("  %s: error in the plane %+.2f degrees (standard error %.2f), out of it %+.2f (%.2f), repeat "
                      "%.1f voxels (correlation %.2f)\n",
                      p == 0 ? "weft" : "warp", in_plane, found.se_deg[p], tilt, found.tilt_se_deg[p],
                      found.repeat_m[p] / v->voxel_size_m[0], found.correlation[p]);
        assert_true(fabs(in_plane) <= within_deg && fabs(in_plane) <= 3.0 * found.se_deg[p]);
        assert_true(fabs(tilt) <= within_deg && fabs(tilt) <= 3.0 * found.tilt_se_deg[p]);
        axis[p] = 1.0;
        for (int i = 0; i < 3; i++)
            back[i] = a.matrix[3 * i] * got[0] + a.matrix[3 * i + 1] * got[1] + a.matrix[3 * i + 2] * got[2];
        assert_true(angle_deg(back, axis) < 1e-6);
    }
}

static void test_known_matrices(void **state)
{
    const struct cloth *c = *state;
    static const double is[][3] = {{0.0, 0.0, 0.0}, {8.0, 0.0, 0.0}, {-20.0, 0.0, 0.1}, {5.0, 4.0, -0.15}};
    for (size_t i = 0; i < sizeof is / sizeof is[0]; i++) {
        double m[9];
        motion(is[i][0], is[i][1], is[i][2], m);
        print_message("turned %g degrees, tilted %g, sheared %g\n", is[i][0], is[i][1], is[i][2]);
        check_moved(&c->v, m, 1.0);
    }
}

static void test_threads(void **state)
{
    const struct cloth *c = *state;
    struct main_directions a, b;
    struct tile_crop p, q;
    struct thread_pool *pool;
    assert_int_equal(thread_pool_new(2, &pool, NULL), STATUS_OK);
    find(&c->v, &a);
    assert_int_equal(main_directions_find(&c->v, 0.5, pool, NULL, &b, NULL), STATUS_OK);
    assert_int_equal(repeat_directions_refine(&c->v, 0.0, pool, &b, NULL), STATUS_OK);
    assert_memory_equal(a.direction, b.direction, sizeof a.direction);
    assert_memory_equal(a.se_deg, b.se_deg, sizeof a.se_deg);
    assert_int_equal(tile_crop_find(&c->v, 0.5, 0.0, 0.4, NULL, NULL, &p, NULL), STATUS_OK);
    assert_int_equal(tile_crop_find(&c->v, 0.5, 0.0, 0.4, pool, NULL, &q, NULL), STATUS_OK);
    assert_memory_equal(&p, &q, sizeof p);
    thread_pool_free(pool);
}

/* One bundle: its direction goes to the nearer axis, nothing else is turned. Isotropic noise and felt have no
 * direction. */
static void test_one_system_and_none(void **state)
{
    (void)state;
    enum { N = 64 };
    const size_t n[3] = {N, N, N};
    struct volume v;
    struct main_directions m;
    struct alignment a;
    struct test_cylinder c[25];
    const double u[3] = {0.1, 1.0, -0.15};
    for (size_t i = 0; i < 25; i++)
        c[i] = (struct test_cylinder){.point = {(double)(i % 5) * 14.0, 32.0, (double)(i / 5) * 14.0},
                                      .direction = {u[0], u[1], u[2]},
                                      .radius = 3.5};
    assert_int_equal(volume_init(&v, n, (const double[3]){2e-6, 2e-6, 2e-6}, NULL), STATUS_OK);
    test_fill_cylinders(&v, c, 25, 0.2, 5);
    find(&v, &m);
    alignment_from_directions(&m, &a);
    assert_int_equal(m.n, 1);
    assert_int_equal(a.outcome, ALIGN_DONE);
    print_message("bundle: %.2f degrees off, standard error %.2f\n", angle_deg(m.direction[1], u), m.se_deg[1]);
    assert_true(angle_deg(m.direction[1], u) < 0.5);
    double back[3]; /* the true direction after the alignment */
    for (int i = 0; i < 3; i++)
        back[i] = a.matrix[3 * i] * u[0] + a.matrix[3 * i + 1] * u[1] + a.matrix[3 * i + 2] * u[2];
    assert_true(angle_deg(back, (const double[3]){0.0, 1.0, 0.0}) < 0.5);
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) { /* a rotation */
            double dot = 0.0;
            for (int k = 0; k < 3; k++) dot += a.matrix[3 * i + k] * a.matrix[3 * j + k];
            assert_true(fabs(dot - (i == j ? 1.0 : 0.0)) < 1e-6);
        }
    test_fill_cylinders(&v, c, 0, 0.3, 6);
    assert_int_equal(main_directions_find(&v, 0.0, NULL, NULL, &m, NULL), STATUS_OK);
    print_message("noise: %zu samples, shares %.2f %.2f z %.2f concentration %.2f, (%.2f %.2f %.2f)\n", m.n_sample,
                  m.share[0], m.share[1], m.share_z, m.concentration[0], m.direction[0][0], m.direction[0][1],
                  m.direction[0][2]);
    assert_true(m.n_sample > 500);
    assert_int_equal(m.n, 0);
    volume_release(&v);
    struct fiber_set f;
    size_t n_tile[3];
    repeated_cloth(PHANTOM_FELT, 6.0, (const double[2]){1.0, 1.0}, &f, &v, n_tile);
    assert_int_equal(main_directions_find(&v, 0.5, NULL, NULL, &m, NULL), STATUS_OK);
    alignment_from_directions(&m, &a);
    assert_int_equal(a.outcome, ALIGN_NO_DIRECTION);
    fiber_set_release(&f);
    volume_release(&v);
}

/* A weave in the plane of x and z cannot be turned to x and y. It is reported that the axes are wrong. */
static void test_wrong_axes(void **state)
{
    const struct cloth *c = *state;
    const double turned[9] = {1.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, 1.0, 0.0};
    struct main_directions m = {.n = 0};
    struct alignment a;
    assert_int_equal(main_directions_find(&c->v, 0.5, NULL, NULL, &m, NULL), STATUS_OK);
    for (int p = 0; p < 2; p++) {
        double d[3];
        for (int i = 0; i < 3; i++)
            d[i] = turned[3 * i] * m.direction[p][0] + turned[3 * i + 1] * m.direction[p][1] +
                   turned[3 * i + 2] * m.direction[p][2];
        memcpy(m.direction[p], d, sizeof d);
    }
    alignment_from_directions(&m, &a);
    assert_int_equal(a.outcome, ALIGN_OTHER_AXES);
    for (int i = 0; i < 9; i++) assert_true(a.matrix[i] == (i % 4 == 0 ? 1.0 : 0.0));
}

/* Weft and warp that are neither orthogonal nor in the plane. */
static void test_sheared_and_tilted(void **state)
{
    (void)state;
    const struct main_directions m = {
        .n = 2, .direction = {{1.0, 0.0, 0.0}, {0.3, 0.94, 0.16}}, .repeat_m = {1e-4, 1e-4}};
    const double normal[3] = {0.0, -0.16, 0.94};
    double length = hypot(0.16, 0.94);
    struct alignment a;
    alignment_from_directions(&m, &a);
    assert_int_equal(a.outcome, ALIGN_DONE);
    for (int i = 0; i < 3; i++) { /* the normal of the cloth becomes z, and thickness stays what it is */
        double z = 0.0;
        for (int k = 0; k < 3; k++) z += a.matrix[3 * i + k] * normal[k] / length;
        assert_true(fabs(z - (i == 2 ? 1.0 : 0.0)) < 1e-9);
    }
    assert_true(fabs(a.tilt_deg - atan2(0.16, 0.94) / deg) < 1e-6);
}

/* With one direction at most, the share of fibers along z decides whether the axes are wrong: 0.35 of them. */
static void test_fibers_along_z(void **state)
{
    (void)state;
    static const struct {
        size_t n;
        double share_z;
        enum align_outcome outcome;
    } is[] = {
        {0, 0.3, ALIGN_NO_DIRECTION}, {0, 0.4, ALIGN_OTHER_AXES}, {1, 0.3, ALIGN_DONE}, {1, 0.4, ALIGN_OTHER_AXES}};
    for (size_t i = 0; i < sizeof is / sizeof is[0]; i++) {
        struct main_directions m = {.n = is[i].n, .share_z = is[i].share_z};
        struct alignment a;
        if (m.n == 1) m.direction[0][0] = 1.0;
        alignment_from_directions(&m, &a);
        assert_int_equal(a.outcome, is[i].outcome);
    }
}

static void test_known_period(void **state)
{
    const struct cloth *c = *state;
    struct tile_crop crop;
    struct seam_density before, after;
    struct volume v;
    assert_int_equal(volume_init(&v, c->v.n, c->v.voxel_size_m, NULL), STATUS_OK);
    memcpy(v.density, c->v.density, volume_n_voxel(v.n) * sizeof(float));
    seam_density_measure(&v, &before);
    assert_int_equal(tile_crop_find(&v, 0.5, 0.0, 0.5, NULL, NULL, &crop, NULL), STATUS_OK);
    for (size_t a = 0; a < 2; a++) {
        size_t length = crop.box[3 + a] - crop.box[a];
        print_message("%c: period %zu, box %zu..%zu of %zu, mismatch %.3f\n", "xy"[a], c -> n_tile[a], crop.box[a],
                      crop.box[3 + a], v.n[a], crop.mismatch[a]);
        assert_int_equal(length % c->n_tile[a], 0); /* two repeats: the largest box that tiles */
        assert_int_equal(length / c->n_tile[a], 2);
        assert_true(crop.mismatch[a] < 0.3); /* noise */
    }
    assert_true(crop.valid[0] == 0 && crop.valid[2] == v.n[0] && crop.valid[1] == 0 && crop.valid[3] == v.n[1]);
    const float first = v.density[volume_index(v.n, crop.box[0] + 3, crop.box[1] + 4, 5)];
    volume_crop(&v, crop.box);
    assert_true(v.density[volume_index(v.n, 3, 4, 5)] == first);
    seam_density_measure(&v, &after);
    for (int a = 0; a < 2; a++) {
        print_message("%c: seam %.2f before, %.2f after\n", "xy"[a], before.ratio[a], after.ratio[a]);
        assert_true(before.ratio[a] > 1.5);
        assert_true(fabs(after.ratio[a] - 1.0) < 0.15);
    }
    volume_release(&v);
}

/* A cloth that is turned by 8 degrees and aligned again. The box must have no voxel from outside of the scan, and a
 * whole number of repeats. */
static void test_align_and_crop(void **state)
{
    const struct cloth *c = *state;
    double m[9];
    struct volume x, y;
    struct main_directions found;
    struct alignment a;
    struct tile_crop crop;
    struct density_modes modes;
    struct seam_density seam;
    motion(8.0, 0.0, 0.0, m);
    moved(&c->v, m, &x);
    assert_int_equal(density_modes_find(&x, &modes, NULL), STATUS_OK);
    assert_int_equal(main_directions_find(&x, modes.half, NULL, NULL, &found, NULL), STATUS_OK);
    assert_int_equal(repeat_directions_refine(&x, modes.low, NULL, &found, NULL), STATUS_OK);
    alignment_from_directions(&found, &a);
    moved(&x, a.matrix, &y);
    assert_int_equal(tile_crop_find(&y, modes.half, modes.low, 0.5, NULL, NULL, &crop, NULL), STATUS_OK);
    volume_crop(&y, crop.box);
    size_t n_outside = 0;
    for (size_t i = 0; i < volume_n_voxel(y.n); i++) n_outside += isfinite(y.density[i]) ? 0 : 1;
    print_message("%zu voxels of the tile from outside of the scan\n", n_outside);
    assert_int_equal(n_outside, 0);
    for (size_t e = 0; e < 2; e++) {
        double repeats = (double)y.n[e] / (double)c->n_tile[e];
        print_message("%c: %.3f repeats, mismatch %.3f\n", "xy"[e], repeats, crop.mismatch[e]);
        assert_true(fabs(repeats - round(repeats)) < 0.03 && repeats > 0.9);
        assert_true(crop.mismatch[e] < 0.3);
    }
    seam_density_measure(&y, &seam);
    print_message("seams %.2f %.2f\n", seam.ratio[0], seam.ratio[1]);
    for (int e = 0; e < 2; e++)
        assert_true(seam.ratio[e] > 0.7 && seam.ratio[e] < 1.4); /* 1.5 to 1.6 for chance (test_known_period) */
    volume_release(&x);
    volume_release(&y);
}

/* The whole step from a file, in memory and in scratch files under a small limit: the same matrix, box and volume. */
static void test_memory_limit(void **state)
{
    const struct cloth *c = *state;
    double m[9];
    char folder[64], path_text[128];
    const char *path = path_text;
    struct volume x, v[2];
    struct reconstruct_option o[2];
    struct reconstruct_report r[2] = {0};
    struct scratch_space *space = NULL;
    struct error err = {0};
    motion(6.0, 0.0, 0.1, m);
    moved(&c->v, m, &x);
    test_make_folder(folder);
    snprintf(path_text, sizeof path_text, "%s/cloth.tif", folder);
    for (size_t i = 0; i < volume_n_voxel(x.n); i++) x.density[i] = isfinite(x.density[i]) ? x.density[i] : 0.0f;
    const struct phantom_file_option file = {.bits = 16, .void_value = 10000.0, .fiber_value = 40000.0};
    assert_int_equal(phantom_write_tiff(&x, &file, path, &err), STATUS_OK);
    volume_release(&x);
    assert_int_equal(scratch_space_new(folder, 1u << 20, &space, &err), STATUS_OK);
    for (int i = 0; i < 2; i++) {
        reconstruct_option_default(&o[i]);
        for (int a = 0; a < 3; a++) o[i].voxel_size_m[a] = 2e-6;
        o[i].align = o[i].crop = true;
        assert_int_equal(reconstruct_read(&path, 1, &o[i], i == 0 ? NULL : space, NULL, NULL, &v[i], &r[i], &err),
                         STATUS_OK);
    }
    assert_true(scratch_file_bytes(space) > 0);
    assert_true(r[0].aligned && fabs(r[0].align.rotation_deg - 6.0) < 0.7 && r[0].tile.mismatch[0] < 0.4 &&
                r[0].tile.mismatch[1] < 0.4);
    assert_memory_equal(o[0].matrix, o[1].matrix, sizeof o[0].matrix);
    assert_memory_equal(o[0].crop_voxel, o[1].crop_voxel, sizeof o[0].crop_voxel);
    assert_memory_equal(v[0].n, v[1].n, sizeof v[0].n);
    assert_memory_equal(v[0].density, v[1].density, volume_n_voxel(v[0].n) * sizeof(float));
    for (int a = 0; a < 2; a++) { /* whole repeats, and seams no worse than inside */
        double repeats = (double)v[0].n[a] / (double)c->n_tile[a];
        print_message("%c: %.3f repeats, seam %.2f\n", "xy"[a], repeats, r[0].seam_density.ratio[a]);
        assert_true(fabs(repeats - round(repeats)) < 0.04 && r[0].seam_density.ratio[a] < 1.6);
    }
    volume_release(&v[0]);
    volume_release(&v[1]);
    scratch_space_free(space);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_known_matrices),      cmocka_unit_test(test_threads),
        cmocka_unit_test(test_one_system_and_none), cmocka_unit_test(test_wrong_axes),
        cmocka_unit_test(test_fibers_along_z),      cmocka_unit_test(test_sheared_and_tilted),
        cmocka_unit_test(test_known_period),        cmocka_unit_test(test_align_and_crop),
        cmocka_unit_test(test_memory_limit)};
    return cmocka_run_group_tests(tests, make_cloth, release_cloth);
}
