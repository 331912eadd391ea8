/* Previews of the smooth surface of a bent cloth: a flat piece against closed forms, shadows, light of other folds and
 * a lens on folds against many rays, and the four passes against the whole sum. */
#include "renderer/preview/proxy/proxy_layers.h"
#include "renderer/preview/proxy/proxy_picture.h"
#include "renderer/scene/scene_place.h"
#include "tests/support/cloth/proxy_cloth.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { MOST_PIXEL = 64 * 64, TRUTH_SEEDS = 6 };

static void render(const struct proxy_request *q, struct image *im)
{
    struct error err = {0};
    if (proxy_picture_render(q, NULL, NULL, im, &err) != STATUS_OK) fail_msg("%s", err.text);
}

/* A small lamp on a flat piece: V cos_i / (cos_i + cos_o) in the middle, whose irradiance is that of a facing surface
 * (configuration.h); the lamp's places change both cosines by some 1e-3. Nothing hides it. */
static void a_flat_piece_has_its_closed_form(void **state)
{
    (void)state;
    struct proxy_cloth c;
    struct image im;
    proxy_cloth_init(&c, false);
    c.view.lamp_side_m = 0.01;
    render(&c.q, &im);
    const double ci = cos(c.view.light_theta_rad), co = cos(c.view.camera_theta_rad);
    const float *middle = im.pixel + (32 * 64 + 32) * 6;
    assert_true(fabs((double)middle[1] / (PROXY_CLOTH_VALUE * ci / (ci + co)) - 1) < 0.01);
    assert_true(isnan(middle[4]));
    image_release(&im);
    proxy_cloth_release(&c);
}

/* Under a white sky a piece shows its albedo: the mean of V / (cos_i + cos_o) over both cosines with the density 2 cos
 * each, which is V 4 (2 / 3) (1 - ln 2). A mean over 144 directions each is within 2 %. */
static void a_white_sky_shows_the_albedo(void **state)
{
    (void)state;
    struct proxy_cloth c;
    struct image im;
    proxy_cloth_init(&c, false);
    c.view.light = LIGHT_NO_LAMP;
    for (int k = 0; k < 3; k++) c.view.environment_rgb[k] = 1;
    render(&c.q, &im);
    const double albedo = PROXY_CLOTH_VALUE * 4 * (2.0 / 3.0) * (1 - log(2));
    assert_true(fabs((double)im.pixel[6 * 2080] / albedo - 1) < 0.02);
    image_release(&im);
    proxy_cloth_release(&c);
}

/* Layers, and the picture through the lens, by one way. */
struct all {
    float *layer[3]; /* radiance of the lamp's light, light of folds, the picture: rgb */
    size_t n;
};

static void make_all(const struct proxy_request *q, struct all *a)
{
    struct proxy_surface s;
    struct proxy_layers l;
    struct error err = {0};
    a->n = 3 * q->width * q->height;
    a->layer[2] = calloc(a->n, sizeof(float));
    if (proxy_surface_init(&s, q, &err) != STATUS_OK || proxy_layers_init(&s, NULL, NULL, &l, &err) != STATUS_OK ||
        proxy_shadow_make(&s, NULL, NULL, &l, &err) != STATUS_OK ||
        proxy_bounce_make(&s, NULL, NULL, &l, &err) != STATUS_OK ||
        proxy_lens_make(&s, &l, NULL, NULL, a->layer[2], &err) != STATUS_OK)
        fail_msg("%s", err.text);
    for (size_t i = 0; i < a->n / 3; i++) {
        double direct[3] = {0, 0, 0};
        if (l.receiver[i].used) proxy_surface_direct(&s, &l.place[i], direct);
        for (size_t k = 0; k < 3; k++) l.visible[3 * i + k] *= (float)direct[k];
    }
    a->layer[0] = l.visible;
    a->layer[1] = l.bounce;
    l.visible = l.bounce = NULL;
    proxy_layers_release(&l);
}

static void release_all(struct all *a)
{
    for (int k = 0; k < 3; k++) free(a->layer[k]);
}

static double apart(const float *a, const float *b, size_t n)
{
    double sum = 0;
    for (size_t i = 0; i < n; i++) sum += pow((double)a[i] - (double)b[i], 2);
    return sqrt(sum / (double)n);
}

/* The truth is the mean of own rays, 64 of each of 6 seeds: its error is a fifth of that of 4 x 4 rays, or less.
 * Passes and the whole sum differ where directions and slopes change from pixel to pixel. */
static void folds_are_near_many_rays(void **state)
{
    (void)state;
    static const double most_apart[3] = {0.005, 0.003, 0.005};
    static const char *const name[3] = {"light of the lamp", "light of folds", "through a lens"};
    struct proxy_cloth c;
    struct all truth = {0}, by[4];
    proxy_cloth_init(&c, true);
    c.view.aperture_m = 0.02;
    c.q.width = c.q.height = 80;
    c.q.n_side = 8;
    c.q.way = RAY_OWN;
    for (int seed = 0; seed < TRUTH_SEEDS; seed++) {
        struct all one;
        c.q.seed = 100 + (uint64_t)seed;
        make_all(&c.q, &one);
        for (int k = 0; k < 3; k++) {
            if (seed == 0) truth.layer[k] = calloc(one.n, sizeof(float));
            for (size_t i = 0; i < one.n; i++) truth.layer[k][i] += one.layer[k][i] / TRUTH_SEEDS;
        }
        release_all(&one);
    }
    c.q.n_side = 4;
    c.q.seed = 5;
    for (int way = 0; way < 4; way++) {
        c.q.way = (enum ray_filter_way)way;
        make_all(&c.q, &by[way]);
    }
    for (int k = 0; k < 3; k++) {
        const double passes = apart(by[RAY_PASSES].layer[k], truth.layer[k], by[0].n),
                     whole = apart(by[RAY_WHOLE].layer[k], truth.layer[k], by[0].n),
                     own = apart(by[RAY_OWN].layer[k], truth.layer[k], by[0].n),
                     between = apart(by[RAY_PASSES].layer[k], by[RAY_WHOLE].layer[k], by[0].n);
        print_message("%s: own rays %.4f, by axes %.4f, whole %.4f, passes %.4f, whole and passes apart %.4f\n",
                      name[k], own, apart(by[RAY_AXIS].layer[k], truth.layer[k], by[0].n), whole, passes, between);
        assert_true(passes < 0.75 * own && whole < 0.75 * own && between < most_apart[k]);
    }
    for (int way = 0; way < 4; way++) release_all(&by[way]);
    release_all(&truth);
    proxy_cloth_release(&c);
}

/* Share of the lamp's light that comes to a place, of 24 x 24 places of the lamp with the weights of light that a matte
 * cloth sends on or through. Returns the part that the smaller side of the surface's plane has in the lamp. */
static double weigh_lamp(const struct proxy_surface *s, const struct proxy_place *p, double *comes)
{
    const double half = (double)s->lights.lamp.half_side_mm;
    double sum = 0, all = 0, n_above = 0;
    for (int k = 0; k < 24 * 24; k++) {
        const double y[2] = {half * ((k % 24 + 0.5) / 12 - 1), half * ((k / 24 + 0.5) / 12 - 1)};
        double d[3], start[3], share[3], along = 0;
        struct scene_proxy_hit first;
        proxy_surface_to_lamp(s, p->hit.position_mm, y, d);
        for (int a = 0; a < 3; a++) along += d[a] * p->facing[a];
        proxy_surface_start(s, &p->hit, d, start);
        proxy_surface_layers(s, start, d, &first, share);
        const double weight = fabs(along) * (along > 0 ? s->albedo[p->hit.lower][1] : s->through[1]);
        sum += weight * share[1];
        all += weight;
        if (along > 0) n_above++;
    }
    *comes = sum / all;
    return fmin(n_above, 24 * 24 - n_above) / (24 * 24);
}

/* Where the plane of the surface cuts the lamp. The lesser side is seen at 4 x 4 places and the greater one by rays
 * that count alike: an error of 0.05, where one side alone has 0.25. */
static void a_lamp_in_the_plane_of_the_cloth_counts_both_sides(void **state)
{
    (void)state;
    struct proxy_cloth c;
    struct proxy_surface s;
    struct proxy_layers l;
    double sum = 0, n = 0;
    proxy_cloth_init(&c, true);
    c.q.n_side = 8;
    c.q.way = RAY_OWN;
    assert_int_equal(proxy_surface_init(&s, &c.q, NULL), STATUS_OK);
    assert_int_equal(proxy_layers_init(&s, NULL, NULL, &l, NULL), STATUS_OK);
    assert_int_equal(proxy_shadow_make(&s, NULL, NULL, &l, NULL), STATUS_OK);
    for (size_t i = 0; i < MOST_PIXEL; i++) {
        double comes;
        if (!l.receiver[i].used || weigh_lamp(&s, &l.place[i], &comes) < 0.05) continue;
        sum += pow((double)l.visible[3 * i + 1] - comes, 2);
        n++;
    }
    print_message("lamp in the plane of the cloth: %.0f pixels, error %.4f\n", n, sqrt(sum / n));
    assert_true(n > 50 && sqrt(sum / n) < 0.08);
    proxy_layers_release(&l);
    proxy_cloth_release(&c);
}

/* A ray that meets the cut edge half-way up is told the place on the upper side: rays from there see no other part of
 * the edge. */
static void a_cut_edge_counts_as_the_upper_side(void **state)
{
    (void)state;
    struct proxy_cloth c;
    struct scene_proxy_hit top, edge;
    proxy_cloth_init(&c, false);
    const double above[3] = {0, 0, 100}, down[3] = {0, 0, -1}, along[3] = {0, 1, 0},
                 beside[3] = {0.5, -100, scene_lowest_mm(c.bent) + 0.5 * scene_thickness_mm(c.bent)};
    assert_true(scene_proxy_trace(c.bent, above, down, 0, &top) && scene_proxy_trace(c.bent, beside, along, 0, &edge));
    assert_true(top.position_mm[2] - beside[2] > 0.4 * scene_thickness_mm(c.bent));
    assert_true(fabs(edge.position_mm[2] - top.position_mm[2]) < 1e-4 && !edge.lower);
    assert_true(fabs(edge.position_mm[0] - 0.5) < 1e-3 && fabs(edge.position_mm[1] + 30) < 1e-3);
    proxy_cloth_release(&c);
}

/* Rays from all places of a lens through one point of the picture meet in the plane in focus. */
static void rays_of_a_lens_meet_in_focus(void **state)
{
    (void)state;
    struct configuration view = {.camera_theta_rad = 0.5,
                                 .camera_phi_rad = 1,
                                 .camera_distance_m = 0.4,
                                 .crop_m = 0.05,
                                 .crop_aspect = 1.5,
                                 .aperture_m = 0.03,
                                 .focus_m = 0.37,
                                 .lamp_side_m = 0.1,
                                 .light_distance_m = 0.6};
    struct camera m;
    double middle[3] = {0, 0, 0};
    camera_init(&m, &view);
    for (int k = 0; k < 5; k++) {
        static const double at[5][2] = {{0, 0}, {1, 0}, {0, -1}, {-0.6, 0.5}, {0.3, 0.9}};
        struct camera pinhole;
        double xy[2] = {0.8, 0.3}, d[3], o[3], forward[3], rate = 0, way = 0;
        camera_at_lens(&m, at[k], &pinhole, xy);
        camera_direction(&pinhole, xy, d);
        camera_origin(&pinhole, xy, o);
        for (int a = 0; a < 3; a++) forward[a] = -m.eye_mm[a] / 400;
        for (int a = 0; a < 3; a++) {
            rate += d[a] * forward[a];
            way += (370 * forward[a] + m.eye_mm[a] - o[a]) * forward[a];
        }
        for (int a = 0; a < 3; a++) {
            const double p = o[a] + way / rate * d[a];
            if (k == 0) middle[a] = p;
            assert_true(fabs(p - middle[a]) < 1e-9);
        }
    }
    view.camera = CAMERA_FAR_FIELD;
    assert_int_equal(configuration_check(&view, 1, NULL), STATUS_INVALID);
}

static void threads_and_faults(void **state)
{
    (void)state;
    struct proxy_cloth c;
    struct image alone, pooled;
    struct thread_pool *pool;
    struct error err = {0};
    atomic_bool cancel = true;
    const struct progress cancelled = {.cancel = &cancel};
    proxy_cloth_init(&c, true);
    assert_int_equal(thread_pool_new(3, &pool, &err), STATUS_OK);
    c.q.n_side = 2;
    render(&c.q, &alone);
    assert_int_equal(proxy_picture_render(&c.q, pool, NULL, &pooled, &err), STATUS_OK);
    for (size_t i = 0; i < MOST_PIXEL; i++) assert_memory_equal(alone.pixel + 6 * i, pooled.pixel + 6 * i, 12);
    image_release(&alone), image_release(&pooled);
    assert_int_equal(proxy_picture_render(&c.q, pool, &cancelled, &pooled, &err), STATUS_CANCELLED);
    c.q.scene = c.flat.scene;
    assert_int_equal(proxy_picture_render(&c.q, pool, NULL, &pooled, &err), STATUS_INVALID);
    thread_pool_free(pool);
    proxy_cloth_release(&c);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_flat_piece_has_its_closed_form),
        cmocka_unit_test(a_white_sky_shows_the_albedo),
        cmocka_unit_test(folds_are_near_many_rays),
        cmocka_unit_test(a_lamp_in_the_plane_of_the_cloth_counts_both_sides),
        cmocka_unit_test(a_cut_edge_counts_as_the_upper_side),
        cmocka_unit_test(rays_of_a_lens_meet_in_focus),
        cmocka_unit_test(threads_and_faults),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
