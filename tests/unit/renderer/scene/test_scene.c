/* The periodic cloth: positions of hits, periodicity, back faces, camera and lamp. */
#include "renderer/scene/scene.h"
#include "renderer/scene/scene_ray.h"
#include "renderer/transport/camera.h"
#include "renderer/transport/lamp.h"
#include "tests/support/cloth/hand_weave.h"

#include "base/angle.h"
#include "base/rng.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

static struct scene *straight_scene(bool black_sheet)
{
    static const double y_z[2][2] = {{0.1e-3, 0}, {0.3e-3, -0.1e-3}};
    struct fiber_set f;
    struct scene *s = NULL;
    struct error err = {0};
    hand_straight(&f, 2, y_z, 0.5e-3, 20e-6);
    if (scene_new(&f, &(struct scene_option){black_sheet}, &s, &err) != STATUS_OK) fail_msg("%s", err.text);
    fiber_set_release(&f);
    return s;
}

static struct scene_ray ray_to(double x, double y, double z, double dx, double dy, double dz)
{
    double l = sqrt(dx * dx + dy * dy + dz * dz);
    return (struct scene_ray){.origin_mm = {(float)x, (float)y, (float)z},
                              .direction = {(float)(dx / l), (float)(dy / l), (float)(dz / l)}};
}

static void hits_are_where_they_should_be(void **state)
{
    (void)state;
    struct scene *s = straight_scene(true);
    struct scene_hit h;
    assert_int_equal(scene_n_segment(s), 6); /* each fiber is longer than 20 radii */
    assert_true(fabs(scene_thickness_mm(s) - 0.14) < 1e-6);
    assert_true(scene_memory_bytes(s) > 500);
    /* straight down on the top of the first fiber, which is at z = 0, seven tiles away */
    struct scene_ray r = ray_to(0.2 + 7 * 0.5, 0.1 - 3 * 0.5, 0.001, 0, 0, -1);
    assert_true(scene_trace(s, &r, &h));
    assert_true(fabsf(h.position_mm[2]) < 1e-5f && fabsf(h.normal[2] - 1) < 1e-5f &&
                fabsf(fabsf(h.tangent[0]) - 1) < 1e-6f);
    assert_true(fabsf(h.radius_mm - 0.02f) < 1e-7f);
    assert_int_equal(scene_fiber_of(s, h.i_segment), 0);
    assert_true(fabs(r.offset_mm[0] - 3.5) < 1e-9 && fabs(r.offset_mm[1] + 1.5) < 1e-9);
    /* between the fibers the ray hits the sheet */
    r = ray_to(0.2, 0.2, 0.001, 0, 0, -1);
    assert_false(scene_trace(s, &r, &h));
    /* horizontal along y, the ray hits the first fiber from the side; along x between the fibers it hits nothing */
    r = ray_to(0.2, 0.31, -0.02, 0, 1, 0);
    assert_true(scene_trace(s, &r, &h));
    assert_true(fabs((double)h.position_mm[1] + r.offset_mm[1] - 0.58) < 1e-4 && h.normal[1] < -0.99f);
    r = ray_to(0.2, 0.2, -0.05, 1, 0, 0);
    assert_false(scene_trace(s, &r, &h));
    assert_false(scene_occluded(s, &(struct scene_ray){.origin_mm = {0.2f, 0.2f, -0.05f}, .direction = {1, 0, 0}}));
    scene_free(s);
}

/* Every fiber has its own radius: a ray straight down meets it so far above its axis, and passes beside the thin
 * one. */
static void fibers_have_their_own_radius(void **state)
{
    (void)state;
    static const double y_z[2][2] = {{0.1e-3, 0}, {0.3e-3, 0}};
    const float radius_mm[2] = {0.012f, 0.03f};
    struct fiber_set f;
    struct scene *s = NULL;
    hand_straight(&f, 2, y_z, 0.5e-3, 20e-6);
    for (int i = 0; i < 2; i++) f.radius_m[i] = 1e-3f * radius_mm[i];
    assert_int_equal(scene_new(&f, &(struct scene_option){false}, &s, NULL), STATUS_OK);
    float top[2];
    for (int i = 0; i < 2; i++) {
        struct scene_hit h;
        struct scene_ray r = ray_to(0.2, 0.1 + 0.2 * i, 0.05, 0, 0, -1),
                         beside = ray_to(0.2, 0.12 + 0.2 * i, 0.05, 0, 0, -1);
        assert_true(scene_trace(s, &r, &h));
        assert_int_equal(scene_fiber_of(s, h.i_segment), i);
        assert_true(fabsf(h.radius_mm - radius_mm[i]) < 1e-7f);
        top[i] = h.position_mm[2];
        assert_int_equal(scene_occluded(s, &beside), i == 1);
    }
    assert_true(fabsf(top[1] - top[0] - (radius_mm[1] - radius_mm[0])) < 1e-5f);
    scene_free(s);
    fiber_set_release(&f);
}

static void back_faces_do_not_exist(void **state)
{
    (void)state;
    struct scene *s = straight_scene(false);
    struct scene_hit h;
    struct scene_ray inside = ray_to(0.2, 0.1, -0.02, 0, 0.1, 1);
    inside.inside = true;
    assert_false(scene_occluded(s, &inside));
    assert_false(scene_trace(s, &inside, &h));
    inside = ray_to(0.2, 0.1, -0.02, 0, 0.2, -0.1);
    inside.inside = true;
    assert_true(scene_occluded(s, &inside)); /* the next fiber ahead, not this one */
    assert_true(scene_trace(s, &inside, &h));
    assert_int_equal(scene_fiber_of(s, h.i_segment), 1);
    /* a ray that continues from a hit into the fiber does not meet it */
    struct scene_ray down = ray_to(0.2, 0.1, 0.001, 0, 0, -1), through;
    assert_true(scene_trace(s, &down, &h));
    scene_ray_leave(&h, down.offset_mm, (const float[3]){0, 0, -1}, &through);
    assert_true(through.inside);
    assert_false(scene_occluded(s, &through));
    scene_free(s);
}

/* Rays that leave across the width start on the fiber's surface, on the side that they point to, and are distributed
 * uniformly over the width that their direction sees. */
static void rays_leave_across_the_width(void **state)
{
    (void)state;
    struct scene *s = straight_scene(false);
    struct scene_hit h;
    struct scene_ray down = ray_to(0.2, 0.1, 0.001, 0, 0, -1), out;
    assert_true(scene_trace(s, &down, &h));
    const float axis[3] = {h.position_mm[0] - h.radius_mm * h.normal[0], h.position_mm[1] - h.radius_mm * h.normal[1],
                           h.position_mm[2] - h.radius_mm * h.normal[2]};
    const float to[3][3] = {{0, 0, -1}, {0.6f, 0.8f, 0}, {-0.64f, -0.48f, 0.6f}};
    for (int k = 0; k < 3; k++) {
        float norm = sqrtf(to[k][1] * to[k][1] + to[k][2] * to[k][2]); /* the fiber lies along x */
        for (int i = 0; i < 10; i++) {
            float place = 0.1f * (float)i + 0.05f;
            scene_ray_leave_across(&h, down.offset_mm, to[k], place, &out);
            float y = (out.origin_mm[1] - axis[1]) / h.radius_mm, z = (out.origin_mm[2] - axis[2]) / h.radius_mm;
            float front = (y * to[k][1] + z * to[k][2]) / norm, across = (z * to[k][1] - y * to[k][2]) / norm;
            assert_true(fabsf(out.origin_mm[0] - h.position_mm[0]) < 1e-6f);
            assert_true(fabsf(y * y + z * z - 1) < 1e-3f && front > 0);
            assert_true(fabsf(fabsf(across) - fabsf(2 * place - 1)) < 1e-3f);
            assert_true(out.tnear_mm < 0.01f * h.radius_mm);
        }
    }
    scene_ray_leave_across(&h, down.offset_mm, (const float[3]){1, 0, 0}, 0.5f, &out); /* along the fiber */
    for (int a = 0; a < 3; a++) assert_true(isfinite(out.origin_mm[a]));
    scene_free(s);
}

/* A ray and the same ray shifted by whole tiles hit the same place, at any slope. */
static void cloth_is_periodic(void **state)
{
    (void)state;
    struct fiber_set f;
    struct scene *s = NULL;
    struct rng rng;
    rng_start(&rng, &(struct rng_key){1, 0, 0, 0}, 0, 0);
    hand_weave_small(&f);
    double tile = f.tile_size_m[0] * 1e3;
    assert_int_equal(scene_new(&f, &(struct scene_option){true}, &s, NULL), STATUS_OK);
    fiber_set_release(&f);
    int n_hit = 0, n_shadow = 0;
    for (int i = 0; i < 5000; i++) {
        double x = tile * rng_double(&rng), y = tile * rng_double(&rng), phi = 2 * M_PI * rng_double(&rng),
               slope = pow(rng_double(&rng), 2);
        struct scene_ray a = ray_to(x, y, 1e-3, cos(phi), sin(phi), -slope),
                         b = ray_to(x + 5 * tile, y - 3 * tile, 1e-3, cos(phi), sin(phi), -slope);
        struct scene_hit ha, hb;
        bool shadow = scene_occluded(s, &a), hit = scene_trace(s, &a, &ha);
        assert_true(shadow == hit);
        n_shadow += shadow;
        if (scene_trace(s, &b, &hb) != hit) continue; /* rounding decides at an edge */
        if (!hit) continue;
        double dx =
            ((double)hb.position_mm[0] + b.offset_mm[0]) - ((double)ha.position_mm[0] + a.offset_mm[0]) - 5 * tile;
        double dy =
            ((double)hb.position_mm[1] + b.offset_mm[1]) - ((double)ha.position_mm[1] + a.offset_mm[1]) + 3 * tile;
        n_hit += fabs(dx) < 1e-3 && fabs(dy) < 1e-3;
    }
    assert_true(n_shadow > 4000 && n_hit > n_shadow - 10);
    scene_free(s);
}

static void bad_fibers_are_refused(void **state)
{
    (void)state;
    struct fiber_set f;
    struct scene *s = NULL;
    struct error err = {0};
    hand_weave_small(&f);
    f.position_m[7] = NAN;
    assert_int_equal(scene_new(&f, &(struct scene_option){true}, &s, &err), STATUS_INVALID);
    assert_true(strlen(err.text) > 10);
    fiber_set_release(&f);
    hand_weave_small(&f); /* a fiber a hundred tiles long */
    f.position_m[0] = -100 * (float)f.tile_size_m[0];
    assert_int_equal(scene_new(&f, &(struct scene_option){true}, &s, &err), STATUS_INVALID);
    fiber_set_release(&f);
    hand_weave_small(&f); /* repeated points are allowed */
    memcpy(f.position_m + 3, f.position_m, 3 * sizeof(float));
    assert_int_equal(scene_new(&f, &(struct scene_option){true}, &s, &err), STATUS_OK);
    assert_int_equal(scene_n_segment(s), 2 * 2 * 12 * 16 - 1);
    scene_free(s);
    fiber_set_release(&f);
}

/* Rays to a band twice as wide as the fiber: half of them hit, whatever the fiber's share of the tile. No ray that
 * leaves the fiber to the outside hits it again. */
static void thin_fibers_are_as_wide_as_thick_ones(void **state)
{
    (void)state;
    enum { N = 20000 };
    static const double share[4] = {1e-2, 1e-4, 1e-5, 3e-6}, tile_m = 4e-3;
    for (int k = 0; k < 4; k++) {
        const double radius_m = share[k] * tile_m, y_z[1][2] = {{0.33 * tile_m, 0}};
        struct fiber_set f;
        struct scene *s = NULL;
        struct error err = {0};
        struct rng r;
        hand_straight(&f, 1, y_z, tile_m, radius_m);
        if (scene_new(&f, &(struct scene_option){true}, &s, &err) != STATUS_OK) fail_msg("%s", err.text);
        rng_start(&r, &(struct rng_key){13, 0, 0, 0}, (uint32_t)k, 0);
        int n_hit = 0;
        for (int i = 0; i < N; i++) {
            double tilt = 2 * rng_double(&r) - 1, l = sqrt(1 + tilt * tilt),
                   off = 1e3 * radius_m * (4 * rng_double(&r) - 2);
            double d[3] = {tilt / l, 0, -1 / l}; /* the fiber lies along x: y is across the ray */
            double p[3] = {32 * rng_double(&r) - 16, 1e3 * 0.33 * tile_m + off, -1e3 * radius_m}, o[3];
            for (int a = 0; a < 3; a++) o[a] = p[a] - 1000 * d[a];
            struct scene_ray ray, out;
            struct scene_hit h;
            assert_true(scene_ray_enter(s, o, d, &ray));
            if (!scene_trace(s, &ray, &h)) continue;
            n_hit++;
            scene_ray_leave(&h, ray.offset_mm, h.normal, &out);
            /* a level ray may meet the fiber's copy in the next tile */
            if (h.normal[2] > 0.05f) assert_false(scene_occluded(s, &out));
        }
        double se = 0.5 / sqrt(N);
        if (fabs((double)n_hit / N - 0.5) > 4 * se)
            fail_msg("radius %g of the tile: %g of the rays hit, +- %g", share[k], (double)n_hit / N, se);
        scene_free(s);
        fiber_set_release(&f);
    }
}

static void too_thin_fibers_are_refused(void **state)
{
    (void)state;
    const double y_z[1][2] = {{1e-3, 0}};
    struct fiber_set f;
    struct scene *s = NULL;
    struct error err = {0};
    hand_straight(&f, 1, y_z, 4e-3, 4e-9);
    assert_int_equal(scene_new(&f, &(struct scene_option){true}, &s, &err), STATUS_INVALID);
    assert_string_equal(err.field, "radius_m");
    assert_non_null(strstr(err.text, "1/500000"));
    fiber_set_release(&f);
}

/* Two segments of 2^63 pieces each, whose sum would overflow to one vertex. Along x such a fiber leaves the largest
 * block, and along z there is no other limit. It is read from both kinds of file, as by a job. */
static void segments_of_enormous_length_are_refused(void **state)
{
    (void)state;
    static const char *const text[2] = {"0 0 0 9.5367431640625e-4\n1.7592186044416e18 0 0 9.5367431640625e-4\n"
                                        "0 0 0 9.5367431640625e-4\n",
                                        "0 0 0 9.5367431640625e-4\n0 0 1.7592186044416e18 9.5367431640625e-4\n"
                                        "0 0 0 9.5367431640625e-4\n"};
    static const status want[2] = {STATUS_INVALID, STATUS_TOO_LARGE};
    char txt[64], hair[64];
    snprintf(txt, sizeof txt, "/tmp/selvedge-scene-%ld.txt", (long)getpid());
    snprintf(hair, sizeof hair, "/tmp/selvedge-scene-%ld.hair", (long)getpid());
    for (int k = 0; k < 2; k++) {
        struct fiber_set f;
        struct scene *s = NULL;
        struct error err = {0};
        FILE *file = fopen(txt, "we");
        assert_non_null(file);
        fputs(text[k], file);
        fclose(file);
        fiber_set_init(&f);
        for (int kind = 0; kind < 2; kind++) {
            assert_int_equal(kind == 0 ? fiber_set_read_text(&f, txt, &err) : fiber_set_read_hair(&f, hair, &err),
                             STATUS_OK);
            f.tile_size_m[0] = f.tile_size_m[1] = 1e-3;
            assert_int_equal(scene_new(&f, &(struct scene_option){true}, &s, &err), want[k]);
            assert_non_null(strstr(err.text, k == 0 ? "too far beyond the tile" : "3.689e+20 vertices"));
            if (kind == 0) assert_int_equal(fiber_set_write_hair(&f, hair, &err), STATUS_OK);
        }
        fiber_set_release(&f);
    }
    unlink(txt);
    unlink(hair);
}

static void camera_looks_at_the_orbit_centre(void **state)
{
    (void)state;
    struct scene *s = straight_scene(true);
    for (int i = 0; i < 12; i++) {
        struct configuration c = {0,   0,   i * 7 * RAD_PER_DEG, i * 40 * RAD_PER_DEG, i * 15 * RAD_PER_DEG, 0.61, 0.1,
                                  1.0, 0.01};
        struct camera m;
        struct scene_ray r;
        camera_init(&m, &c);
        assert_true(camera_ray(&m, s, (const double[2]){0.5, 0.5}, &r));
        double z = (double)r.origin_mm[2], t = -z / (double)r.direction[2];
        for (int a = 0; a < 2; a++)
            assert_true(fabs((double)r.origin_mm[a] + r.offset_mm[a] + t * (double)r.direction[a]) < 1e-3);
        double phi = c.camera_phi_rad - c.cloth_rotation_rad;
        assert_true(fabs((double)r.direction[2] + cos(c.camera_theta_rad)) < 1e-6);
        assert_true(fabs((double)r.direction[0] + sin(c.camera_theta_rad) * cos(phi)) < 1e-6);
        /* the top of the picture is towards the normal */
        assert_true(m.up_mm[2] >= 0 && fabs(m.right_mm[2]) < 1e-12);
        assert_true(fabs(m.right_mm[0] * m.up_mm[0] + m.right_mm[1] * m.up_mm[1] + m.right_mm[2] * m.up_mm[2]) < 1e-9);
        /* the crop's edge is 10 mm */
        struct scene_ray left, right;
        if (i == 0) {
            assert_true(camera_ray(&m, s, (const double[2]){0, 0.5}, &left));
            assert_true(camera_ray(&m, s, (const double[2]){1, 0.5}, &right));
            double dx = (double)right.origin_mm[0] + right.offset_mm[0] - (double)left.origin_mm[0] - left.offset_mm[0];
            double dy = (double)right.origin_mm[1] + right.offset_mm[1] - (double)left.origin_mm[1] - left.offset_mm[1];
            assert_true(fabs(hypot(dx, dy) - 10) < 1e-3);
            assert_true(dy > 9.99); /* seen from above with -x (away from phi = 0) up, +y is to the right */
        }
    }
    scene_free(s);
}

/* The lamp has an irradiance of pi at the orbit centre, measured by samples, and both functions give the same
 * density. */
static void lamp_is_calibrated(void **state)
{
    (void)state;
    struct rng r;
    rng_start(&r, &(struct rng_key){9, 0, 0, 0}, 0, 0);
    static const double shape[3][2] = {{0.61, 0.1}, {0.61, 1.0}, {0.2, 0.3}};
    for (int k = 0; k < 3; k++) {
        struct configuration c = {40 * RAD_PER_DEG, 70 * RAD_PER_DEG, 0,   0,   20 * RAD_PER_DEG,
                                  shape[k][0],      shape[k][1],      1.0, 0.01};
        struct lamp l;
        lamp_init(&l, &c);
        double sum = 0, n = 200000, x2 = 0;
        for (int i = 0; i < (int)n; i++) {
            float u[2] = {rng_float(&r), rng_float(&r)}, d[3], pdf, origin[3] = {0, 0, 0};
            assert_true(lamp_sample(&l, origin, u, d, &pdf));
            double cosine = -(double)(d[0] * l.normal[0] + d[1] * l.normal[1] + d[2] * l.normal[2]),
                   v = (double)l.radiance * cosine / (double)pdf;
            sum += v;
            x2 += v * v;
            float again = lamp_pdf(&l, origin, d);
            bool edge = fmaxf(fabsf(u[0] - 0.5f), fabsf(u[1] - 0.5f)) > 0.499f;
            if (!edge && fabsf(again / pdf - 1) > 1e-4f) fail_msg("densities %g and %g", (double)pdf, (double)again);
        }
        double mean = sum / n, se = sqrt((x2 / n - mean * mean) / n);
        assert_true(fabs(mean - M_PI) < 4 * se + 1e-5);
        const float behind[3] = {2 * l.centre_mm[0], 2 * l.centre_mm[1], 2 * l.centre_mm[2]};
        const float up[3] = {-l.normal[0], -l.normal[1], -l.normal[2]}, zero[3] = {0, 0, 0};
        float d[3], pdf;
        assert_false(lamp_sample(&l, behind, (const float[2]){0.5f, 0.5f}, d, &pdf));
        assert_true(lamp_pdf(&l, zero, l.normal) == 0 && lamp_pdf(&l, zero, up) > 0);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(hits_are_where_they_should_be),
        cmocka_unit_test(fibers_have_their_own_radius),
        cmocka_unit_test(back_faces_do_not_exist),
        cmocka_unit_test(rays_leave_across_the_width),
        cmocka_unit_test(cloth_is_periodic),
        cmocka_unit_test(bad_fibers_are_refused),
        cmocka_unit_test(thin_fibers_are_as_wide_as_thick_ones),
        cmocka_unit_test(too_thin_fibers_are_refused),
        cmocka_unit_test(segments_of_enormous_length_are_refused),
        cmocka_unit_test(camera_looks_at_the_orbit_centre),
        cmocka_unit_test(lamp_is_calibrated),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
