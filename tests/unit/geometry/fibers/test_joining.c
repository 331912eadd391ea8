/* Joins of lines that were fitted: the scan decides whether two ends are one fiber, and sections are kept. */
#include "geometry/fibers/lines/joining.h"
#include "tests/support/scan/scan_files.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>

#include <cmocka.h>

static const double DIAMETER = 4.6, BLUR = 0.7;
static const size_t n_voxel[3] = {64, 40, 32};

/* Straight fibers along x at these places along y. */
static void make_volume(struct volume *v, const double *y, size_t n_fiber)
{
    static const double voxel_m[3] = {2e-6, 2e-6, 2e-6};
    assert_int_equal(volume_init(v, n_voxel, voxel_m, NULL), STATUS_OK);
    for (size_t k = 0; k < n_voxel[2]; k++)
        for (size_t j = 0; j < n_voxel[1]; j++)
            for (size_t i = 0; i < n_voxel[0]; i++) {
                double density = 0.0;
                for (size_t f = 0; f < n_fiber; f++) {
                    const double d = hypot((double)j + 0.5 - y[f], (double)k + 0.5 - 16.0);
                    density += 0.5 * erfc((d - 0.5 * DIAMETER) / (M_SQRT2 * BLUR));
                }
                v->density[volume_index(n_voxel, i, j, k)] = (float)fmin(1.0, density);
            }
}

static void add_piece(struct polyline_set *p, float x0, float x1, float y0, float y1)
{
    const float step = x0 < x1 ? 1.0f : -1.0f;
    assert_int_equal(polyline_begin(p, 0, NULL), STATUS_OK);
    p->radius[p->n_line - 1] = (float)(0.5 * DIAMETER);
    for (float x = x0; (x1 - x) * step >= 0.0f; x += step) {
        const float y = y0 + (y1 - y0) * (x - x0) / (x1 - x0);
        assert_int_equal(polyline_add(p, (const float[3]){x, y, 16.0f}, NULL), STATUS_OK);
    }
}

static size_t count_joined(const struct volume *v, const struct polyline_set *lines, double blur)
{
    struct polyline_set out;
    struct join_counts counts = {0};
    polyline_set_init(&out);
    assert_int_equal(polylines_join(lines, v, &(struct join_option){DIAMETER, 0.5, blur, NULL}, &out, &counts, NULL),
                     STATUS_OK);
    assert_int_equal(out.n_line + counts.n_gap_bridged + counts.n_joined, lines->n_line);
    polyline_set_release(&out);
    return counts.n_gap_bridged + counts.n_joined;
}

/* Two pieces of one fiber are joined. So are, by their shape alone, lines on two fibers that touch; but that scan is
 * not as with one fiber. */
static void test_scan_decides(void **state)
{
    (void)state;
    struct volume one, two;
    struct polyline_set lines;
    const double y[2] = {16.0, 20.6};
    polyline_set_init(&lines);
    add_piece(&lines, 2.5f, 29.5f, 16.0f, 16.0f);
    add_piece(&lines, 34.5f, 61.5f, 16.0f, 16.0f);
    make_volume(&one, y, 1);
    assert_int_equal(count_joined(&one, &lines, 0.0), 1);
    assert_int_equal(count_joined(&one, &lines, BLUR), 1);
    volume_release(&one);
    polyline_set_release(&lines);

    polyline_set_init(&lines);
    add_piece(&lines, 2.5f, 29.5f, 16.0f, 16.0f);
    add_piece(&lines, 34.5f, 61.5f, 20.6f, 20.6f);
    make_volume(&two, y, 2);
    assert_int_equal(count_joined(&two, &lines, 0.0), 1);
    assert_int_equal(count_joined(&two, &lines, BLUR), 0);
    volume_release(&two);
    polyline_set_release(&lines);
}

/* Sections go with their vertices, whichever way a line runs, and change evenly over the gap. */
static void test_sections_are_kept(void **state)
{
    (void)state;
    struct volume v;
    struct polyline_set lines, out;
    struct join_counts counts = {0};
    const double y[1] = {16.0};
    make_volume(&v, y, 1);
    polyline_set_init(&lines);
    polyline_set_init(&out);
    add_piece(&lines, 2.5f, 29.5f, 16.0f, 16.0f);
    add_piece(&lines, 61.5f, 34.5f, 16.0f, 16.0f);
    assert_int_equal(polyline_shapes_init(&lines, NULL), STATUS_OK);
    lines.radius[0] = 3.4f;
    lines.radius[1] = 3.6f;
    for (size_t i = 0; i < lines.n_vertex; i++) {
        lines.shape[i].radius = i < lines.first[1] ? 3.4f : 3.6f;
        lines.shape[i].ratio = 1.0f + 0.01f * lines.vertex[i][0];
        lines.shape[i].ratio_se = 0.1f;
    }
    assert_int_equal(polylines_join(&lines, &v, &(struct join_option){DIAMETER, 0.5, BLUR, NULL}, &out, &counts, NULL),
                     STATUS_OK);
    assert_int_equal(out.n_line, 1);
    assert_non_null(out.shape);
    for (size_t i = 0; i < out.n_vertex; i++) {
        const float x = out.vertex[i][0], way = fminf(1.0f, fmaxf(0.0f, (x - 29.5f) / 5.0f));
        assert_float_equal(out.shape[i].ratio, 1.0f + 0.01f * x, 0.004f);
        assert_float_equal(out.shape[i].ratio_se, 0.1f, 1e-6f);
        assert_float_equal(out.shape[i].radius, 3.4f + 0.2f * way, 0.01f);
    }
    assert_float_equal(out.radius[0], 3.5f, 0.01f);
    polyline_set_release(&lines);
    polyline_set_release(&out);
    volume_release(&v);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_scan_decides),
        cmocka_unit_test(test_sections_are_kept),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
