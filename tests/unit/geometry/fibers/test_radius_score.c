/* The scatter of sums, and the overlap score of the fiber radius (fabric thesis 5.6.5) on a histogram written by hand:
 *     score(r) = |C(r) and V| - |C(r) xor V|, and a ring belongs to the best C(r) while more than a third of its points
 *     are in V, because a point of V inside of C(r) counts twice (it joins the intersection and leaves the
 *     difference). */
#include "geometry/fibers/axes/model/axis_profile.h"
#include "geometry/fibers/shape/radius.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>

#include <cmocka.h>

/* Points of V and others in each bin of rings of 64 bins; each bin is 1/64 voxel wide, so a ring is one voxel wide. */
static const uint64_t ring[RADIUS_BINS / 64][2] = {{100, 0}, {70, 30}, {40, 60}, {30, 70}, {20, 80}, {1, 99}};

static void fill(struct distance_histogram *h)
{
    *h = (struct distance_histogram){.bin_voxel = 1.0 / 64.0};
    for (size_t b = 0; b < RADIUS_BINS; b++) {
        h->inside[1][b] = ring[b / 64][0];
        h->outside[1][b] = ring[b / 64][1];
    }
}

static void test_best_score(void **state)
{
    (void)state;
    struct distance_histogram *h = malloc(sizeof *h);
    assert_non_null(h);
    fill(h);
    assert_true(radius_best_score(h, 2u) == 3.0); /* 40 of 100 points are in V in the third ring, 30 in the fourth */
    assert_true(radius_best_score(h, 7u) == 3.0);
    assert_true(radius_best_score(h, 1u) == 0.0); /* no fiber of that class */
    free(h);
}

static void test_score(void **state)
{
    (void)state;
    struct distance_histogram *h = malloc(sizeof *h);
    double all = 0.0, in = 0.0, out = 0.0;
    assert_non_null(h);
    fill(h);
    for (size_t k = 0; k < RADIUS_BINS / 64; k++) all += (double)ring[k][0];
    for (size_t k = 0; k < RADIUS_BINS / 64; k++) {
        in += (double)ring[k][0];
        out += (double)ring[k][1];
        double want = (in - (out + (all - in))) / all;
        assert_true(fabs(radius_score(h, 2u, (double)k + 1.0) - want) < 1e-12);
    }
    assert_true(radius_score(h, 1u, 3.0) == 0.0);
    free(h);
}

/* A cylinder of this radius and length, in bins of 1/64 voxel: points of material within the radius and none beyond. */
static void add_cylinder(struct distance_histogram *h, int class, double radius_voxel, double length_voxel)
{
    for (size_t b = 0; b < RADIUS_BINS; b++) {
        double at = ((double)b + 0.5) * h->bin_voxel;
        /* the volume of a shell, of which each voxel has RADIUS_UPSAMPLING^3 points */
        uint64_t n = (uint64_t)lround(2.0 * M_PI * at * h->bin_voxel * length_voxel * pow(RADIUS_UPSAMPLING, 3.0));
        (at < radius_voxel ? h->inside : h->outside)[class][b] += n;
        h->density_sum[class][b] += at < radius_voxel ? 255 * n : 0;
    }
    h->length_voxel[class] += length_voxel;
}

/* Efron's jackknife over the parts that have fibers of these classes, from what is measured without each of them. */
static double jackknife(const struct distance_histogram *part, unsigned classes, const bool *has)
{
    static struct distance_histogram rest;
    double r[RADIUS_PARTS], mean = 0.0, square = 0.0;
    size_t n = 0;
    for (size_t p = 0; p < RADIUS_PARTS; p++) {
        if (!has[p]) continue;
        distance_histogram_sum(part, p, &rest);
        r[n++] = radius_from_mass(&rest, classes, radius_best_score(&rest, classes));
    }
    for (size_t i = 0; i < n; i++) mean += r[i] / (double)n;
    for (size_t i = 0; i < n; i++) square += (r[i] - mean) * (r[i] - mean);
    return sqrt(square * (double)(n - 1) / (double)n);
}

/* The standard error of a radius, where the parts have other radii: of all parts, and where some have no fiber. */
static void test_error_by_leaving_out_parts(void **state)
{
    (void)state;
    static struct distance_histogram part[RADIUS_PARTS];
    for (size_t n_part = RADIUS_PARTS; n_part >= 1; n_part -= n_part > 2 ? 3 : 1) {
        bool has[RADIUS_PARTS] = {false};
        struct radius_measure m;
        for (size_t p = 0; p < RADIUS_PARTS; p++) {
            part[p] = (struct distance_histogram){.bin_voxel = 1.0 / 64.0};
            has[p] = p < n_part;
            if (has[p]) add_cylinder(&part[p], 0, 2.0 + 0.1 * (double)(p * p % 7), 10.0 + (double)p);
        }
        assert_int_equal(radius_choose(part, RADIUS_PER_AXIS, &m, NULL), STATUS_OK);
        assert_true(m.radius_voxel[0] > 1.9 && m.radius_voxel[0] < 2.7);
        const double want = jackknife(part, 1u, has);
        if (n_part == 1) {
            assert_true(isnan(m.se_voxel[0])); /* one part says nothing of its scatter */
            break;
        }
        if (!(want > 0.01) || fabs(m.se_voxel[0] / want - 1.0) > 1e-6)
            fail_msg("%zu parts: error %g, not %g", n_part, m.se_voxel[0], want);
    }
}

/* Radii of classes from those of their lines: the root of the mean square by length, of all lines where classes share a
 * radius or one has no line. Then the lines get the radii of their classes, or are scaled together to them. */
static void test_radii_of_lines(void **state)
{
    (void)state;
    static const struct {
        uint8_t axis;
        int n;
        float radius;
    } line[] = {{0, 10, 2.0f}, {0, 30, 3.0f}, {1, 20, 5.0f}};
    for (int way = 0; way < 4; way++) { /* shared or by class, of a class or of each line */
        const bool per_axis = way % 2 == 1, single = way / 2 == 1;
        struct polyline_set p;
        struct radius_measure m = {.per_axis = per_axis};
        polyline_set_init(&p);
        for (size_t l = 0; l < 3; l++) {
            assert_int_equal(polyline_begin(&p, line[l].axis, NULL), STATUS_OK);
            for (int i = 0; i < line[l].n; i++)
                assert_int_equal(polyline_add(&p, (const float[3]){(float)i, 0.0f, 0.0f}, NULL), STATUS_OK);
            p.radius[l] = line[l].radius;
        }
        const double first = sqrt((10 * 4.0 + 30 * 9.0) / 40.0), all = sqrt((10 * 4.0 + 30 * 9.0 + 20 * 25.0) / 60.0);
        radius_measure_lines(&p, 0.25, &m);
        assert_true(fabs(m.radius_voxel[0] - (per_axis ? first : all)) < 1e-6);
        assert_true(fabs(m.radius_voxel[1] - (per_axis ? 5.0 : all)) < 1e-6);
        assert_true(fabs(m.radius_voxel[2] - all) < 1e-6);
        for (int a = 0; a < 3; a++) {
            assert_true(m.se_voxel[a] == 0.25);
            m.radius_voxel[a] *= 2.0;
        }
        polylines_set_radii(&p, &m, single);
        for (size_t l = 0; l < 3; l++) {
            const double want = single ? 2.0 * (double)line[l].radius : m.radius_voxel[line[l].axis];
            assert_true(fabs((double)p.radius[l] - want) < 1e-5);
        }
        polyline_set_release(&p);
    }
}

/* Sums of correlated values scatter as the pieces show, and not as independent values would. */
static void test_scatter_of_correlated_values(void **state)
{
    (void)state;
    enum { N = 4000, RUN = 10 };
    static float value[N];
    for (int i = 0; i < N; i++) value[i] = (i / RUN) % 2 == 0 ? 1.0f : -1.0f; /* runs of ten: variance 400 x 10^2 */
    assert_true(fabs(axis_scatter(value, 1, N, RUN) / (400.0 * 100.0) - 1.0) < 0.01);
    assert_true(fabs(axis_scatter(value, 1, N, 1) / N - 1.0) < 0.01); /* as if they were independent */
    assert_true(fabs(axis_scatter(value, 2, N / 2, RUN / 2) / (400.0 * 25.0) - 1.0) < 0.01);
    assert_true(isinf(axis_scatter(value, 1, RUN, RUN)));
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_scatter_of_correlated_values),
                                       cmocka_unit_test(test_best_score), cmocka_unit_test(test_score),
                                       cmocka_unit_test(test_error_by_leaving_out_parts),
                                       cmocka_unit_test(test_radii_of_lines)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
