/* The geometry of a scan by slabs over two ranks: the same bits as by one rank alone. Orders that make no sense are
 * refused. */
#include "base/ranks/byte_pack.h"
#include "geometry/fibers/axes/axis_share.h"
#include "geometry/filter/direction_share.h"
#include "geometry/filter/filter_rows.h"
#include "geometry/reconstruct/reconstruct.h"
#include "geometry/reconstruct/trace_job.h"
#include "tests/support/ranks/two_ranks.h"
#include "tests/support/scan/scan_files.h"

#include <math.h>
#include <setjmp.h>
#include <signal.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>

#include <cmocka.h>

enum { NX = 44, NY = 208, NZ = 38, N_CYLINDER = 9 };
static const double voxel_m[3] = {2e-6, 2e-6, 2e-6};
/* Fibers in all directions, of radii that differ, across the border between the ranks and along it. */
static const struct test_cylinder cylinder[N_CYLINDER] = {
    {{10, 0, 8}, {0.1, 1, 0.02}, 2.6}, {{30, 0, 10}, {-0.05, 1, 0.05}, 2.2}, {{22, 0, 20}, {0.02, 1, -0.04}, 2.9},
    {{0, 30, 28}, {1, 0.2, 0}, 2.5},   {{0, 103, 29}, {1, 0.02, 0}, 2.4},    {{0, 150, 27}, {1, -0.3, 0.1}, 2.6},
    {{36, 60, 0}, {0.1, 0.3, 1}, 2.5}, {{6, 104, 0}, {0.05, 0.1, 1}, 2.3},   {{40, 190, 19}, {1, 0.8, 0.4}, 2.7}};

static struct volume scan;

struct geometry {
    struct reconstruct_option o;
    struct reconstruct_report r;
    struct direction_volume d;
    struct fiber_set f;
};

static struct geometry alone; /* by one rank; tests only read it */

/* Directions and fibers. */
static status reconstruct(struct thread_pool *pool, const struct progress *progress, struct geometry *g,
                          struct error *err)
{
    memset(g, 0, sizeof *g);
    reconstruct_option_default(&g->o);
    g->o.fiber_diameter_voxel = 5.0;
    fiber_set_init(&g->f);
    status s = reconstruct_orientation(&scan, &g->o, pool, progress, &g->d, &g->r, err);
    g->r.noise.scan_sd = 0.4; /* stated, so that lines are traced for their directions as in noisy scans */
    if (s == STATUS_OK) s = reconstruct_redirect(&scan, &g->d, &g->o, pool, progress, &g->r, err);
    return s == STATUS_OK ? reconstruct_fibers(&scan, &g->d, &g->o, pool, progress, &g->f, &g->r, err) : s;
}

static void release(struct geometry *g)
{
    direction_volume_release(&g->d);
    fiber_set_release(&g->f);
}

static int make_scan(void **state)
{
    (void)state;
    const size_t n[3] = {NX, NY, NZ};
    signal(SIGPIPE, SIG_IGN);
    if (volume_init(&scan, n, voxel_m, NULL) != STATUS_OK) return 1;
    test_fill_cylinders(&scan, cylinder, N_CYLINDER, 0.1, 3);
    for (size_t i = 0; i < volume_n_voxel(n); i++) scan.density[i] = fminf(1.0f, fmaxf(0.0f, scan.density[i]));
    return reconstruct(NULL, NULL, &alone, NULL) != STATUS_OK;
}

static int release_scan(void **state)
{
    (void)state;
    release(&alone);
    volume_release(&scan);
    return 0;
}

static void assert_same(const struct geometry *b)
{
    const struct geometry *a = &alone;
    const size_t n = volume_n_voxel(scan.n);
    assert_memory_equal(a->d.density, b->d.density, n);
    assert_memory_equal(a->d.octahedral, b->d.octahedral, 4 * n);
    assert_int_equal(a->r.n_material_voxel, b->r.n_material_voxel);
    assert_int_equal(a->r.n_kept_voxel, b->r.n_kept_voxel);
    assert_int_equal(a->f.n_fiber, b->f.n_fiber);
    assert_int_equal(a->f.n_vertex, b->f.n_vertex);
    assert_memory_equal(a->f.position_m, b->f.position_m, 3 * a->f.n_vertex * sizeof *a->f.position_m);
    assert_memory_equal(a->f.radius_m, b->f.radius_m, a->f.n_fiber * sizeof *a->f.radius_m);
    assert_true((a->f.shape != NULL) == (b->f.shape != NULL));
    if (a->f.shape != NULL) assert_memory_equal(a->f.shape, b->f.shape, a->f.n_vertex * sizeof *a->f.shape);
    assert_memory_equal(&a->r.axis_position_se_m, &b->r.axis_position_se_m, sizeof a->r.axis_position_se_m);
}

static void two_ranks_find_the_same_fibers(void **state)
{
    (void)state;
    struct geometry together;
    struct error err = {0};
    assert_true(alone.f.n_fiber >= N_CYLINDER - 2);
    for (size_t n_thread = 1; n_thread <= 2; n_thread++) {
        struct two_ranks r;
        two_ranks_start(&r, n_thread);
        assert_int_equal(reconstruct(r.pool, NULL, &together, &err), STATUS_OK);
        assert_same(&together);
        const struct rank_traffic t = rank_team_traffic(r.team);
        assert_true(t.n_share > 10 && t.n_own < t.n_task); /* directions and rounds of the fit */
        release(&together);
        assert_int_equal(two_ranks_end(&r), 0);
    }
}

/* Finds what one line along the first cylinder leaves of the scan, of which the other ranks have slabs. */
static void look_again(struct thread_pool *pool, struct polyline_set *lines)
{
    struct volume v = scan;
    struct volume_slabs slabs;
    struct direction_volume d = {0};
    struct reconstruct_option o = alone.o;
    struct reconstruct_report report = {.radius_spread = 0.2};
    struct trace_job job = {.v = &v, .d = &d, .o = &o, .pool = pool, .report = &report, .diameter = 5.0};
    struct error err = {0};
    polyline_set_init(lines);
    assert_int_equal(polyline_begin(lines, 1, &err), STATUS_OK);
    lines->radius[0] = (float)cylinder[0].radius;
    for (int j = 0; j < NY; j++) {
        const float y = (float)j + 0.5f, x[3] = {10.0f + 0.1f * y, y, 8.0f + 0.02f * y};
        assert_int_equal(polyline_add(lines, x, &err), STATUS_OK);
    }
    job.inner = progress_of_part(&job.part);
    job.profile = trace_start_profile(&job);
    assert_int_equal(volume_slabs_share(&slabs, thread_pool_team(pool), &v, &err), STATUS_OK);
    if (trace_leftover(&job, lines, &err) != STATUS_OK) fail_msg("%s", err.text);
    volume_slabs_release(&slabs);
}

/* The directions of what is left are found amid the fits, whose slabs the ranks have again afterwards. */
static void a_second_look_at_the_scan_is_shared(void **state)
{
    (void)state;
    struct two_ranks r;
    struct polyline_set a, b;
    look_again(NULL, &a);
    two_ranks_start(&r, 1);
    look_again(r.pool, &b);
    assert_true(a.n_line > 3);
    assert_int_equal(a.n_line, b.n_line);
    assert_int_equal(a.n_vertex, b.n_vertex);
    assert_memory_equal(a.vertex, b.vertex, a.n_vertex * sizeof *a.vertex);
    assert_memory_equal(a.radius, b.radius, a.n_line * sizeof *a.radius);
    polyline_set_release(&a);
    polyline_set_release(&b);
    assert_int_equal(two_ranks_end(&r), 0);
}

/* One row at a time, with no more than what surrounds it: a halo that is too short would change some of them. */
static void rows_depend_on_no_more_than_their_halo(void **state)
{
    (void)state;
    const struct reconstruct_option *o = &alone.o;
    struct reconstruct_option again = alone.o;
    struct reconstruct_report r = {0};
    struct direction_volume whole, part; /* directions of the filter */
    struct volume slab;
    struct error err = {0};
    assert_int_equal(reconstruct_orientation(&scan, &again, NULL, NULL, &whole, &r, &err), STATUS_OK);
    const size_t align = filter_rows_alignment(5.0), halo = filter_rows_halo(o, 5.0);
    for (size_t begin = halo; begin + 1 < NY - halo; begin += 29) { /* rows far from the faces, one at a time */
        const size_t from = (begin - halo) / align * align, n[3] = {NX, begin + 1 + halo - from, NZ};
        const size_t row[2] = {begin - from, begin - from + 1};
        assert_int_equal(volume_init(&slab, n, voxel_m, &err), STATUS_OK);
        for (size_t k = 0; k < NZ; k++)
            memcpy(slab.density + volume_index(n, 0, 0, k), scan.density + volume_index(scan.n, 0, from, k),
                   n[0] * n[1] * sizeof *slab.density);
        assert_int_equal(filter_rows(&slab, row, 5.0, o, NULL, NULL, &part, &err), STATUS_OK);
        for (size_t k = 0; k < NZ; k++) {
            const size_t a = volume_index(n, 0, row[0], k), b = volume_index(scan.n, 0, begin, k);
            assert_memory_equal(part.density + a, whole.density + b, NX);
            assert_memory_equal(part.octahedral + 2 * a, whole.octahedral + 2 * b, 4 * NX);
        }
        direction_volume_release(&part);
        volume_release(&slab);
    }
    direction_volume_release(&whole);
}

static void set_cancel(void *context, double fraction)
{
    if (fraction > 0.3) atomic_store((atomic_bool *)context, true);
}

static void a_cancelled_geometry_leaves_no_trace(void **state)
{
    (void)state;
    struct geometry together;
    struct two_ranks r;
    struct error err = {0};
    struct fiber_set f;
    atomic_bool cancel = false;
    const struct progress progress = {.report = set_cancel, .context = &cancel, .cancel = &cancel};
    two_ranks_start(&r, 1);
    assert_int_equal(reconstruct(r.pool, &progress, &together, &err), STATUS_CANCELLED); /* amid the directions */
    release(&together);
    atomic_store(&cancel, false);
    together = alone; /* its options and its report */
    fiber_set_init(&f);
    assert_int_equal(reconstruct_fibers(&scan, &alone.d, &together.o, r.pool, &progress, &f, &together.r, &err),
                     STATUS_CANCELLED); /* amid the fits */
    fiber_set_release(&f);
    assert_int_equal(reconstruct(r.pool, NULL, &together, &err), STATUS_OK);
    assert_same(&together);
    release(&together);
    assert_int_equal(two_ranks_end(&r), 0);
}

static void a_lost_helper_ends_the_geometry(void **state)
{
    (void)state;
    struct geometry g;
    struct two_ranks r;
    struct error err = {0};
    two_ranks_start(&r, 1);
    kill(r.helper, SIGKILL);
    assert_int_equal(reconstruct(r.pool, NULL, &g, &err), STATUS_IO);
    assert_true(rank_team_broken(r.team));
    release(&g);
    assert_int_equal(WTERMSIG(two_ranks_end(&r)), SIGKILL);
}

/* ---- orders that make no sense ---- */

static void order(struct two_ranks *r, uint32_t kind, const struct byte_pack *p)
{
    assert_int_equal(rank_team_order(r->team, kind, p->data, p->n, NULL), STATUS_OK);
}

/* Asks for the bricks of the whole volume, and expects that the helper cannot. */
static void assert_refused(struct two_ranks *r, const char *text)
{
    struct error err = {0};
    const struct bricks_order all = {0, (size_t)2 * 7 * 2};
    assert_int_equal(rank_team_order(r->team, RANK_ORDER_BRICKS, &all, sizeof all, &err), STATUS_OK);
    assert_int_equal(rank_team_gather(r->team, &err), STATUS_FORMAT);
    if (strstr(err.text, text) == NULL) fail_msg("'%s' is not in '%s'", text, err.text);
}

enum wrong_slab {
    NO_VOXELS,
    HUGE,
    OF_OTHER_RANKS,
    FALLING_COLUMNS,
    MISSING_COLUMNS,
    SHORT,
    NO_ALIGNMENT,
    N_WRONG_SLAB
};

static void wrong_slabs_are_refused(void **state)
{
    (void)state;
    struct two_ranks r;
    two_ranks_start(&r, 1);
    for (int wrong = 0; wrong < N_WRONG_SLAB; wrong++) {
        struct byte_pack p = {0};
        struct slab_order o = {.n = {NX, NY, NZ}, .align = 1, .n_rank = 2, .voxel_size_m = {2e-6, 2e-6, 2e-6}};
        uint64_t first[3] = {0, 7, 14};
        if (wrong == NO_VOXELS) o.n[2] = 0;
        if (wrong == HUGE) o.n[0] = o.n[1] = o.n[2] = 1 << 20;
        if (wrong == OF_OTHER_RANKS) o.n_rank = 3;
        if (wrong == FALLING_COLUMNS) first[1] = 15;
        if (wrong == MISSING_COLUMNS) first[2] = 13;
        if (wrong == NO_ALIGNMENT) o.align = 0;
        BYTE_PACK(&p, o);
        byte_pack_put(&p, first, (wrong == SHORT ? 2 : 3) * sizeof *first);
        order(&r, RANK_ORDER_SLAB, &p);
        assert_refused(&r, wrong == FALLING_COLUMNS || wrong == MISSING_COLUMNS ? "columns that do not exist"
                           : wrong == SHORT                                     ? "wrong length"
                                                                                : "slab of another rank is none");
        byte_pack_release(&p);
    }
    assert_int_equal(two_ranks_end(&r), 0);
}

/* Sends the helper a slab, its rows up to slice n_slice, and the lines that the caller makes wrong. */
static void send_slab(struct two_ranks *r, size_t n_slice)
{
    struct byte_pack p = {0}, q = {0};
    const struct slab_order o = {.n = {NX, NY, NZ}, .align = 1, .n_rank = 2, .voxel_size_m = {2e-6, 2e-6, 2e-6}};
    const uint64_t first[3] = {0, 7, 14};
    const struct rows_order rows = {0, n_slice};
    BYTE_PACK(&p, o);
    BYTE_PACK(&p, first);
    order(r, RANK_ORDER_SLAB, &p);
    BYTE_PACK(&q, rows);
    for (size_t k = 0; k < n_slice; k++)
        byte_pack_put(&q, scan.density + volume_index(scan.n, 0, 96, k), (size_t)(NY - 96) * NX * sizeof(float));
    if (n_slice > 0) order(r, RANK_ORDER_ROWS, &q);
    byte_pack_release(&p);
    byte_pack_release(&q);
}

enum wrong_lines {
    NOT_A_NUMBER,
    FAR_AWAY,
    FALLING_VERTICES,
    TOO_MANY,
    NO_BLUR,
    HUGE_BLUR,
    WITHOUT_ROWS,
    ROWS_OF_TOO_MANY_SLICES,
    WITHOUT_LINES,
    FOLLOWS_NOTHING,
    N_WRONG_LINES
};

static void wrong_lines_and_rows_are_refused(void **state)
{
    (void)state;
    struct two_ranks r;
    two_ranks_start(&r, 1);
    for (int wrong = 0; wrong < N_WRONG_LINES; wrong++) {
        struct byte_pack p = {0};
        struct axes_order o;
        memset(&o, 0, sizeof o);
        o.n_line = 2;
        o.n_vertex = 6;
        o.blur = 0.8;
        o.high = 1.0;
        uint64_t first[3] = {0, 3, 6};
        float vertex[6][3] = {{5, 5, 5}, {6, 5, 5}, {7, 5, 5}, {5, 150, 5}, {6, 150, 5}, {7, 150, 5}};
        const float radius[2] = {2.5f, 2.5f};
        if (wrong == NOT_A_NUMBER) vertex[4][1] = NAN;
        if (wrong == FAR_AWAY) vertex[4][1] = 1e30f;
        if (wrong == FALLING_VERTICES) first[1] = 7;
        if (wrong == TOO_MANY) o.n_line = UINT64_MAX / 4;
        if (wrong == NO_BLUR) o.blur = 0.0;
        if (wrong == HUGE_BLUR) o.blur = 1e300;
        if (wrong == FOLLOWS_NOTHING) o.follows = 1;
        send_slab(&r, wrong == WITHOUT_ROWS ? 0 : wrong == ROWS_OF_TOO_MANY_SLICES ? NZ - 1 : NZ);
        if (wrong == ROWS_OF_TOO_MANY_SLICES) {
            const struct rows_order rows = {NZ - 1, 2};
            BYTE_PACK(&p, rows);
            for (int k = 0; k < 2; k++) byte_pack_put(&p, scan.density, (size_t)(NY - 96) * NX * sizeof(float));
            order(&r, RANK_ORDER_ROWS, &p);
            byte_pack_release(&p);
        }
        BYTE_PACK(&p, o);
        BYTE_PACK(&p, first);
        BYTE_PACK(&p, vertex);
        BYTE_PACK(&p, radius);
        if (wrong != WITHOUT_LINES) order(&r, RANK_ORDER_AXES, &p);
        byte_pack_release(&p);
        assert_refused(&r, wrong == TOO_MANY                  ? "wrong length"
                           : wrong == WITHOUT_ROWS            ? "slab that it has not sent"
                           : wrong == ROWS_OF_TOO_MANY_SLICES ? "densities of a slab that are none"
                           : wrong == WITHOUT_LINES           ? "lines that are not there"
                           : wrong == FOLLOWS_NOTHING         ? "goes on with a fit of lines that are not there"
                                                              : "lines of another rank are none");
    }
    assert_int_equal(two_ranks_end(&r), 0);
}

static void work_that_does_not_fit_the_slab_is_refused(void **state)
{
    (void)state;
    struct two_ranks r;
    struct error err = {0};
    struct directions_order o = {.diameter_voxel = 5.0, .s = 0.1, .t = 0.3, .eps_d = 0.3, .eps_j = -10.0, .h = 9};
    two_ranks_start(&r, 1);
    send_slab(&r, NZ); /* without a halo */
    for (int wrong = 0; wrong < 2; wrong++) {
        if (wrong == 1) o.s = NAN;
        assert_int_equal(rank_team_order(r.team, RANK_ORDER_DIRECTIONS, &o, sizeof o, &err), STATUS_OK);
        assert_int_equal(rank_team_gather(r.team, &err), STATUS_FORMAT);
        assert_non_null(strstr(err.text, "directions of fibers that cannot be"));
    }
    assert_int_equal(two_ranks_end(&r), 0);
}

int main(void)
{
    const struct CMUnitTest test[] = {cmocka_unit_test(two_ranks_find_the_same_fibers),
                                      cmocka_unit_test(a_second_look_at_the_scan_is_shared),
                                      cmocka_unit_test(rows_depend_on_no_more_than_their_halo),
                                      cmocka_unit_test(a_cancelled_geometry_leaves_no_trace),
                                      cmocka_unit_test(a_lost_helper_ends_the_geometry),
                                      cmocka_unit_test(wrong_slabs_are_refused),
                                      cmocka_unit_test(wrong_lines_and_rows_are_refused),
                                      cmocka_unit_test(work_that_does_not_fit_the_slab_is_refused)};
    return cmocka_run_group_tests(test, make_scan, release_scan);
}
