/* Ends in the middle of material, and the rounds of fitting, cutting and joining before the last fit. */
#include "geometry/fibers/lines/line_ends.h"
#include "geometry/reconstruct/trace_job.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>

#include <cmocka.h>

enum { N_FIBER = 2 };

static const size_t n_voxel[3] = {120, 40, 32};
static const double voxel_m[3] = {2e-6, 2e-6, 2e-6};
/* Straight fibers along x that touch: their places in y and radii. */
static const double Y[N_FIBER] = {16.0, 22.6}, RADIUS[N_FIBER] = {3.6, 3.0};
static const double Z = 16.0, BLUR = 0.8;

static void draw(struct volume *v, struct direction_volume *d, double end_x)
{
    assert_int_equal(volume_init(v, n_voxel, voxel_m, NULL), STATUS_OK);
    assert_int_equal(direction_volume_init(d, n_voxel, voxel_m, NULL), STATUS_OK);
    for (size_t at = 0; at < volume_n_voxel(n_voxel); at++) {
        const double x = (double)(at % n_voxel[0]) + 0.5, y = (double)(at / n_voxel[0] % n_voxel[1]) + 0.5,
                     z = (double)(at / (n_voxel[0] * n_voxel[1])) + 0.5;
        double density = 0.0;
        for (int f = 0; f < N_FIBER && x < end_x; f++)
            density += 0.5 * erfc((hypot(y - Y[f], z - Z) - RADIUS[f]) / (M_SQRT2 * BLUR));
        v->density[at] = (float)fmin(1.0, density);
        d->density[at] = v->density[at] > 0.5f ? 255 : 0;
        if (d->density[at] > 0) direction_volume_set(d, at, (float[3]){1.0f, 0.0f, 0.0f});
    }
}

/* A line from x0 to x1 that goes from fiber `from` to fiber `to` between x = 50 and 70. */
static void add_line(struct polyline_set *p, float x0, float x1, int from, int to)
{
    assert_int_equal(polyline_begin(p, 0, NULL), STATUS_OK);
    p->radius[p->n_line - 1] = (float)(0.5 * (RADIUS[from] + RADIUS[to]));
    for (float x = x0; x <= x1; x += 1.0f) {
        const float way = fminf(1.0f, fmaxf(0.0f, (x - 50.0f) / 20.0f));
        const float y = (float)Y[from] + way * (float)(Y[to] - Y[from]);
        assert_int_equal(polyline_add(p, (const float[3]){x, y, (float)Z}, NULL), STATUS_OK);
    }
}

/* Ends at a face of the volume, and at the end of the material, are no lost ones. */
static void test_lost_ends(void **state)
{
    (void)state;
    struct volume v;
    struct direction_volume d;
    struct polyline_set lines;
    draw(&v, &d, 100.0);
    polyline_set_init(&lines);
    add_line(&lines, 0.5f, 99.5f, 0, 0);
    assert_int_equal(polylines_count_lost_ends(&lines, &v, 0.5, 3.5), 0);
    add_line(&lines, 20.5f, 99.5f, 1, 1);
    assert_int_equal(polylines_count_lost_ends(&lines, &v, 0.5, 3.5), 1);
    add_line(&lines, 20.5f, 80.5f, 0, 0);
    assert_int_equal(polylines_count_lost_ends(&lines, &v, 0.5, 3.5), 3);
    polyline_set_release(&lines);
    direction_volume_release(&d);
    volume_release(&v);
}

/* A line that goes on with the neighbour of its fiber, and pieces of both fibers that end beside it: the last rounds
 * give each fiber a line of its own. */
static void test_changed_line(void **state)
{
    (void)state;
    struct volume v;
    struct direction_volume d;
    struct polyline_set lines;
    struct reconstruct_option o;
    struct reconstruct_report report = {.radius_spread = 0.1};
    struct thread_pool *pool = NULL;
    reconstruct_option_default(&o);
    o.eps_d = 0.5;
    draw(&v, &d, INFINITY);
    polyline_set_init(&lines);
    add_line(&lines, 0.5f, 119.5f, 0, 1);
    add_line(&lines, 68.5f, 119.5f, 0, 0);
    add_line(&lines, 0.5f, 52.5f, 1, 1);
    assert_int_equal(thread_pool_new(1, &pool, NULL), STATUS_OK);
    struct trace_job job = {
        .v = &v, .d = &d, .o = &o, .pool = pool, .report = &report, .diameter = 6.6, .independent = 1.0};
    job.inner = progress_of_part(&job.part);
    job.profile = trace_start_profile(&job);
    assert_int_equal(trace_finish(&job, &lines, NULL), STATUS_OK);
    for (size_t l = 0; l < lines.n_line; l++) {
        const float *a = lines.vertex[lines.first[l]], *b = lines.vertex[lines.first[l + 1] - 1];
        print_message("line %zu: %zu vertices from x %.1f, y %.2f to %.1f, %.2f, radius %.2f\n", l,
                      polyline_length(&lines, l), (double)a[0], (double)a[1], (double)b[0], (double)b[1],
                      (double)lines.radius[l]);
    }
    assert_int_equal(lines.n_line, N_FIBER);
    for (size_t l = 0; l < lines.n_line; l++) {
        const int f = fabs((double)lines.vertex[lines.first[l]][1] - Y[0]) < 2.0 ? 0 : 1;
        assert_true(polyline_length(&lines, l) > 110);
        for (size_t i = lines.first[l]; i < lines.first[l + 1]; i++)
            assert_true(fabs((double)lines.vertex[i][1] - Y[f]) < 1.0);
    }
    polyline_set_release(&lines);
    direction_volume_release(&d);
    volume_release(&v);
    thread_pool_free(pool);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_lost_ends), cmocka_unit_test(test_changed_line)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
