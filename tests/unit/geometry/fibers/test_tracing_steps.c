/* The steps from directions to fibers, one by one: smoothing, linking, joining, relaxing, radius, alignment. */
#include "base/angle.h"
#include "base/option_id.h"
#include "base/rng.h"
#include "geometry/fibers/axes/axis_fit.h"
#include "geometry/fibers/lines/joining.h"
#include "geometry/fibers/lines/linking.h"
#include "geometry/fibers/shape/radius.h"
#include "geometry/fibers/shape/smoothing.h"
#include "geometry/volume/volume_align.h"
#include "tests/support/scan/scan_files.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static const double voxel_m[3] = {2e-6, 2e-6, 2e-6};

/* The gradient of the energy vanishes: alpha (p - p0) + D^T D p = 0. */
static void test_smoothing(void **state)
{
    (void)state;
    enum { MOST = 40 };
    struct rng r;
    rng_start(&r, &(struct rng_key){.seed = 1}, 0, 0);
    for (size_t n = 1; n <= MOST; n++) {
        float start[MOST][3], x[MOST][3];
        double work[4 * MOST], second[MOST + 2] = {0.0};
        for (size_t i = 0; i < n; i++)
            for (int a = 0; a < 3; a++) start[i][a] = 200.0f + (float)i + rng_float(&r);
        memcpy(x, start, sizeof x);
        polyline_smooth(x, n, 0.1, work);
        if (n < 3) assert_memory_equal(x, start, n * sizeof *x);
        for (int a = 0; a < 3 && n >= 3; a++) {
            memset(second, 0, sizeof second); /* second[i + 1]: second difference centred at i */
            for (size_t i = 1; i + 1 < n; i++)
                second[i + 1] = (double)x[i - 1][a] - 2.0 * (double)x[i][a] + (double)x[i + 1][a];
            for (size_t i = 0; i < n; i++) {
                double left = i > 0 ? second[i] : 0.0, right = i + 2 < n + 1 ? second[i + 2] : 0.0;
                double gradient = 0.1 * ((double)x[i][a] - (double)start[i][a]) + left - 2.0 * second[i + 1] + right;
                assert_true(fabs(gradient) < 2e-4);
            }
        }
    }
}

/* Fibers that touch, and whose centers move by almost a diameter from slice to slice, are not confused. */
static void test_linking_leaning_neighbours(void **state)
{
    (void)state;
    enum { N_SLICE = 30, N_FIBER = 6 };
    const size_t n[3] = {120, 60, N_SLICE};
    struct center center[N_SLICE * N_FIBER];
    size_t first[N_SLICE + 1];
    struct center_list list = {N_SLICE, first, center};
    struct slice_frame frame;
    struct polyline_set lines;
    size_t n_chain;
    slice_frame_init(&frame, 2, n);
    for (size_t k = 0; k <= N_SLICE; k++) first[k] = k * N_FIBER;
    for (size_t k = 0; k < N_SLICE; k++)
        for (size_t i = 0; i < N_FIBER; i++) /* 4 voxels apart along u, moving 0.8 along u a slice; sorted by v */
            center[k * N_FIBER + i] = (struct center){
                .u = 5.0f + 4.0f * (float)i + 0.8f * (float)k, .v = 30.0f + 0.1f * (float)i, .slope_u = 0.8f};
    polyline_set_init(&lines);
    assert_int_equal(centers_link(&list, &frame, 5.0, 4.0, 10, &lines, &n_chain, NULL), STATUS_OK);
    assert_int_equal(n_chain, N_FIBER);
    assert_int_equal(lines.n_line, N_FIBER);
    for (size_t l = 0; l < N_FIBER; l++) {
        const float *a = lines.vertex[lines.first[l]], *b = lines.vertex[lines.first[l + 1] - 1];
        assert_int_equal(polyline_length(&lines, l), N_SLICE);
        assert_true(fabsf(b[0] - a[0] - 0.8f * (N_SLICE - 1)) < 1e-3f);
        assert_true(b[2] == N_SLICE - 0.5f);
    }
    polyline_set_release(&lines);
}

static void add_piece(struct polyline_set *p, uint8_t axis, float x0, float x1, float y)
{
    assert_int_equal(polyline_begin(p, axis, NULL), STATUS_OK);
    for (float x = x0; x <= x1; x += 1.0f)
        assert_int_equal(polyline_add(p, (const float[3]){x, y, 16.0f}, NULL), STATUS_OK);
}

static void test_duplicates_and_joins(void **state)
{
    (void)state;
    const size_t n[3] = {96, 32, 32};
    struct volume v;
    struct polyline_set in, single, out;
    struct join_counts counts = {0};
    assert_int_equal(volume_init(&v, n, voxel_m, NULL), STATUS_OK);
    const struct test_cylinder c[2] = {{{0.0, 8.0, 16.0}, {1.0, 0.0, 0.0}, 3.0},
                                       {{0.0, 22.0, 16.0}, {1.0, 0.0, 0.0}, 3.0}};
    test_fill_cylinders(&v, c, 2, 0.0, 1);
    for (size_t k = 0; k < 32; k++) /* the second fiber is cut in two at x = 50 */
        for (size_t j = 16; j < 32; j++)
            for (size_t i = 47; i < 54; i++) v.density[volume_index(n, i, j, k)] = 0.0f;
    polyline_set_init(&in);
    polyline_set_init(&single);
    polyline_set_init(&out);
    add_piece(&in, 0, 2.5f, 40.5f, 8.0f);
    add_piece(&in, 3, 36.5f, 60.5f, 8.5f); /* the same fiber from other slices, overlapping */
    add_piece(&in, 0, 65.5f, 90.5f, 8.0f); /* and behind a gap */
    add_piece(&in, 0, 2.5f, 46.5f, 22.0f);
    add_piece(&in, 0, 54.5f, 90.5f, 22.0f); /* no material between */
    assert_int_equal(polylines_remove_duplicates(&in, &(struct duplicate_option){{n[0], n[1], n[2]}, 6.0, 0.0, NULL}, 4,
                                                 &single, &counts, NULL),
                     STATUS_OK);
    assert_int_equal(single.n_line, 5);
    assert_true(counts.n_duplicate >= 4 && counts.n_duplicate < 12);
    assert_int_equal(polylines_join(&single, &v, &(struct join_option){6.0, 0.5, 0.0, NULL}, &out, &counts, NULL),
                     STATUS_OK);
    assert_int_equal(out.n_line, 3);
    assert_int_equal(counts.n_joined, 2); /* both joints of the middle piece */
    assert_int_equal(counts.n_gap_bridged, 0);
    for (size_t i = 1; i < polyline_length(&out, 0); i++) /* ordered, no holes */
        assert_true(fabsf(out.vertex[i][0] - out.vertex[i - 1][0]) < 1.6f);
    assert_true(fabsf(out.vertex[0][0] - out.vertex[out.first[1] - 1][0]) > 85.0f);
    polyline_set_release(&in);
    polyline_set_release(&single);
    polyline_set_release(&out);
    volume_release(&v);
}

/* Three fibers, two of which touch. Only two have lines, and these must end on their axes with the true radius,
 * independent of the third fiber. A fit that is cancelled says so and changes nothing. With a blur b, the position of a
 * straight axis is known to sigma / sqrt(A) per voxel of length with A = pi r / (2 sqrt(pi) b), because a quarter of a
 * circle's surface determines each coordinate. That is some 0.1 voxel, and the fit averages over several voxels. */
static void test_axis_fit(void **state)
{
    (void)state;
    const size_t n[3] = {64, 40, 32};
    const struct test_cylinder c[3] = {{{0.0, 12.5, 16.0}, {1.0, 0.0, 0.0}, 3.5},
                                       {{0.0, 19.5, 16.0}, {1.0, 0.0, 0.0}, 3.5},
                                       {{0.0, 26.6, 16.0}, {1.0, 0.0, 0.0}, 3.5}};
    struct volume v;
    struct polyline_set coarse, lines;
    struct axis_profile profile = {.radius = 3.2, .blur = 0.8, .high = 1.0, .independent = 1.0};
    atomic_bool cancel = true;
    const struct progress cancelled = {.cancel = &cancel};
    assert_int_equal(volume_init(&v, n, voxel_m, NULL), STATUS_OK);
    test_fill_cylinders(&v, c, 3, 0.2, 1);
    polyline_set_init(&coarse);
    polyline_set_init(&lines);
    add_piece(&coarse, 0, 0.5f, 63.5f, 13.2f);
    add_piece(&coarse, 0, 0.5f, 63.5f, 19.0f);
    assert_int_equal(polylines_resample(&coarse, &lines, NULL), STATUS_OK);
    assert_int_equal(polyline_length(&lines, 0), 64);
    assert_int_equal(polylines_fit(&lines, &v, 7.0, 6, &profile, NULL, &cancelled, NULL), STATUS_CANCELLED);
    assert_true(profile.radius == 3.2 && profile.blur == 0.8);
    assert_int_equal(polylines_fit(&lines, &v, 7.0, 6, &profile, NULL, NULL, NULL), STATUS_OK);
    double square = 0.0;
    for (size_t i = 0; i < lines.n_vertex; i++) {
        double dy = (double)lines.vertex[i][1] - (i < lines.first[1] ? 12.5 : 19.5),
               dz = (double)lines.vertex[i][2] - 16.0;
        square += dy * dy + dz * dz;
    }
    print_message("rms distance from the axes %.3f voxels, radius %.3f, blur %.2f, densities %.2f to %.2f\n",
                  sqrt(square / (double)lines.n_vertex), profile.radius, profile.blur, profile.low, profile.high);
    assert_true(sqrt(square / (double)lines.n_vertex) < 0.1);
    assert_true(fabs(profile.radius - 3.5) < 0.03 * 3.5);
    polyline_set_release(&coarse);
    polyline_set_release(&lines);
    volume_release(&v);
}

/* Two touching fibers of different thickness: each line finds its own axis and radius, although both start with the
 * typical radius, half of the diameter given. */
static void test_single_radii(void **state)
{
    (void)state;
    const size_t n[3] = {64, 40, 32};
    const struct test_cylinder c[2] = {{{0.0, 12.5, 16.0}, {1.0, 0.0, 0.0}, 2.6},
                                       {{0.0, 19.5, 16.0}, {1.0, 0.0, 0.0}, 4.4}};
    struct volume v;
    struct polyline_set lines;
    struct axis_profile profile = {.radius = 3.5, .radius_spread = 0.3, .blur = 0.8, .high = 1.0, .independent = 1.0};
    assert_int_equal(volume_init(&v, n, voxel_m, NULL), STATUS_OK);
    test_fill_cylinders(&v, c, 2, 0.2, 1);
    polyline_set_init(&lines);
    add_piece(&lines, 0, 0.5f, 63.5f, 13.2f);
    add_piece(&lines, 0, 0.5f, 63.5f, 19.0f);
    assert_int_equal(polylines_fit(&lines, &v, 7.0, 8, &profile, NULL, NULL, NULL), STATUS_OK);
    for (size_t l = 0; l < 2; l++) {
        double mean = 0.0;
        for (size_t i = lines.first[l]; i < lines.first[l + 1]; i++)
            mean += ((double)lines.vertex[i][1] - c[l].point[1]) / (double)polyline_length(&lines, l);
        print_message("radius %.3f of %.1f, offset %.3f voxels\n", (double)lines.radius[l], c[l].radius, mean);
        assert_true(fabs((double)lines.radius[l] / c[l].radius - 1.0) < 0.03);
        assert_true(fabs(mean) < 0.1);
    }
    assert_true(fabs(profile.radius_spread - 0.9 / 3.5) < 0.03 && profile.radius_se < 0.02);
    polyline_set_release(&lines);
    volume_release(&v);
}

/* RMS of one component of the deviation of lines along x from their axis, and of the slope of their segments. */
static void deviation(const struct polyline_set *lines, double y, double z, double *position, double *slope)
{
    double square = 0.0, turn = 0.0, n = 0.0;
    for (size_t i = 4; i + 5 < lines->n_vertex; i++, n += 2.0) {
        const float *a = lines->vertex[i], *b = lines->vertex[i + 1];
        square += pow((double)a[1] - y, 2.0) + pow((double)a[2] - z, 2.0);
        turn += (pow((double)(b[1] - a[1]), 2.0) + pow((double)(b[2] - a[2]), 2.0)) / pow((double)(b[0] - a[0]), 2.0);
    }
    *position = sqrt(square / n);
    *slope = sqrt(turn / n);
}

/* The stated errors of the axes. A straight fiber loses nothing by smoothing, so it has only the noise's part of them:
 * the integrals of n / (n + L k^4)^2 are 3/4 of the position's variance and 1/4 of the direction's. Where the curvature
 * is measured, bends are correlated, which lets less noise pass than the stated errors count with. */
static void test_axis_errors(void **state)
{
    (void)state;
    const size_t n[3] = {400, 24, 24};
    const struct test_cylinder c = {{0.0, 12.3, 12.1}, {1.0, 0.0, 0.0}, 3.5};
    for (int round = 0; round < 2; round++) {
        struct volume v;
        struct polyline_set coarse, lines;
        double position, slope;
        struct axis_profile profile = {
            .radius = 3.2, .blur = 0.8, .high = 1.0, .independent = 1.0, .measured_curvature = round == 1};
        assert_int_equal(volume_init(&v, n, voxel_m, NULL), STATUS_OK);
        test_fill_cylinders(&v, &c, 1, 0.2, 1);
        polyline_set_init(&coarse);
        polyline_set_init(&lines);
        add_piece(&coarse, 0, 0.5f, 399.5f, 12.5f);
        assert_int_equal(polylines_resample(&coarse, &lines, NULL), STATUS_OK);
        assert_int_equal(polylines_fit(&lines, &v, 7.0, 6, &profile, NULL, NULL, NULL), STATUS_OK);
        deviation(&lines, 12.3, 12.1, &position, &slope);
        print_message("position %.3f voxels (stated %.3f), direction %.2f degrees (stated %.2f)\n", position,
                      profile.position_se, slope / RAD_PER_DEG, profile.direction_se_rad / RAD_PER_DEG);
        const double part[2] = {position / (sqrt(0.75) * profile.position_se),
                                slope / (0.5 * profile.direction_se_rad)};
        for (int i = 0; i < 2; i++) assert_true(part[i] < 1.4 && (round == 1 || part[i] > 0.6));
        polyline_set_release(&coarse);
        polyline_set_release(&lines);
        volume_release(&v);
    }
}

/* The histogram against a count in this test, and both estimates of the radius for a bundle of touching fibers whose
 * lines are a quarter voxel away from the axes. */
static void test_radius(void **state)
{
    (void)state;
    enum { N_FIBER = 7 };
    const size_t n[3] = {48, 48, 48};
    struct test_cylinder c[N_FIBER];
    struct polyline_set lines;
    struct volume v;
    struct distance_histogram *part = malloc((RADIUS_PARTS + 1) * sizeof *part), *h = part + RADIUS_PARTS;
    polyline_set_init(&lines);
    for (int i = 0; i < N_FIBER; i++) {
        double y = 24.0 + (i > 0 ? 7.0 * cos(i * M_PI / 3.0) : 0.0),
               z = 24.0 + (i > 0 ? 7.0 * sin(i * M_PI / 3.0) : 0.0);
        c[i] = (struct test_cylinder){{0.0, y, z}, {1.0, 0.0, 0.0}, 3.5};
        assert_int_equal(polyline_begin(&lines, 0, NULL), STATUS_OK);
        for (int x = 0; x <= 48; x++)
            assert_int_equal(
                polyline_add(&lines, (const float[3]){(float)x, (float)y + (x % 2 ? 0.25f : -0.25f), (float)z}, NULL),
                STATUS_OK);
    }
    assert_int_equal(volume_init(&v, n, voxel_m, NULL), STATUS_OK);
    test_fill_cylinders(&v, c, N_FIBER, 0.0, 1);
    assert_int_equal(distance_histogram_measure(&v, &lines, 0.5, 8.0, NULL, NULL, part, NULL), STATUS_OK);
    distance_histogram_sum(part, RADIUS_PARTS, h);
    uint64_t total = h->far_count, inside = h->far_inside;
    for (int b = 0; b < RADIUS_BINS; b++) {
        total += h->inside[0][b] + h->outside[0][b];
        inside += h->inside[0][b];
    }
    assert_int_equal(total % 4096, 0); /* whole bricks of 16^3 voxels, 64 points a voxel */
    double volume =
        (double)inside / 64.0 / (N_FIBER * M_PI * 3.5 * 3.5 * 48.0); /* interpolation fills the contacts a little */
    assert_true(volume > 0.99 && volume < 1.04);
    assert_true(fabs(h->length_voxel[0] / (N_FIBER * 48.0 * sqrt(1.25)) - 1.0) < 1e-3);
    double score = radius_best_score(h, 1), mass = radius_from_mass(h, 1, score) * pow(1.25, 0.25);
    print_message("radius 3.5: best score %.3f, mass %.3f\n", score, mass);
    assert_true(fabs(score - 3.5) < 0.15);
    assert_true(fabs(mass - 3.5) < 0.05);
    assert_true(radius_score(h, 1, score) >= radius_score(h, 1, score * 1.1));
    assert_true(radius_score(h, 1, score) >= radius_score(h, 1, score * 0.9));
    assert_true(radius_best_score(h, 2) == 0.0);
    polyline_set_release(&lines);
    volume_release(&v);
    free(part);
}

/* Fibers along x and along y. When their radii differ by more than their standard errors, each class has its own
 * radius. Otherwise, or when the option says so, there is one radius for all. */
static void test_radius_of_each_class(void **state)
{
    (void)state;
    const size_t n[3] = {96, 96, 32};
    static const struct {
        double along_y;
        enum radius_rule rule;
        bool per_axis;
    } check[] = {
        {4.5, RADIUS_AUTO, true}, {3.5, RADIUS_AUTO, false}, {4.5, RADIUS_COMMON, false}, {3.5, RADIUS_PER_AXIS, true}};
    struct distance_histogram *part = malloc(RADIUS_PARTS * sizeof *part);
    for (size_t k = 0; k < sizeof check / sizeof *check; k++) {
        struct test_cylinder c[6];
        struct polyline_set lines;
        struct volume v;
        struct radius_measure m;
        polyline_set_init(&lines);
        for (int i = 0; i < 6; i++) {
            int along = i % 2;
            double at = 20.0 + 28.0 * (i / 2), z = along == 0 ? 8.0 : 23.0;
            c[i] = (struct test_cylinder){{along == 0 ? 0.0 : at, along == 0 ? at : 0.0, z},
                                          {along == 0, along == 1, 0.0},
                                          along == 0 ? 3.5 : check[k].along_y};
            assert_int_equal(polyline_begin(&lines, (uint8_t)along, NULL), STATUS_OK);
            for (int x = 0; x <= 96; x++)
                assert_int_equal(
                    polyline_add(&lines,
                                 (const float[3]){(float)(along == 0 ? x : at), (float)(along == 0 ? at : x), (float)z},
                                 NULL),
                    STATUS_OK);
        }
        assert_int_equal(volume_init(&v, n, voxel_m, NULL), STATUS_OK);
        test_fill_cylinders(&v, c, 6, 0.1, 1);
        for (size_t i = 0; i < volume_n_voxel(n); i++)
            v.density[i] = fminf(1.0f, fmaxf(0.0f, v.density[i])); /* as the mapping does */
        assert_int_equal(distance_histogram_measure(&v, &lines, 0.5, 8.0, NULL, NULL, part, NULL), STATUS_OK);
        assert_int_equal(radius_choose(part, check[k].rule, &m, NULL), STATUS_OK);
        print_message("radii 3.5 and %.1f: %.3f (%.3f) and %.3f (%.3f)\n", check[k].along_y, m.radius_voxel[0],
                      m.se_voxel[0], m.radius_voxel[1], m.se_voxel[1]);
        assert_int_equal(m.per_axis, check[k].per_axis);
        assert_int_equal(m.radius_voxel[0] != m.radius_voxel[1], check[k].per_axis);
        assert_true(m.radius_voxel[2] > 3.3 && m.se_voxel[2] > 0.0); /* no fiber along z: that of all */
        assert_true(m.se_voxel[0] > 0.0 && m.se_voxel[0] < 0.1);
        if (check[k].per_axis) {
            assert_true(fabs(m.radius_voxel[0] - 3.5) < 0.03 * 3.5);
            assert_true(fabs(m.radius_voxel[1] - check[k].along_y) < 0.03 * check[k].along_y);
        }
        polyline_set_release(&lines);
        volume_release(&v);
    }
    free(part);
}

static void test_alignment(void **state)
{
    (void)state;
    struct axis_map map;
    struct error err = {0};
    assert_int_equal(axis_map_parse("-zxy", &map, &err), STATUS_OK);
    assert_true(map.source[0] == 2 && map.flip[0] && map.source[1] == 0 && !map.flip[1] && map.source[2] == 1);
    static const char *const bad[] = {"", "xy", "xxz", "xyzz", "xy-", "abc", "--xyz"};
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++)
        assert_int_equal(axis_map_parse(bad[i], &map, &err), STATUS_INVALID);
    /* A shear brings a leaning cylinder upright: the one that goes along (0.25, 0, 1) */
    const size_t n[3] = {40, 24, 32}, box[6] = {0, 0, 0, 40, 24, 32};
    const double shear[9] = {1.0, 0.0, -0.25, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0},
                 singular[9] = {1.0, 1.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0, 1.0};
    struct volume v, out;
    assert_int_equal(volume_init(&v, n, voxel_m, NULL), STATUS_OK);
    test_fill_cylinders(&v, &(struct test_cylinder){{20.0, 12.0, 16.0}, {0.25, 0.0, 1.0}, 3.0}, 1, 0.0, 1);
    assert_int_equal(volume_resample(&v, shear, 2e-6, box, NULL, NULL, &out, NULL), STATUS_OK);
    for (size_t k = 4; k < 28; k++) {
        double sum = 0.0, mean = 0.0;
        for (size_t j = 0; j < n[1]; j++)
            for (size_t i = 0; i < n[0]; i++) {
                float x = out.density[volume_index(n, i, j, k)];
                if (!(x > 0.0f)) continue; /* voxels from outside of the scan are -infinity */
                sum += (double)x;
                mean += (double)x * ((double)i + 0.5);
            }
        assert_true(fabs(mean / sum - 20.0) < 0.05);
    }
    volume_release(&out);
    assert_int_equal(volume_resample(&v, singular, 2e-6, box, NULL, NULL, &out, &err), STATUS_INVALID);
    assert_string_equal(err.field, OPTION_MATRIX);
    volume_release(&v);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_smoothing),
        cmocka_unit_test(test_linking_leaning_neighbours),
        cmocka_unit_test(test_duplicates_and_joins),
        cmocka_unit_test(test_single_radii),
        cmocka_unit_test(test_axis_fit),
        cmocka_unit_test(test_axis_errors),
        cmocka_unit_test(test_radius),
        cmocka_unit_test(test_radius_of_each_class),
        cmocka_unit_test(test_alignment),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
