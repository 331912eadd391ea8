/* Sections along fibers with their errors (geometry/fibers/axes/shape_measure.h), on fibers of known sections:
 * radius, ratio of axes and turn of the long axis differ from the truth by as much as their errors say, for white and
 * for correlated noise, and a radius counts as varying only where it does. The same of the lumens of hollow fibers
 * (geometry/fibers/shape/axes/lumen). */
#include "base/rng.h"
#include "geometry/fibers/axes/flat_fit.h"
#include "geometry/fibers/axes/hollow_fit.h"
#include "geometry/phantom/phantom_section.h"
#include "geometry/volume/noise_smoothing.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>

#include <cmocka.h>

/* A fiber along x in the middle of the volume. */
struct test_fiber {
    double ratio, taper, radius; /* the radius falls by 2 taper from one end to the other; radius: its mean, voxels */
    double turn_rad;             /* over the whole length */
    double lumen, lumen_change;  /* width of the lumen in the middle, and its change over the whole length */
    double blur;                 /* of the scan, voxels; 0: that of a voxel only */
    double slope;                /* of the axis, so that it passes voxels at all places */
};

enum { LENGTH = 200, WIDTH = 26 };

static double radius_at(const struct test_fiber *f, double x)
{
    return f->radius * (1.0 + f->taper * (1.0 - 2.0 * x / LENGTH));
}

static double lumen_at(const struct test_fiber *f, double x) { return f->lumen + f->lumen_change * (x / LENGTH - 0.5); }

static double angle_at(const struct test_fiber *f, double x) { return -0.4 + f->turn_rad * x / LENGTH; }

/* Independent noise, or means over cubes of two voxels of it, with the same standard deviation. */
static void add_noise(struct volume *v, double sd, bool correlated, uint64_t seed)
{
    const size_t n = volume_n_voxel(v->n);
    float *white = malloc(n * sizeof *white);
    struct rng rng;
    assert_non_null(white);
    rng_start(&rng, &(struct rng_key){.seed = seed}, 0, 0);
    for (size_t i = 0; i < n; i++) {
        double normal[2];
        rng_normal_pair(&rng, normal);
        white[i] = (float)normal[0];
    }
    for (size_t k = 0; k < v->n[2]; k++)
        for (size_t j = 0; j < v->n[1]; j++)
            for (size_t i = 0; i < v->n[0]; i++) {
                double sum = 0.0;
                for (size_t c = 0; c < 8; c++)
                    sum += (double)white[volume_index(v->n, (i + (c & 1)) % v->n[0], (j + (c >> 1 & 1)) % v->n[1],
                                                      (k + (c >> 2)) % v->n[2])];
                const size_t at = volume_index(v->n, i, j, k);
                v->density[at] += (float)(sd * (correlated ? sum / sqrt(8.0) : (double)white[at]));
            }
    free(white);
}

static void draw(struct volume *v, const struct test_fiber *f)
{
    for (size_t k = 0; k < v->n[2]; k++)
        for (size_t j = 0; j < v->n[1]; j++)
            for (size_t i = 0; i < v->n[0]; i++) {
                const double x = (double)i + 0.5, y = (double)j + 0.5 - 13.1 - f->slope * (x - 0.5 * LENGTH),
                             z = (double)k + 0.5 - 12.8 - 0.6 * f->slope * (x - 0.5 * LENGTH), c = cos(angle_at(f, x)),
                             s = sin(angle_at(f, x));
                const struct phantom_section section = {.aspect = f->ratio, .lumen = lumen_at(f, x)};
                v->density[volume_index(v->n, i, j, k)] =
                    (float)phantom_section_share(&section, radius_at(f, x), c * y + s * z, c * z - s * y);
            }
}

/* Sums over some vertices of some fibers. A pull is a normalised error: error over standard error. */
struct pulls {
    double radius, ratio, angle, n, radius_error, ratio_error, angle_error;
    size_t n_varying;
};

/* Errors of the radius count without their mean over the fiber, which the model of the blur shares with all fibers. */
static void add_pulls(const struct polyline_set *lines, const struct test_fiber *f, struct pulls *p)
{
    double shift = 0.0, n = 0.0;
    for (size_t i = 12; i + 12 < lines->n_vertex; i++, n += 1.0)
        shift += (double)lines->shape[i].radius - radius_at(f, (double)lines->vertex[i][0]);
    shift /= n;
    for (size_t i = 12; i + 12 < lines->n_vertex; i += 14) {
        const struct fiber_shape *s = &lines->shape[i];
        const double x = (double)lines->vertex[i][0], angle = atan2((double)s->long_axis[2], (double)s->long_axis[1]);
        const double turn = remainder(angle - angle_at(f, x), M_PI), ratio = (double)s->ratio - f->ratio,
                     radius = (double)s->radius - shift - radius_at(f, x);
        p->radius += pow(radius / (double)s->radius_se, 2.0);
        p->ratio += pow(ratio / (double)s->ratio_se, 2.0);
        p->angle += pow(turn / (double)s->angle_se_rad, 2.0);
        p->radius_error += radius * radius;
        p->ratio_error += ratio * ratio;
        p->angle_error += turn * turn;
        p->n += 1.0;
    }
}

/* Makes the scan of a fiber, and a line near its axis. */
static void make_scan(const struct test_fiber *f, double noise, bool correlated, int seed, struct volume *v,
                      struct polyline_set *lines)
{
    const size_t n[3] = {LENGTH, WIDTH, WIDTH};
    const double voxel_m[3] = {2e-6, 2e-6, 2e-6};
    assert_int_equal(volume_init(v, n, voxel_m, NULL), STATUS_OK);
    draw(v, f);
    if (f->blur > 0.0) assert_int_equal(volume_smooth_noise(v, f->blur, NULL, NULL), STATUS_OK);
    add_noise(v, noise, correlated, (uint64_t)seed);
    polyline_set_init(lines);
    assert_int_equal(polyline_begin(lines, 0, NULL), STATUS_OK);
    lines->radius[0] = 3.2f;
    for (int i = 0; i < LENGTH; i++) {
        const float x = (float)i + 0.5f, bend = (float)f->slope * (x - 0.5f * LENGTH);
        assert_int_equal(polyline_add(lines, (float[3]){x, 13.4f + bend, 12.6f + 0.6f * bend}, NULL), STATUS_OK);
    }
}

static const struct axis_profile start_profile = {
    .radius = 3.2, .radius_spread = 0.3, .blur = 0.8, .high = 1.0, .independent = 1.0, .measured_curvature = true};

static struct pulls measure(const struct test_fiber *f, double noise, bool correlated, int n_fiber)
{
    struct pulls p = {0};
    for (int k = 0; k < n_fiber; k++) {
        struct volume v;
        struct polyline_set lines;
        struct section_ratio found;
        struct shape_measure m;
        struct axis_profile profile = start_profile;
        make_scan(f, noise, correlated, k + 1, &v, &lines);
        const struct flat_fit fit = {&v, 7.0, 6, 4, NULL, NULL, &m};
        assert_int_equal(polylines_fit_flat(&lines, &fit, &profile, &found, NULL), STATUS_OK);
        assert_int_equal(lines.n_line, 1);
        assert_non_null(lines.shape);
        p.n_varying += m.n_varying;
        add_pulls(&lines, f, &p);
        polyline_set_release(&lines);
        volume_release(&v);
    }
    return p;
}

static void test_errors_are_those_found(void **state)
{
    (void)state;
    enum { N = 8 };
    static const struct test_fiber fiber[] = {{1.6, 0.0, 3.5, 0.8}, {2.5, 0.0, 3.5, 0.8}, {1.6, 0.15, 3.5, 0.8}};
    for (size_t i = 0; i < sizeof fiber / sizeof *fiber; i++)
        for (int correlated = 0; correlated < 2; correlated++) {
            const struct pulls p = measure(&fiber[i], 0.2, correlated == 1, N);
            const double radius = sqrt(p.radius / p.n), ratio = sqrt(p.ratio / p.n), turn = sqrt(p.angle / p.n);
            print_message("ratio %.1f, taper %.2f, %s noise: %zu of %d vary; pulls of radius %.2f, ratio %.2f, turn "
                          "%.2f; errors %.3f voxels, %.3f, %.2f degrees\n",
                          fiber[i].ratio, fiber[i].taper, correlated ? "correlated" : "white", p.n_varying, N, radius,
                          ratio, turn, sqrt(p.radius_error / p.n), sqrt(p.ratio_error / p.n),
                          sqrt(p.angle_error / p.n) * 180.0 / M_PI);
            /* a section that is flat and tapers has errors of the model beside those of the noise */
            assert_true(ratio > 0.7 && ratio < (fiber[i].taper > 0.0 ? 2.0 : 1.5) && turn > 0.7 && turn < 1.5);
            assert_true(sqrt(p.ratio_error / p.n) < 0.05 && sqrt(p.angle_error / p.n) < 0.03);
            if (fiber[i].taper > 0.0) {
                assert_int_equal(p.n_varying, N);
                assert_true(radius > 0.7 && radius < 1.4 && sqrt(p.radius_error / p.n) < 0.03);
            } else {
                assert_int_equal(p.n_varying, 0);
            }
        }
}

/* A disc comes out as one, and its radius varies only where it does. */
static void test_discs(void **state)
{
    (void)state;
    enum { N = 8 };
    static const double taper[3] = {0.0, 0.01, 0.12};
    for (int k = 0; k < 3; k++) {
        const struct test_fiber f = {1.0, taper[k], 3.5, 0.0};
        const struct pulls p = measure(&f, 0.2, k == 0, N);
        print_message("disc, taper %.2f: %zu of %d vary, ratio off by %.3f, pull of the radius %.2f\n", taper[k],
                      p.n_varying, N, sqrt(p.ratio_error / p.n), sqrt(p.radius / p.n));
        assert_int_equal(p.n_varying, taper[k] > 0.1 ? N : 0); /* 1 % is below what counts as variation */
        assert_true(sqrt(p.ratio_error / p.n) < 0.04);
    }
}

enum { N_SEED = 6, N_PLACE = 13 };

/* Of the scans of one fiber with different noise. */
struct lumen_errors {
    double error[N_SEED][N_PLACE], se[N_SEED][N_PLACE]; /* of the lumen, and as stated */
    double radius[N_SEED], radius_se[N_SEED];           /* mean of the line over the true one, and its shared error */
    size_t n_varying;
};

static void measure_lumens(const struct test_fiber *f, bool correlated, struct lumen_errors *e)
{
    e->n_varying = 0;
    for (int k = 0; k < N_SEED; k++) {
        struct volume v;
        struct polyline_set lines;
        struct shape_measure m;
        struct axis_profile profile = start_profile;
        make_scan(f, 0.2, correlated, k + 1, &v, &lines);
        assert_int_equal(polyline_shapes_init(&lines, NULL), STATUS_OK);
        const struct hollow_fit fit = {&v, 7.0, NULL, NULL};
        assert_int_equal(polylines_fit_hollow(&lines, &fit, &profile, &m, NULL), STATUS_OK);
        e->n_varying += m.n_varying_lumen;
        e->radius[k] = (double)lines.radius[0] / f->radius;
        e->radius_se[k] = m.shared_radius_se / f->radius;
        for (size_t p = 0; p < N_PLACE; p++) {
            const size_t i = 12 + 14 * p;
            assert_true(i < lines.n_vertex && lines.shape[i].lumen_se > 0.0f);
            e->error[k][p] = (double)lines.shape[i].lumen - lumen_at(f, (double)lines.vertex[i][0]);
            e->se[k][p] = (double)lines.shape[i].lumen_se;
        }
        polyline_set_release(&lines);
        volume_release(&v);
    }
}

/* Root mean square of the differences from the mean over the seeds, over the stated errors. *bias: the mean; *se: root
 * mean square of the stated errors. */
static double pull_of(const double *value, const double *stated, size_t stride, double *bias, double *se)
{
    double mean = 0.0, square = 0.0, variance = 0.0;
    for (size_t k = 0; k < N_SEED; k++) mean += value[k * stride] / N_SEED;
    for (size_t k = 0; k < N_SEED; k++) {
        square += pow((value[k * stride] - mean) / stated[k * stride], 2.0) / (N_SEED - 1);
        variance += pow(stated[k * stride], 2.0) / N_SEED;
    }
    *bias = mean;
    *se = sqrt(variance);
    return sqrt(square);
}

/* What noise makes of a lumen differs between scans of one fiber by no more than the stated errors. These differences
 * are the same all along a fiber whose lumen does not vary, so that their sum of squares has N_SEED - 1 = 5 degrees of
 * freedom, and the pull exceeds 2 in one case of 1,000. The same of the radius. The scan is drawn with voxels that are
 * not means over cubes, which shifts the lumen by up to 0.03 in all scans alike; the mean over seeds and places may
 * exceed that by two of its own errors. Of a single fiber neither the density nor the blur of its walls is known, so
 * that its lumen is known less well than in a cloth: hardly at all where walls are as thin as the blur (a lumen of
 * 0.6). */
static void test_lumens(void **state)
{
    (void)state;
    static const struct test_fiber fiber[] = {
        {1.0, 0.0, 3.5, 0.0, 0.0, 0.0, 0.7, 0.02}, {1.0, 0.0, 3.5, 0.0, 0.2, 0.0, 0.7, 0.02},
        {1.0, 0.0, 3.5, 0.0, 0.4, 0.0, 0.7, 0.02}, {1.0, 0.0, 3.5, 0.0, 0.6, 0.0, 0.7, 0.02},
        {1.6, 0.0, 3.5, 0.8, 0.4, 0.0, 0.7, 0.02}, {1.0, 0.0, 3.5, 0.0, 0.4, 0.3, 0.7, 0.02}};
    for (size_t i = 0; i < sizeof fiber / sizeof *fiber; i++)
        for (int correlated = 0; correlated < 2; correlated++) {
            const struct test_fiber *f = &fiber[i];
            struct lumen_errors e;
            double pull = 0.0, mean = 0.0, bias, se, radius, radius_se, error = 0.0;
            measure_lumens(f, correlated, &e);
            for (size_t p = 0; p < N_PLACE; p++) {
                pull += pow(pull_of(&e.error[0][p], &e.se[0][p], N_PLACE, &bias, &se), 2.0) / N_PLACE;
                mean += bias / N_PLACE;
                for (size_t k = 0; k < N_SEED; k++) error += pow(e.error[k][p], 2.0) / (N_PLACE * N_SEED);
            }
            pull = sqrt(pull);
            error = sqrt(error);
            const double radius_pull = pull_of(e.radius, e.radius_se, 1, &radius, &radius_se);
            print_message("ratio %.1f, lumen %.2f, change %.2f, %s noise: error %.4f, mean %.4f, stated %.4f, "
                          "pull %.2f; radius %.4f, stated error %.4f, pull %.2f; %zu of %d vary\n",
                          f->ratio, f->lumen, f->lumen_change, correlated ? "correlated" : "white", error, mean, se,
                          pull, radius, radius_se, radius_pull, e.n_varying, N_SEED);
            assert_int_equal(e.n_varying, f->lumen_change > 0.0 ? N_SEED : 0);
            assert_true(pull < 2.0 && radius_pull < 2.0);
            assert_true(fabs(mean) < 0.03 + 2.0 * se / sqrt(N_SEED));
            if (f->lumen < 0.5) assert_true(error < (f->lumen_change > 0.0 ? 0.07 : 0.04) && fabs(radius - 1.0) < 0.02);
        }
}

/* A lumen that grows until the walls are a tenth of a voxel: what is measured is within what files may state. */
static void test_widest_lumens(void **state)
{
    (void)state;
    const struct test_fiber f = {1.0, 0.0, 3.5, 0.0, 0.84, 0.26, 0.7, 0.02};
    struct volume v;
    struct polyline_set lines;
    struct shape_measure m;
    struct axis_profile profile = start_profile;
    double widest = 0.0;
    make_scan(&f, 0.02, false, 1, &v, &lines);
    assert_int_equal(polyline_shapes_init(&lines, NULL), STATUS_OK);
    const struct hollow_fit fit = {&v, 7.0, NULL, NULL};
    assert_int_equal(polylines_fit_hollow(&lines, &fit, &profile, &m, NULL), STATUS_OK);
    for (size_t i = 0; i < lines.n_vertex; i++) {
        float number[FIBER_SHAPE_WITH_LUMEN];
        struct fiber_shape read;
        fiber_shape_numbers(&lines.shape[i], number);
        widest = fmax(widest, (double)lines.shape[i].lumen);
        assert_true(fiber_shape_set(&read, number, FIBER_SHAPE_WITH_LUMEN));
        assert_true(read.lumen == lines.shape[i].lumen);
    }
    print_message("widest lumen %.3f of up to 0.97; %zu vary\n", widest, m.n_varying_lumen);
    assert_true(widest > 0.8 && widest < 0.901); /* the bound of the fit */
    polyline_set_release(&lines);
    volume_release(&v);
}

/* Lumen, with its stated error in the middle of a line, of a fiber in a scan with hardly any noise. */
static void measure_quiet_lumen(const struct test_fiber *f, double model_error, double *error, double *stated,
                                double *radius_se)
{
    struct volume v;
    struct polyline_set lines;
    struct shape_measure m;
    struct axis_profile profile = start_profile;
    profile.model_error = model_error;
    make_scan(f, 0.01, false, 1, &v, &lines);
    assert_int_equal(polyline_shapes_init(&lines, NULL), STATUS_OK);
    const struct hollow_fit fit = {&v, 7.0, NULL, NULL};
    assert_int_equal(polylines_fit_hollow(&lines, &fit, &profile, &m, NULL), STATUS_OK);
    const size_t i = lines.n_vertex / 2;
    *error = (double)lines.shape[i].lumen - f->lumen;
    *stated = (double)lines.shape[i].lumen_se;
    *radius_se = m.shared_radius_se;
    polyline_set_release(&lines);
    volume_release(&v);
}

/* Without noise, what shifts a lumen is that the scan is not drawn as the model has it. The stated error covers that
 * once it is told how large the errors of the model are. It still tells something: it stays below the standard
 * deviation of a width that may be any. */
static void test_model_error(void **state)
{
    (void)state;
    static const double lumen[] = {0.3, 0.4, 0.5};
    for (size_t i = 0; i < sizeof lumen / sizeof *lumen; i++) {
        const struct test_fiber f = {1.0, 0.0, 3.5, 0.0, lumen[i], 0.0, 0.7, 0.02};
        double error, noise_only, stated, radius_noise, radius;
        measure_quiet_lumen(&f, 0.0, &error, &noise_only, &radius_noise);
        measure_quiet_lumen(&f, 0.01, &error, &stated, &radius);
        print_message("lumen %.1f: error %.4f, stated %.4f by noise and %.4f with errors of the model; radius %.4f, "
                      "%.4f voxels\n",
                      lumen[i], error, noise_only, stated, radius_noise, radius);
        assert_true(fabs(error) < stated);
        assert_true(stated > noise_only && radius > radius_noise && stated < 0.2);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_errors_are_those_found), cmocka_unit_test(test_discs),
                                       cmocka_unit_test(test_lumens), cmocka_unit_test(test_widest_lumens),
                                       cmocka_unit_test(test_model_error)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
