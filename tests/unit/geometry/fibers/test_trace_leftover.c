/* A thin fiber between three thick ones that touch it, of which only the thick ones have lines: the second look finds
 * it where radii differ. It is left out where fibers are alike, and where radii spread like those of no yarn. Flat
 * fibers leave nothing at their sides. */
#include "geometry/phantom/phantom_section.h"
#include "geometry/reconstruct/trace_job.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>

#include <cmocka.h>

enum { LENGTH = 80, WIDTH = 48, N_LINE = 3 };

/* y, z and radius of the axes, which run along x; the thin one is the last. */
static const double fiber[N_LINE + 1][3] = {{17.0, 18.0, 3.8}, {29.2, 18.0, 3.8}, {23.1, 28.6, 3.8}, {23.1, 21.6, 2.9}};

static void draw(struct volume *v)
{
    const size_t n[3] = {LENGTH, WIDTH, WIDTH};
    const double voxel_m[3] = {2e-6, 2e-6, 2e-6};
    assert_int_equal(volume_init(v, n, voxel_m, NULL), STATUS_OK);
    for (size_t at = 0; at < volume_n_voxel(n); at++) {
        const double y = (double)(at / LENGTH % WIDTH) + 0.5, z = (double)(at / (LENGTH * WIDTH)) + 0.5;
        double sum = 0.0;
        for (int i = 0; i <= N_LINE; i++)
            sum += 0.5 * erfc((hypot(y - fiber[i][0], z - fiber[i][1]) - fiber[i][2]) / (sqrt(2.0) * 0.75));
        v->density[at] = (float)fmin(1.0, sum);
    }
}

static void add_thick_lines(struct polyline_set *lines)
{
    for (int l = 0; l < N_LINE; l++) {
        assert_int_equal(polyline_begin(lines, 0, NULL), STATUS_OK);
        lines->radius[l] = (float)fiber[l][2];
        for (int i = 0; i < LENGTH; i++) {
            const float x[3] = {(float)i + 0.5f, (float)fiber[l][0], (float)fiber[l][1]};
            assert_int_equal(polyline_add(lines, x, NULL), STATUS_OK);
        }
    }
}

static void test_thin_fiber_is_found(void **state)
{
    (void)state;
    static const double spread[3] = {0.2, 0.03, 0.4};
    for (int k = 0; k < 3; k++) {
        const bool differ = k == 0;
        struct volume v;
        struct direction_volume d = {0};
        struct polyline_set lines;
        struct reconstruct_option o;
        struct reconstruct_report report = {.radius_spread = spread[k]};
        struct thread_pool *pool = NULL;
        reconstruct_option_default(&o);
        o.eps_d = 0.5;
        draw(&v);
        polyline_set_init(&lines);
        add_thick_lines(&lines);
        assert_int_equal(thread_pool_new(1, &pool, NULL), STATUS_OK);
        struct trace_job job = {.v = &v, .d = &d, .o = &o, .pool = pool, .report = &report, .diameter = 7.2};
        job.inner = progress_of_part(&job.part);
        job.profile = trace_start_profile(&job);
        assert_int_equal(trace_leftover(&job, &lines, NULL), STATUS_OK);
        assert_int_equal(lines.n_line, differ ? N_LINE + 1 : N_LINE);
        if (differ) {
            const size_t n = polyline_length(&lines, N_LINE), middle = lines.first[N_LINE] + n / 2;
            print_message("%zu vertices, radius %.2f, axis off by %.2f, %.2f\n", n, (double)lines.radius[N_LINE],
                          (double)lines.vertex[middle][1] - fiber[N_LINE][0],
                          (double)lines.vertex[middle][2] - fiber[N_LINE][1]);
            assert_true(n > LENGTH - 12 && fabs((double)lines.radius[N_LINE] - fiber[N_LINE][2]) < 0.3);
            for (int a = 1; a < 3; a++) assert_true(fabs((double)lines.vertex[middle][a] - fiber[N_LINE][a - 1]) < 0.3);
        }
        polyline_set_release(&lines);
        volume_release(&v);
        thread_pool_free(pool);
    }
}

/* A flat fiber with one line: subtracted as the disc of equal area, it leaves two fibers at its sides, and nothing with
 * its section. */
static void test_flat_fiber_leaves_nothing(void **state)
{
    (void)state;
    const struct phantom_section flat = {.aspect = 2.5};
    const size_t n[3] = {LENGTH, WIDTH, WIDTH};
    const double voxel_m[3] = {2e-6, 2e-6, 2e-6};
    size_t n_line[2];
    for (int with_section = 0; with_section < 2; with_section++) {
        struct volume v;
        struct direction_volume d = {0};
        struct polyline_set lines;
        struct reconstruct_option o;
        struct reconstruct_report report = {.radius_spread = 0.2};
        struct thread_pool *pool = NULL;
        reconstruct_option_default(&o);
        o.eps_d = 0.5;
        assert_int_equal(volume_init(&v, n, voxel_m, NULL), STATUS_OK);
        for (size_t at = 0; at < volume_n_voxel(n); at++)
            v.density[at] = (float)phantom_section_share(&flat, 3.8, (double)(at / LENGTH % WIDTH) + 0.5 - 23.6,
                                                         (double)(at / (LENGTH * WIDTH)) + 0.5 - 24.2);
        polyline_set_init(&lines);
        assert_int_equal(polyline_begin(&lines, 0, NULL), STATUS_OK);
        lines.radius[0] = 3.8f;
        for (int i = 0; i < LENGTH; i++)
            assert_int_equal(polyline_add(&lines, (float[3]){(float)i + 0.5f, 23.6f, 24.2f}, NULL), STATUS_OK);
        if (with_section) assert_int_equal(polyline_shapes_init(&lines, NULL), STATUS_OK);
        for (size_t i = 0; i < lines.n_vertex && with_section; i++) {
            lines.shape[i].ratio = 2.5f;
            lines.shape[i].long_axis[1] = 1.0f;
        }
        assert_int_equal(thread_pool_new(1, &pool, NULL), STATUS_OK);
        struct trace_job job = {.v = &v, .d = &d, .o = &o, .pool = pool, .report = &report, .diameter = 7.2};
        job.inner = progress_of_part(&job.part);
        job.profile = trace_start_profile(&job);
        assert_int_equal(trace_leftover(&job, &lines, NULL), STATUS_OK);
        assert_null(lines.shape);
        n_line[with_section] = lines.n_line;
        polyline_set_release(&lines);
        volume_release(&v);
        thread_pool_free(pool);
    }
    print_message("lines after a disc was subtracted %zu, after the section %zu\n", n_line[0], n_line[1]);
    assert_true(n_line[0] > 1);
    assert_int_equal(n_line[1], 1);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_thin_fiber_is_found),
                                       cmocka_unit_test(test_flat_fiber_leaves_nothing)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
