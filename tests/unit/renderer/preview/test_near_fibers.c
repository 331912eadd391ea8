/* Fibers for close views: the visible ones are there; what they see of the sky; their lobes; their number. */
#include "renderer/preview/near_fibers.h"

#include "base/rng.h"
#include "renderer/scene/scene_ray.h"
#include "tests/support/cloth/hand_weave.h"
#include "tests/support/tracer/trace_input.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { MANY = 100000, RAYS = 2000 };
static const double grey[3] = {0.8, 0.6, 0.4}; /* of isotropic.v1 */
static struct appearance model;

static struct scene *small_cloth(bool black_sheet)
{
    struct fiber_set f;
    struct scene *scene = NULL;
    struct error err = {0};
    hand_weave_small(&f);
    if (scene_new(&f, &(struct scene_option){black_sheet}, &scene, &err) != STATUS_OK) fail_msg("%s", err.text);
    fiber_set_release(&f);
    return scene;
}

static void make(const struct scene *scene, size_t most, size_t n_thread, struct near_fibers *f)
{
    struct radiance_input in = trace_input_surface(scene, scattering_find("isotropic.v1"), grey, &model);
    struct thread_pool *pool = NULL;
    struct error err = {0};
    assert_int_equal(thread_pool_new(n_thread, &pool, &err), STATUS_OK);
    if (near_fibers_make(&in, most, pool, NULL, f, &err) != STATUS_OK) fail_msg("%s", err.text);
    thread_pool_free(pool);
}

/* Distance of a place from a segment of the endless cloth, in radii. */
static double radii_from(const float at[3], const struct near_point *p, const double tile[2])
{
    double q[3], along[3], dot = 0.0, length2 = 0.0, off2 = 0.0;
    for (int a = 0; a < 3; a++) {
        along[a] = (double)(p[1].position_mm[a] - p[0].position_mm[a]);
        q[a] = (double)(at[a] - p[0].position_mm[a]);
        if (a < 2) q[a] -= tile[a] * round((q[a] - 0.5 * along[a]) / tile[a]);
        dot += q[a] * along[a];
        length2 += along[a] * along[a];
    }
    for (int a = 0; a < 3; a++) {
        const double d = q[a] - fmin(fmax(dot / length2, 0.0), 1.0) * along[a];
        off2 += d * d;
    }
    return sqrt(off2) / (double)p->radius_mm;
}

static void what_is_seen_is_there(void **state)
{
    (void)state;
    struct scene *scene = small_cloth(true);
    struct near_fibers f;
    double tile[2];
    size_t n_hit = 0, n_there = 0;
    make(scene, MANY, 2, &f);
    scene_tile_mm(scene, tile);
    struct rng r;
    rng_start(&r, &(struct rng_key){1, 0, 0, 0}, 0, 0);
    for (size_t i = 0; i < RAYS; i++) {
        const double origin[3] = {rng_double(&r) * tile[0], rng_double(&r) * tile[1], 1.0}, down[3] = {0.0, 0.0, -1.0};
        struct scene_ray ray;
        struct scene_hit hit;
        if (!scene_ray_enter(scene, origin, down, &ray) || !scene_trace(scene, &ray, &hit)) continue;
        double least = INFINITY;
        for (size_t k = 0; k + 1 < f.n_point; k++)
            if (!f.point[k].is_last) least = fmin(least, radii_from(hit.position_mm, &f.point[k], tile));
        n_hit++;
        n_there += least < 1.2;
    }
    assert_true(n_hit > RAYS / 4);
    assert_true((double)n_there > 0.98 * (double)n_hit);
    near_fibers_release(&f);
    scene_free(scene);
}

static void the_sky_and_the_sheet(void **state)
{
    (void)state;
    struct scene *covered = small_cloth(true), *open = small_cloth(false);
    struct near_fibers f, g;
    uint64_t above = 0, below = 0;
    make(covered, MANY, 1, &f);
    make(open, MANY, 3, &g);
    assert_true(f.n_point >= 2 && g.n_point >= f.n_point);
    assert_true(f.point[f.n_point - 1].is_last);
    for (size_t k = 0; k < f.n_point; k++) {
        assert_true(f.point[k].open[1] == 0);
        above |= f.point[k].open[0];
        assert_true(f.point[k].position_mm[2] + f.point[k].radius_mm < 1e-3f);
    }
    for (size_t k = 0; k < g.n_point; k++) below |= g.point[k].open[1];
    assert_true(above == UINT64_MAX); /* the highest fiber sees all */
    assert_true(below != 0);
    near_fibers_release(&f);
    near_fibers_release(&g);
    scene_free(covered);
    scene_free(open);
}

static void lobes_and_limits(void **state)
{
    (void)state;
    struct scene *scene = small_cloth(true);
    struct near_fibers f, g;
    make(scene, MANY, 1, &f);
    assert_int_equal(f.n_set, 1);
    for (size_t i = 0; i < 3 * NEAR_LOBE_CELLS; i++)
        assert_true(fabs((double)f.lobe[i] - grey[i % 3] / (M_PI * M_PI)) < 1e-5);
    make(scene, MANY, 3, &g);
    assert_int_equal(f.n_point, g.n_point);
    for (size_t k = 0; k < f.n_point; k++)
        assert_memory_equal(f.point[k].open, g.point[k].open, sizeof f.point[k].open);
    near_fibers_release(&g);
    make(scene, 1, 1, &g); /* a line has two points */
    assert_int_equal(g.n_point, 0);
    near_fibers_release(&g);
    near_fibers_release(&f);
    scene_free(scene);
}

int main(void)
{
    const struct CMUnitTest test[] = {
        cmocka_unit_test(what_is_seen_is_there),
        cmocka_unit_test(the_sky_and_the_sheet),
        cmocka_unit_test(lobes_and_limits),
    };
    return cmocka_run_group_tests(test, NULL, NULL);
}
