/* Sheared filtering of soft shadows: both versions against the closed form of a half plane's shadow and against a fine
 * quadrature of two occluders, against each other, and on a cloth over a plane against many rays. */
#include "base/rng.h"
#include "renderer/mesh/mesh_shapes.h"
#include "renderer/preview/ground_plane.h"
#include "renderer/preview/ground_shadow.h"
#include "renderer/preview/sheared_filter.h"
#include "tests/support/cloth/dual_cloth.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { EDGE = 72 };
static const double half_side = 50, cell = 2e-4, receiver_depth = 500;

/* Half planes parallel to the lamp: hidden is where x + s y < at, along the first or the second edge. */
struct half_plane {
    double depth, at; /* at in x */
    int edge;
};
static const struct half_plane one[] = {{440, 0, 0}}, two[] = {{440, 2e-3, 0}, {380, -1e-3, 1}};

static double slope_of(const struct half_plane *h) { return 1 / h->depth - 1 / receiver_depth; }

static bool hidden(const struct half_plane *h, size_t n, const double x[2], const double y[2])
{
    for (size_t i = 0; i < n; i++)
        if (x[h[i].edge] + slope_of(&h[i]) * y[h[i].edge] < h[i].at) return true;
    return false;
}

static double x_of(size_t i) { return cell * ((double)i - EDGE / 2 + 0.25); }

/* Rays of all receivers; their slopes are known to 10 %. */
static void sample(const struct half_plane *h, size_t n, size_t n_side, struct light_field *f)
{
    struct rng rng;
    rng_start(&rng, &(struct rng_key){.seed = 11}, 0, 0);
    assert_int_equal(light_field_init(f, EDGE, EDGE, n_side, NULL), STATUS_OK);
    f->cell[0] = f->cell[1] = cell;
    f->half_side_mm = half_side;
    for (size_t i = 0; i < EDGE * EDGE; i++) {
        for (int a = 0; a < 2; a++) f->jitter[i][a] = (float)rng_double(&rng);
        for (size_t j = 0; j < n_side * n_side; j++) {
            const double x[2] = {x_of(i % EDGE), x_of(i / EDGE)},
                         y[2] = {light_field_place_mm(f, i, 0, j % n_side), light_field_place_mm(f, i, 1, j / n_side)};
            for (size_t k = 0; k < n; k++) {
                if (!hidden(&h[k], 1, x, y)) continue;
                f->lit[i * n_side * n_side + j] = 0;
                light_field_meet(f, i, 0.9 * slope_of(&h[k]));
                light_field_meet(f, i, 1.1 * slope_of(&h[k]));
            }
        }
    }
    assert_int_equal(light_field_smooth_slopes(f, NULL), STATUS_OK);
}

/* What a receiver sees of the lamp, by 100 x 100 places on it. */
static double true_visibility(const struct half_plane *h, size_t n, enum sheared_lamp lamp, const double x[2])
{
    double sum = 0, all = 0;
    for (int i = 0; i < 100 * 100; i++) {
        const double u[2] = {(i % 100 + 0.5) / 50 - 1, (i / 100 + 0.5) / 50 - 1},
                     y[2] = {u[0] * half_side, u[1] * half_side};
        double weight = lamp == SHEARED_SQUARE_LAMP ? 1 : exp(-2 * (u[0] * u[0] + u[1] * u[1]));
        all += weight;
        if (!hidden(h, n, x, y)) sum += weight;
    }
    return sum / all;
}

static double own_rays(const struct light_field *f, size_t i)
{
    size_t n = f->n_side * f->n_side, sum = 0;
    for (size_t j = 0; j < n; j++) sum += f->lit[i * n + j];
    return (double)sum / (double)n;
}

struct errors {
    double own, whole, passes, apart;
};

/* Root mean squares over receivers whose filter lies within the grid. */
static struct errors errors_of(const struct half_plane *h, size_t n, enum sheared_lamp lamp, size_t n_side)
{
    static float whole[EDGE * EDGE], passes[EDGE * EDGE];
    struct light_field f;
    struct errors e = {0, 0, 0, 0};
    double count = 0;
    sample(h, n, n_side, &f);
    assert_int_equal(sheared_filter_whole(&f, lamp, NULL, NULL, whole, NULL), STATUS_OK);
    assert_int_equal(sheared_filter_passes(&f, lamp, NULL, NULL, passes, NULL), STATUS_OK);
    for (size_t y = SHEARED_REACH; y < EDGE - SHEARED_REACH; y++)
        for (size_t x = SHEARED_REACH; x < EDGE - SHEARED_REACH; x++, count++) {
            size_t i = y * EDGE + x;
            double truth = true_visibility(h, n, lamp, (const double[2]){x_of(x), x_of(y)});
            e.own += pow(own_rays(&f, i) - truth, 2);
            e.whole += pow((double)whole[i] - truth, 2);
            e.passes += pow((double)passes[i] - truth, 2);
            e.apart += pow((double)whole[i] - (double)passes[i], 2);
        }
    light_field_release(&f);
    double *v[] = {&e.own, &e.whole, &e.passes, &e.apart};
    for (int k = 0; k < 4; k++) *v[k] = sqrt(*v[k] / count);
    print_message("%zu occluders, %s lamp, %zu rays: own %.4f, whole %.4f, passes %.4f; apart %.4f\n", n,
                  lamp == SHEARED_SQUARE_LAMP ? "square" : "Gaussian", n_side * n_side, e.own, e.whole, e.passes,
                  e.apart);
    return e;
}

/* The filter takes nine tenths of the noise away and more, and the four passes give what the whole sum gives. */
static void shadows_are_near_their_closed_forms(void **state)
{
    (void)state;
    static const struct {
        enum sheared_lamp lamp;
        size_t n_side;
    } tried[] = {{SHEARED_GAUSSIAN_LAMP, 4}, {SHEARED_SQUARE_LAMP, 4}, {SHEARED_SQUARE_LAMP, 2}};
    for (size_t i = 0; i < sizeof tried / sizeof *tried; i++)
        for (int both = 0; both < 2; both++) {
            struct errors e = errors_of(both ? two : one, both ? 2 : 1, tried[i].lamp, tried[i].n_side);
            assert_true(e.whole < 0.1 * e.own && e.passes < 0.1 * e.own);
            assert_true(e.whole < 0.012 && e.passes < 0.015 && e.apart < 0.008);
        }
}

/* Without an occluder all is lit; a place whose rays have met something at no distance keeps its own rays. */
static void places_without_slopes_keep_their_rays(void **state)
{
    (void)state;
    struct light_field f;
    static float v[EDGE * EDGE];
    assert_int_equal(light_field_init(&f, EDGE, EDGE, 3, NULL), STATUS_OK);
    f.cell[0] = f.cell[1] = cell;
    f.half_side_mm = half_side;
    f.lit[(size_t)(10 * EDGE + 10) * 9 + 4] = 0;
    for (int whole = 0; whole < 2; whole++) {
        status s = (whole ? sheared_filter_whole : sheared_filter_passes)(&f, SHEARED_SQUARE_LAMP, NULL, NULL, v, NULL);
        assert_int_equal(s, STATUS_OK);
        for (size_t i = 0; i < EDGE * EDGE; i++)
            assert_true(fabsf(v[i] - (i == 10 * EDGE + 10 ? 8.0f / 9 : 1)) < 1e-6f);
    }
    light_field_release(&f);
    struct error err = {0};
    assert_int_equal(light_field_init(&f, EDGE, EDGE, LIGHT_FIELD_MAX_SIDE + 1, &err), STATUS_INVALID);
    assert_non_null(strstr(err.text, "rays a side"));
    light_field_release(&f);
}

/* ---- a cloth over a plane ---- */

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
        cmocka_unit_test(shadows_are_near_their_closed_forms),
        cmocka_unit_test(places_without_slopes_keep_their_rays),
        cmocka_unit_test(a_cloth_over_a_plane),
        cmocka_unit_test(faults_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
