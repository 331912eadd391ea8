/* Shell maps: a flat mesh changes nothing, fibers lie where a bent cloth has them, no light is lost between cells. */
#include "renderer/mesh/mesh_shapes.h"
#include "renderer/scene/scene_place.h"
#include "renderer/scene/scene_ray.h"
#include "tests/support/cloth/hand_weave.h"
#include "tests/support/tracer/environment/uniform_environment.h"

#include "base/angle.h"
#include "base/rng.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static const double radius_mm = 15.0, length_mm = 20.0;

static struct scene *flat_scene(struct fiber_set *f, bool black_sheet)
{
    struct scene *s = NULL;
    struct error err = {0};
    if (scene_new(f, &(struct scene_option){black_sheet}, &s, &err) != STATUS_OK) fail_msg("%s", err.text);
    fiber_set_release(f);
    return s;
}

static struct scene *bend(const struct scene *flat, struct mesh *m)
{
    struct scene *s = NULL;
    struct error err = {0};
    if (mesh_check(m, &err) != STATUS_OK || scene_bend(flat, m, scene_has_black_sheet(flat), &s, &err) != STATUS_OK)
        fail_msg("%s", err.text);
    mesh_release(m);
    return s;
}

static struct scene *on_cylinder(const struct scene *flat, size_t n_cell)
{
    struct mesh m;
    assert_int_equal(mesh_cylinder(radius_mm, length_mm, 1.5, n_cell, &m, NULL), STATUS_OK);
    return bend(flat, &m);
}

static void random_direction(struct rng *r, double d[3])
{
    double z = 2 * rng_double(r) - 1, phi = 2 * M_PI * rng_double(r), s = sqrt(1 - z * z);
    d[0] = s * cos(phi);
    d[1] = s * sin(phi);
    d[2] = z;
}

/* A texture coordinate of its own for every corner, as some programs write them. */
static void unshare_texture(struct mesh *m)
{
    double(*own)[2] = malloc(3 * m->n_triangle * sizeof *own);
    assert_non_null(own);
    for (size_t i = 0; i < 3 * m->n_triangle; i++) {
        uint32_t *texture = &m->triangle[i / 3].texture[i % 3];
        memcpy(own[i], m->texture_mm[*texture], sizeof own[i]);
        *texture = (uint32_t)i;
    }
    free(m->texture_mm);
    m->texture_mm = own;
    m->n_texture = 3 * m->n_triangle;
}

/* Of every ray, the hit in the cloth on the mesh is that in the flat cloth. */
static void check_flat_mesh(struct mesh *m)
{
    struct fiber_set f;
    hand_weave_small(&f);
    struct scene *flat = flat_scene(&f, false), *bent = bend(flat, m);
    size_t n_hit = 0, n_differ = 0;
    for (uint32_t i = 0; i < 20000; i++) {
        struct rng r;
        struct scene_ray a, b;
        struct scene_hit ha, hb;
        double o[3], d[3];
        rng_start(&r, &(struct rng_key){1, 0, 0, 0}, i, 0);
        random_direction(&r, d);
        d[2] = -fabs(d[2]) - 0.2;
        for (int k = 0; k < 3; k++) o[k] = k < 2 ? 4 * rng_double(&r) - 2 : 1.0;
        assert_true(scene_ray_enter(flat, o, d, &a) && scene_ray_enter(bent, o, d, &b));
        bool hit = scene_trace(flat, &a, &ha);
        bool same = scene_trace(bent, &b, &hb) == hit;
        for (int k = 0; k < 3 && same && hit; k++)
            same = fabs((double)ha.position_mm[k] + (k < 2 ? a.offset_mm[k] : 0) - (double)hb.position_mm[k]) < 2e-5 &&
                   fabsf(ha.normal[k] - hb.normal[k]) < 0.02f && fabsf(ha.tangent[k] - hb.tangent[k]) < 1e-4f;
        n_differ += !same;
        n_hit += hit;
    }
    if (n_differ > 20) fail_msg("%zu of 20000 rays differ", n_differ); /* rounding decides at the edge of a fiber */
    assert_true(n_hit > 10000);
    scene_free(bent);
    scene_free(flat);
}

static void a_flat_mesh_changes_nothing(void **state)
{
    (void)state;
    struct mesh m;
    assert_int_equal(mesh_flat((const double[2]){40, 40}, (const size_t[2]){37, 23}, &m, NULL), STATUS_OK);
    check_flat_mesh(&m);
}

/* 40 mm of a cylinder of 10 km: its surface sinks by less than a thousandth of a micrometre where the rays go. */
static void an_endless_radius_gives_the_flat_cloth(void **state)
{
    (void)state;
    struct mesh m;
    assert_int_equal(mesh_cylinder(1e7, 40, 2e-6, 37, &m, NULL), STATUS_OK);
    check_flat_mesh(&m);
}

static void seams_of_the_texture_change_nothing(void **state)
{
    (void)state;
    struct mesh m;
    assert_int_equal(mesh_flat((const double[2]){40, 40}, (const size_t[2]){37, 23}, &m, NULL), STATUS_OK);
    unshare_texture(&m);
    check_flat_mesh(&m);
}

/* Fibers around the cylinder are rings, and fibers along it are straight lines. Rays from everywhere hit them on their
 * surface, with the normal of a round fiber. */
static void straight_fibers_lie_on_the_cylinder(void **state)
{
    (void)state;
    static const double y_z[2][2] = {{0.1e-3, 0}, {0.3e-3, -0.1e-3}};
    const double fiber = 0.02, axis[2] = {radius_mm - fiber, radius_mm - fiber - 0.1};
    struct fiber_set f;
    hand_straight(&f, 2, y_z, 0.5e-3, 1e-3 * fiber);
    struct scene *flat = flat_scene(&f, false), *bent = on_cylinder(flat, 720);
    size_t n_hit = 0;
    double worst = 0, worst_normal = 0;
    for (uint32_t i = 0; i < 20000; i++) {
        struct rng r;
        struct scene_ray ray;
        struct scene_hit h;
        double o[3], d[3];
        rng_start(&r, &(struct rng_key){2, 0, 0, 0}, i, 0);
        random_direction(&r, d);
        double angle = 1.2 * (2 * rng_double(&r) - 1), at[3] = {(radius_mm + 0.5) * sin(angle), 6 * rng_double(&r) - 3,
                                                                (radius_mm + 0.5) * cos(angle) - radius_mm};
        if (d[0] * sin(angle) + d[2] * cos(angle) > 0)
            for (int k = 0; k < 3; k++) d[k] = -d[k];
        for (int k = 0; k < 3; k++) o[k] = at[k] - 5 * d[k];
        if (!scene_ray_enter(bent, o, d, &ray) || !scene_trace(bent, &ray, &h)) continue;
        n_hit++;
        double x = (double)h.position_mm[0], z = (double)h.position_mm[2] + radius_mm, from = hypot(x, z);
        int k = scene_fiber_of(bent, h.i_segment) == 1;
        double y = (double)h.position_mm[1], line = 0.1 + 0.2 * k, beside = y - line - 0.5 * round((y - line) / 0.5);
        worst = fmax(worst, fabs(hypot(from - axis[k], beside) - fiber));
        double n[3] = {x / from * (from - axis[k]), beside, z / from * (from - axis[k])}, cosine = 0;
        for (int a = 0; a < 3; a++) cosine += n[a] * (double)h.normal[a] / fiber;
        worst_normal = fmax(worst_normal, 1 - cosine);
        assert_true(fabs((double)h.tangent[0] * x / from + (double)h.tangent[2] * z / from) < 0.01);
    }
    /* chords of 1/240 rad are 3e-5 mm inside the circle; the cloth is squeezed by depth / radius, up to 1 % */
    if (worst > 5e-4) fail_msg("a hit is %g mm from the surface of its fiber", worst);
    if (worst_normal > 2e-3) fail_msg("the cosine of a normal with that of a ring is %g", 1 - worst_normal);
    assert_true(n_hit > 5000);
    scene_free(bent);
    scene_free(flat);
}

static struct scattering_state *prepared(const struct scattering_model *m, const double *param)
{
    struct scattering_state *s = NULL;
    struct error err = {0};
    if (m->prepare(param, &s, &err) != STATUS_OK) fail_msg("%s", err.text);
    return s;
}

/* Every path through a lossless cloth in a uniform environment has the radiance 1. */
static void no_light_is_lost_on_the_cylinder(void **state)
{
    (void)state;
    const struct scattering_model *m = scattering_find("isotropic.v1");
    const double white[3] = {1, 1, 1};
    struct configuration c = {.camera_theta_rad = 0.5,
                              .camera_phi_rad = 1,
                              .light_distance_m = 0.6,
                              .lamp_side_m = 0.1,
                              .camera_distance_m = 1,
                              .crop_m = 0.02};
    struct fiber_set f;
    hand_weave_small(&f);
    struct scene *flat = flat_scene(&f, false), *bent = on_cylinder(flat, 200);
    struct scattering_state *s = prepared(m, white);
    struct path_setting setting;
    struct camera camera;
    path_setting_init(&setting, bent, m, s, &c, false);
    camera_init(&camera, &c);
    uniform_environment_set(&setting);
    double worst = 0;
    uint64_t n_bounce = 0;
    for (uint32_t i = 0; i < 5000; i++) {
        struct path_result path;
        uniform_environment_trace(&setting, &camera, 6, i, &path);
        n_bounce += path.n_bounce;
        for (int k = 0; k < 3; k++) worst = fmax(worst, fabs((double)path.radiance[k] - 1));
    }
    if (worst > 1e-3) fail_msg("the radiance of a path differs from 1 by %g", worst);
    assert_true(n_bounce > 5000);
    m->release(s);
    scene_free(bent);
    scene_free(flat);
}

static void the_sheet_lies_under_the_bent_cloth(void **state)
{
    (void)state;
    static const double y_z[1][2] = {{0.1e-3, 0}};
    struct fiber_set f;
    hand_straight(&f, 1, y_z, 0.5e-3, 20e-6);
    struct scene *flat = flat_scene(&f, true), *bent = on_cylinder(flat, 200);
    struct scene_hit h;
    for (int i = -2; i <= 2; i++) {
        double angle = 0.5 * i, d[3] = {-sin(angle), 0, -cos(angle)}, o[3], up[3];
        struct scene_ray ray;
        for (int a = 0; a < 3; a++) {
            o[a] = -(radius_mm + 1) * d[a] + (a == 1 ? 0.35 : a == 2 ? -radius_mm : 0);
            up[a] = -d[a];
        }
        assert_true(scene_ray_enter(bent, o, d, &ray));
        assert_true(scene_occluded(bent, &ray));
        assert_false(scene_trace(bent, &ray, &h));
        assert_true(scene_sheet_met(bent, &ray));
        o[1] = 0.1; /* on a fiber: back from there nothing is in the way */
        assert_true(scene_ray_enter(bent, o, d, &ray) && scene_trace(bent, &ray, &h));
        struct scene_ray back;
        const float u[3] = {(float)up[0], (float)up[1], (float)up[2]};
        scene_ray_leave(&h, ray.offset_mm, u, &back);
        assert_false(scene_occluded(bent, &back));
        assert_false(scene_trace(bent, &back, &h));
        assert_false(scene_sheet_met(bent, &back));
    }
    scene_free(bent);
    scene_free(flat);
}

static void a_surface_that_bends_too_tightly_is_refused(void **state)
{
    (void)state;
    struct fiber_set f;
    struct mesh m;
    struct scene *bent = NULL;
    struct error err = {0};
    hand_weave_small(&f);
    struct scene *flat = flat_scene(&f, false);
    assert_int_equal(mesh_cylinder(0.5 * scene_thickness_mm(flat), 1, 1.5, 100, &m, NULL), STATUS_OK);
    assert_int_equal(scene_bend(flat, &m, false, &bent, &err), STATUS_INVALID);
    assert_non_null(strstr(err.text, "folds over itself"));
    assert_non_null(strstr(err.text, "triangle"));
    mesh_release(&m);
    scene_free(flat);
}

static void points_inside_of_the_cloth(void **state)
{
    (void)state;
    struct fiber_set f;
    hand_weave_small(&f);
    struct scene *flat = flat_scene(&f, false), *bent = on_cylinder(flat, 200);
    double deep = 0.5 * scene_thickness_mm(flat), at[3];
    for (int i = -10; i <= 10; i++) {
        double angle = 0.14 * i;
        static const double beside[] = {0.1, -30, 3};
        for (int k = 0; k < 4; k++) {
            double from = radius_mm + (k == 0 ? -deep : beside[k - 1]);
            const double p[3] = {from * sin(angle), 0.3 * i, from * cos(angle) - radius_mm};
            assert_true(scene_encloses(bent, p) == (k == 0));
        }
    }
    assert_false(scene_crosses_itself(bent, at));
    assert_true(scene_encloses(flat, (const double[3]){7, 8, -deep}));
    assert_false(scene_encloses(flat, (const double[3]){7, 8, deep}) || scene_crosses_itself(flat, at));
    scene_free(bent);
    scene_free(flat);
}

/* Two square pieces, one upright: apart, and through each other. */
static void pieces_that_cross(void **state)
{
    (void)state;
    struct fiber_set f;
    hand_weave_small(&f);
    struct scene *flat = flat_scene(&f, false);
    for (int k = 0; k < 2; k++) {
        struct mesh m;
        double at[3] = {0}, shift = k == 0 ? 20 : 0.5;
        assert_int_equal(mesh_new(&m, 8, 8, 4, NULL), STATUS_OK);
        for (uint32_t i = 0; i < 8; i++) {
            double u = i % 2 ? 4 : -4, v = i / 2 % 2 ? 4 : -4;
            const double level[3] = {u, v, 0}, upright[3] = {shift, u, v + 0.7};
            memcpy(m.position_mm[i], i < 4 ? level : upright, sizeof level);
            m.texture_mm[i][0] = u;
            m.texture_mm[i][1] = v;
        }
        for (uint32_t i = 0; i < 4; i++) {
            const uint32_t low[3] = {0, 1, 3}, high[3] = {0, 3, 2};
            for (int c = 0; c < 3; c++)
                m.triangle[i].position[c] = m.triangle[i].texture[c] = 4 * (i / 2) + (i % 2 ? high[c] : low[c]);
        }
        struct scene *bent = bend(flat, &m);
        assert_true(scene_crosses_itself(bent, at) == (k == 1));
        if (k == 1) assert_true(fabs(at[0] - shift) < 0.5 && fabs(at[2]) < 0.5);
        scene_free(bent);
    }
    scene_free(flat);
}

/* A hit that moves in the plane of the cloth goes around a cylinder by the arc, keeps its distance from the axis within
 * the sagitta of a cell, and stays on the border of the mesh where the way leads beyond. */
static void a_hit_moves_on_a_cylinder(void **state)
{
    (void)state;
    struct fiber_set f;
    hand_weave_small(&f);
    enum { N_CELL = 400 };
    struct scene *flat = flat_scene(&f, false), *bent = on_cylinder(flat, N_CELL);
    const double cell = 2 * 1.5 / N_CELL, sagitta_mm = radius_mm * cell * cell / 8;
    size_t n = 0;
    for (uint32_t i = 0; i < 500; i++) {
        struct rng r;
        struct scene_ray ray;
        struct scene_hit hit, to;
        rng_start(&r, &(struct rng_key){7, 0, 0, 0}, i, 0);
        const double o[3] = {20 * rng_double(&r) - 10, 10 * rng_double(&r) - 5, 5}, d[3] = {0, 0, -1};
        float way[2] = {(float)(4 * rng_double(&r) - 2), (float)(4 * rng_double(&r) - 2)};
        if (!scene_ray_enter(bent, o, d, &ray) || !scene_trace(bent, &ray, &hit)) continue;
        scene_hit_beside(bent, &hit, way, &to);
        double from[2] = {(double)hit.position_mm[0], (double)hit.position_mm[2] + radius_mm};
        double at[2] = {(double)to.position_mm[0], (double)to.position_mm[2] + radius_mm};
        assert_true(fabs(atan2(at[0], at[1]) - atan2(from[0], from[1]) - (double)way[0] / radius_mm) < 1e-4);
        assert_true(fabs(hypot(at[0], at[1]) - hypot(from[0], from[1])) < 2 * sagitta_mm);
        assert_true(fabsf(to.position_mm[1] - hit.position_mm[1] - way[1]) < 1e-3f);
        way[1] = 100;
        scene_hit_beside(bent, &hit, way, &to);
        assert_true(fabs((double)to.position_mm[1] - 0.5 * length_mm) < 1e-3);
        n++;
    }
    assert_true(n > 200);
    scene_free(bent);
    scene_free(flat);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_flat_mesh_changes_nothing),
        cmocka_unit_test(an_endless_radius_gives_the_flat_cloth),
        cmocka_unit_test(seams_of_the_texture_change_nothing),
        cmocka_unit_test(straight_fibers_lie_on_the_cylinder),
        cmocka_unit_test(no_light_is_lost_on_the_cylinder),
        cmocka_unit_test(the_sheet_lies_under_the_bent_cloth),
        cmocka_unit_test(a_surface_that_bends_too_tightly_is_refused),
        cmocka_unit_test(points_inside_of_the_cloth),
        cmocka_unit_test(pieces_that_cross),
        cmocka_unit_test(a_hit_moves_on_a_cylinder),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
