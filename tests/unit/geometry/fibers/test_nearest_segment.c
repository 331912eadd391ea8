/* Which voxels belong to each line, and to which of its segments, against a search of all segments. */
#include "geometry/fibers/axes/model/nearest_segment.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { N_LINE = 4, NX = 45, NY = 39, NZ = 37 };
static const size_t N[3] = {NX, NY, NZ};
static const float TAIL = 1.7f;
static const double EDGE = 1e-3; /* voxels this near to the reach may belong to it or not */

/* Lines along every axis and askew, that bend, have a kink, and leave the volume. */
static void make_lines(struct polyline_set *lines)
{
    static const float begin[N_LINE][3] = {{-3, 18, 20}, {21, -2, 14}, {30, 30, -1}, {4, 5, 6}};
    static const float along[N_LINE][3] = {{1, 0.05f, 0.1f}, {0.02f, 1, -0.1f}, {0, -0.1f, 1}, {0.6f, 0.55f, 0.58f}};
    polyline_set_init(lines);
    for (size_t l = 0; l < N_LINE; l++) {
        float x[3] = {begin[l][0], begin[l][1], begin[l][2]};
        assert_int_equal(polyline_begin(lines, 0, NULL), STATUS_OK);
        for (int i = 0; i < 48; i++) {
            assert_int_equal(polyline_add(lines, x, NULL), STATUS_OK);
            for (int a = 0; a < 3; a++)
                x[a] += along[l][a] + 0.3f * sinf(0.3f * (float)i + (float)(a + (int)l)) +
                        (i == 25 && a == 1 ? 0.9f : 0.0f);
        }
        lines->radius[l] = 2.0f + 0.6f * (float)l;
    }
}

static double distance_of(const struct segment *g, const double p[3], double *t)
{
    double along = 0.0, length2 = 0.0, d2 = 0.0;
    for (int a = 0; a < 3; a++) {
        const double u = (double)g->b[a] - (double)g->a[a];
        along += u * (p[a] - (double)g->a[a]);
        length2 += u * u;
    }
    *t = along / length2;
    const double s = fmin(1.0, fmax(0.0, *t));
    for (int a = 0; a < 3; a++) {
        const double d = p[a] - (double)g->a[a] - s * ((double)g->b[a] - (double)g->a[a]);
        d2 += d * d;
    }
    return sqrt(d2);
}

/* Least distance of a voxel from a line, and whether it lies beside it, not beyond an end. */
static double nearest_of(const struct segment_bricks *b, uint32_t line, const double p[3], bool *beside)
{
    double least = INFINITY;
    for (size_t i = 0; i < b->n_segment; i++) {
        double t;
        if (b->segment[i].line != line) continue;
        const double d = distance_of(&b->segment[i], p, &t);
        if (!(d < least)) continue;
        least = d;
        *beside = !(b->segment[i].is_first && t < 0.0) && !(b->segment[i].is_last && t > 1.0);
    }
    return least;
}

/* Compares the nearest segments in one brick with the search, and counts them. */
static size_t check_brick(const struct segment_bricks *b, struct nearest_segments *c, size_t i_brick)
{
    static bool found[N_LINE][AXIS_N_CELL];
    const size_t n_segment = b->first[i_brick + 1] - b->first[i_brick];
    size_t from[3], n[3];
    memset(found, 0, sizeof found);
    segment_brick_box(b, i_brick, from, n);
    assert_true(nearest_segments_find(c, b, NULL, TAIL, i_brick));
    for (size_t e = 0; e < n_segment; e++)
        for (size_t i = c->first[e]; i < c->first[e + 1]; i++) {
            const struct segment *g = &b->segment[b->index[b->first[i_brick] + e]];
            const size_t x[3] = {c->cell[i] % AXIS_BRICK, c->cell[i] / AXIS_BRICK % AXIS_BRICK,
                                 c->cell[i] / (AXIS_BRICK * AXIS_BRICK)};
            double p[3], t;
            bool beside = false;
            for (int a = 0; a < 3; a++) {
                assert_true(x[a] < n[a]);
                p[a] = (double)(from[a] + x[a]) + 0.5;
            }
            assert_false(found[g->line][c->cell[i]]);
            found[g->line][c->cell[i]] = true;
            assert_true(distance_of(g, p, &t) < nearest_of(b, g->line, p, &beside) + EDGE);
        }
    for (uint32_t l = 0; l < N_LINE; l++)
        for (uint32_t at = 0; at < AXIS_N_CELL; at++) {
            const size_t x[3] = {at % AXIS_BRICK, at / AXIS_BRICK % AXIS_BRICK, at / (AXIS_BRICK * AXIS_BRICK)};
            if (x[0] >= n[0] || x[1] >= n[1] || x[2] >= n[2]) continue;
            const double p[3] = {(double)(from[0] + x[0]) + 0.5, (double)(from[1] + x[1]) + 0.5,
                                 (double)(from[2] + x[2]) + 0.5};
            bool beside = false;
            const double d = nearest_of(b, l, p, &beside), reach = 2.0 + 0.6 * l + (double)TAIL;
            if (fabs(d - reach) > EDGE && beside) assert_int_equal(found[l][at], d < reach);
        }
    return c->first[n_segment];
}

static void test_voxels_belong_to_the_nearest_segments(void **state)
{
    (void)state;
    struct polyline_set lines;
    struct segment_bricks bricks;
    struct nearest_segments *c = malloc(sizeof *c);
    size_t n_voxel = 0;
    assert_non_null(c);
    make_lines(&lines);
    nearest_segments_init(c);
    assert_int_equal(segment_bricks_init(&bricks, &lines, N, AXIS_BRICK, 6.0f, NULL), STATUS_OK);
    for (size_t b = 0; b < segment_n_brick(&bricks); b++) n_voxel += check_brick(&bricks, c, b);
    assert_true(n_voxel > 4000);
    /* a second visit finds the work as clean as the first */
    size_t again = 0;
    for (size_t b = 0; b < segment_n_brick(&bricks); b++) again += check_brick(&bricks, c, b);
    assert_int_equal(again, n_voxel);
    segment_bricks_release(&bricks);
    nearest_segments_release(c);
    free(c);
    polyline_set_release(&lines);
}

int main(void)
{
    const struct CMUnitTest test[] = {cmocka_unit_test(test_voxels_belong_to_the_nearest_segments)};
    return cmocka_run_group_tests(test, NULL, NULL);
}
