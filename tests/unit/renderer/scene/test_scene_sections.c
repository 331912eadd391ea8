/* Fibers in the scene whose radius varies and whose sections are flat: hits lie on the cone, and the short axis of the
 * section is known where the cloth is flat. Surfaces that are the sections themselves reach as far as these do, also
 * where a fiber bends and after the scene has been packed. */
#include "renderer/scene/scene_pack.h"
#include "renderer/scene/scene_place.h"
#include "renderer/scene/scene_ray.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <string.h>

#include <cmocka.h>

/* A fiber along x at y = 0.25 mm, of one millimetre, whose radius falls from 60 to 20 um; the long axis is y at one end
 * and z at the other, by way of angles between. */
static struct scene *make_scene(float ratio, bool sections)
{
    enum { N = 11 };
    struct fiber_set f;
    struct scene *s = NULL;
    struct error err = {0};
    fiber_set_init(&f);
    assert_int_equal(fiber_set_reserve(&f, 1, N, NULL), STATUS_OK);
    f.first_vertex[1] = N;
    f.radius_m[0] = 40e-6f;
    f.tile_size_m[0] = f.tile_size_m[1] = 1e-3;
    assert_int_equal(fiber_set_add_shapes(&f, NULL), STATUS_OK);
    for (size_t k = 0; k < N; k++) {
        const float t = (float)k / (N - 1), angle = 1.5707963f * t, sign = k % 2 == 0 ? 1.0f : -1.0f;
        const float p[3] = {1e-3f * t, 250e-6f, 0.0f};
        memcpy(f.position_m + 3 * k, p, sizeof p);
        f.shape[k] = (struct fiber_shape){
            .radius = 60e-6f - 40e-6f * t, .ratio = ratio, .long_axis = {0.0f, sign * cosf(angle), sign * sinf(angle)}};
    }
    if (scene_new(&f, &(struct scene_option){.black_sheet = true, .sections = sections}, &s, &err) != STATUS_OK)
        fail_msg("%s", err.text);
    fiber_set_release(&f);
    return s;
}

static void test_hits_lie_on_the_cone(void **state)
{
    (void)state;
    struct scene *s = make_scene(1.0f, true);
    float normal[3];
    for (int k = 0; k < 9; k++) {
        const float x = 0.1f + 0.1f * (float)k, radius = 0.06f - 0.04f * x;
        struct scene_ray r = {.origin_mm = {x, 0.25f, 0.001f}, .direction = {0.0f, 0.0f, -1.0f}};
        struct scene_hit h;
        assert_true(scene_trace(s, &r, &h));
        /* the top of the cloth, z = 0, is the surface at the thick end; the axis lies 60 um below */
        assert_true(fabsf(h.position_mm[2] - (radius - 0.06f)) < 1e-4f);
        assert_true(fabsf(h.radius_mm - radius) < 3e-4f);
        assert_true(h.normal[0] > 0.02f && h.normal[0] < 0.06f && h.normal[2] > 0.99f); /* the slope is 0.04 */
        assert_false(scene_section_normal(s, &h, normal));                              /* round */
    }
    scene_free(s);
}

static void test_short_axis_of_flat_sections(void **state)
{
    (void)state;
    struct scene *s = make_scene(1.8f, false);
    for (int k = 0; k < 9; k++) { /* the thick end of the next tile covers the thin one */
        const float x = 0.05f + 0.1f * (float)k, angle = 1.5707963f * x; /* in the middle of a segment */
        struct scene_ray r = {.origin_mm = {x, 0.25f, 0.001f}, .direction = {0.0f, 0.0f, -1.0f}};
        struct scene_hit h;
        float normal[3];
        assert_true(scene_trace(s, &r, &h));
        assert_true(scene_section_normal(s, &h, normal));
        /* across the fiber and the long axis, of either sign */
        const float cosine = -normal[1] * sinf(angle) + normal[2] * cosf(angle);
        assert_true(fabsf(fabsf(cosine) - 1.0f) < 1e-4f && fabsf(normal[0]) < 1e-4f);
    }
    scene_free(s);
}

/* Scenes of round sections have round surfaces whatever is asked. */
static void test_who_shows_sections(void **state)
{
    (void)state;
    static const struct {
        float ratio;
        bool asked, shown;
    } of[3] = {{1.0f, true, false}, {1.8f, false, false}, {1.8f, true, true}};
    for (int k = 0; k < 3; k++) {
        struct scene *s = make_scene(of[k].ratio, of[k].asked);
        assert_int_equal(scene_shows_sections(s), of[k].shown);
        scene_free(s);
    }
}

/* A ring of flat fiber in the plane of the cloth, whose long axis is z: from above it is as wide as its short axis. The
 * planes between its segments leave no gap, and a copy from a pack is hit at the same bits. */
static void test_bent_fiber_and_its_copy(void **state)
{
    (void)state;
    enum { N = 25, N_RAY = 5000 };
    const float radius = 20e-6f, ratio = 1.8f, ring = 300e-6f;
    struct fiber_set f;
    struct scene *s = NULL, *copy = NULL;
    struct error err = {0};
    struct byte_pack pack = {0};
    fiber_set_init(&f);
    assert_int_equal(fiber_set_reserve(&f, 1, N, NULL), STATUS_OK);
    f.first_vertex[1] = N;
    f.radius_m[0] = radius;
    f.tile_size_m[0] = f.tile_size_m[1] = 1e-3;
    assert_int_equal(fiber_set_add_shapes(&f, NULL), STATUS_OK);
    for (size_t k = 0; k < N; k++) {
        const float angle = 6.2831853f * (float)k / (N - 1);
        const float p[3] = {500e-6f + ring * cosf(angle), 500e-6f + ring * sinf(angle), 0.0f};
        memcpy(f.position_m + 3 * k, p, sizeof p);
        f.shape[k] = (struct fiber_shape){.radius = radius, .ratio = ratio, .long_axis = {0.0f, 0.0f, 1.0f}};
    }
    if (scene_new(&f, &(struct scene_option){.sections = true}, &s, &err) != STATUS_OK) fail_msg("%s", err.text);
    fiber_set_release(&f);
    scene_pack(s, &pack);
    struct byte_view view = {.data = pack.data, .n = pack.n};
    assert_int_equal(scene_unpack(&view, &copy, NULL), STATUS_OK);
    assert_true(scene_checksum(s, 1) == scene_checksum(copy, 1));
    assert_true(fabs(scene_thickness_mm(s) - 2e3 * (double)(radius * sqrtf(ratio))) < 1e-4);
    /* polygon of 24 corners: its sides lie up to 1 - cos(7.5 degrees) of the ring within it */
    const float half = 1e3f * radius / sqrtf(ratio), inner = 1e3f * ring * 0.9914f - half, outer = 1e3f * ring + half;
    for (int k = 0; k < N_RAY; k++) {
        const float angle = 6.2831853f * (float)k * 0.6180340f, at = inner + (outer - inner) * (float)(k % 100) / 99.0f;
        const float x = 0.5f + at * cosf(angle), y = 0.5f + at * sinf(angle);
        if (fabsf(remainderf(angle, 6.2831853f)) < 0.02f) continue; /* where the ends of the fiber meet */
        struct scene_ray r = {.origin_mm = {x, y, 0.0005f}, .direction = {0.0f, 0.0f, -1.0f}}, again = r;
        struct scene_hit h, same;
        const bool met = scene_trace(s, &r, &h);
        assert_true(scene_trace(copy, &again, &same) == met);
        if (met) assert_memory_equal(&h, &same, sizeof h);
        const float side = fmodf(angle, 6.2831853f / 24.0f) - 3.1415927f / 24.0f, from_side = at * cosf(side),
                    off = fabsf(from_side - 1e3f * ring * 0.99144486f);
        if (off < 0.98f * half) assert_true(met);
        if (off > 1.02f * half) assert_false(met);
    }
    byte_pack_release(&pack);
    scene_free(copy);
    scene_free(s);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_hits_lie_on_the_cone), cmocka_unit_test(test_short_axis_of_flat_sections),
        cmocka_unit_test(test_who_shows_sections), cmocka_unit_test(test_bent_fiber_and_its_copy)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
