/* Filtered shadows of a cloth on a plane: the whole sum and the four passes against many rays and each other. */
#include "renderer/mesh/mesh_shapes.h"
#include "renderer/preview/ground_plane.h"
#include "renderer/preview/ground_shadow.h"
#include "tests/support/cloth/dual_cloth.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { PX = 64 };

/* Whether a pixel shows the plane alone, and the plane has shadow or penumbra there. */
static bool shows_plane(const struct ground_plane *g, size_t i)
{
    double p[3];
    for (int k = 0; k < 9; k++) {
        double xy[2] = {((double)(i % PX) + 0.5 * (k % 3)) / PX, ((double)(i / PX) + 0.5 * (k / 3)) / PX};
        if (!ground_plane_seen(g, xy, p)) return false;
    }
    return true;
}

/* Root mean square of the differences in red over pixels of the plane, over their mean. */
static double apart(const struct ground_plane *g, const struct image *a, const struct image *b)
{
    double sum = 0, mean = 0, n = 0;
    for (size_t i = 0; i < PX * PX; i++) {
        double p = (double)a->pixel[i * a->n_channel], q = (double)b->pixel[i * b->n_channel];
        if (!shows_plane(g, i)) continue;
        sum += (p - q) * (p - q);
        mean += q;
        n++;
    }
    assert_true(n > PX * PX / 2);
    return sqrt(sum / n) / (mean / n);
}

static void bend(struct dual_cloth *c, struct scene **bent)
{
    struct mesh m = {0};
    struct error err = {0};
    dual_cloth_weave(c, 0.6, NULL);
    if (mesh_flat((const double[2]){10, 10}, (const size_t[2]){1, 1}, &m, &err) != STATUS_OK ||
        scene_bend(c->scene, &m, true, bent, &err) != STATUS_OK)
        fail_msg("%s", err.text);
    mesh_release(&m);
}

static struct configuration view_from_above(void)
{
    return (struct configuration){.light_theta_rad = 0.7,
                                  .light_phi_rad = 0.3,
                                  .camera_theta_rad = 0.5,
                                  .camera_phi_rad = 4,
                                  .light_distance_m = 0.3,
                                  .lamp_side_m = 0.06,
                                  .camera_distance_m = 1,
                                  .crop_m = 0.03};
}

static void a_cloth_over_a_plane(void **state)
{
    (void)state;
    struct dual_cloth c;
    struct scene *bent;
    struct image few, many, passes, whole, again;
    struct error err = {0};
    struct thread_pool *pool;
    bend(&c, &bent);
    const struct configuration view = view_from_above();
    struct ground_request q = {bent, &view, ground_below(bent, 8), 100, 0.5, NULL, PX, PX, 1024, 3, 0};
    assert_true(q.z_mm < -8 && q.z_mm > -9);
    assert_int_equal(thread_pool_new(2, &pool, &err), STATUS_OK);
    if (ground_render(&q, pool, NULL, &many, &err) != STATUS_OK) fail_msg("%s", err.text);
    q.n_sample = 16;
    q.stream = 1;
    if (ground_render(&q, pool, NULL, &few, &err) != STATUS_OK) fail_msg("%s", err.text);
    struct ground_filter how = {4, false};
    if (ground_render_filtered(&q, &how, pool, NULL, &passes, &err) != STATUS_OK) fail_msg("%s", err.text);
    if (ground_render_filtered(&q, &how, NULL, NULL, &again, &err) != STATUS_OK) fail_msg("%s", err.text);
    how.whole = true;
    if (ground_render_filtered(&q, &how, pool, NULL, &whole, &err) != STATUS_OK) fail_msg("%s", err.text);
    struct ground_plane g;
    assert_int_equal(ground_plane_init(&g, &q, &err), STATUS_OK);
    double noise = apart(&g, &few, &many), error = apart(&g, &passes, &many), error_whole = apart(&g, &whole, &many);
    double both = apart(&g, &passes, &whole);
    print_message("cloth over a plane, 16 rays a pixel: %.4f, filtered by passes %.4f, whole %.4f; apart %.4f\n", noise,
                  error, error_whole, both);
    assert_true(error < 0.5 * noise && error_whole < 0.5 * noise && both < 0.006);
    assert_memory_equal(passes.pixel, again.pixel, PX * PX * 3 * sizeof(float));
    image_release(&few), image_release(&many), image_release(&passes), image_release(&whole), image_release(&again);
    thread_pool_free(pool);
    scene_free(bent);
    dual_cloth_release(&c);
}

/* A lamp or a camera under the plane, and a sharp shadow, are refused; a cancelled rendering leaves nothing. */
static void faults_are_refused(void **state)
{
    (void)state;
    struct dual_cloth c;
    struct scene *bent;
    struct image im;
    struct error err = {0};
    atomic_bool cancel = true;
    bend(&c, &bent);
    struct configuration view = view_from_above();
    struct ground_request q = {bent, &view, -9, 100, 0.5, NULL, PX, PX, 16, 3, 0};
    const struct ground_filter how = {4, false};
    const struct progress cancelled = {.cancel = &cancel};
    assert_int_equal(ground_render(&q, NULL, &cancelled, &im, &err), STATUS_CANCELLED);
    assert_int_equal(ground_render_filtered(&q, &how, NULL, &cancelled, &im, &err), STATUS_CANCELLED);
    assert_int_equal(ground_render_filtered(&q, &(struct ground_filter){9, false}, NULL, NULL, &im, &err),
                     STATUS_INVALID);
    q.scene = c.scene;
    assert_int_equal(ground_render(&q, NULL, NULL, &im, &err), STATUS_INVALID);
    q.scene = bent;
    view.light_theta_rad = 2;
    assert_int_equal(ground_render(&q, NULL, NULL, &im, &err), STATUS_INVALID);
    assert_non_null(strstr(err.text, "above it"));
    view.light_theta_rad = 0.7;
    view.light = LIGHT_DIRECTIONAL;
    assert_int_equal(ground_render_filtered(&q, &how, NULL, NULL, &im, &err), STATUS_INVALID);
    assert_non_null(strstr(err.text, "sharp"));
    view.light = LIGHT_GAUSSIAN;
    view.light_sharpness = 100;
    assert_int_equal(ground_render_filtered(&q, &how, NULL, NULL, &im, &err), STATUS_INVALID);
    assert_non_null(strstr(err.text, "Gaussian"));
    view.light = LIGHT_DIRECTIONAL;
    assert_int_equal(ground_render(&q, NULL, NULL, &im, &err), STATUS_OK);
    image_release(&im);
    scene_free(bent);
    dual_cloth_release(&c);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_cloth_over_a_plane),
        cmocka_unit_test(faults_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
