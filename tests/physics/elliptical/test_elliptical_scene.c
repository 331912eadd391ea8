/* A scene of fibers with elliptical sections: hits against the closed form, the mean free path in a random medium,
 * energy from the side of the camera, reciprocity of a single layer, and the derivative of the factor of the widths.
 */
#include "base/angle.h"
#include "renderer/mesh/mesh_shapes.h"
#include "renderer/transport/surface/path_scatter.h"
#include "tests/support/cloth/hand_weave.h"
#include "tests/support/statistics_test.h"
#include "tests/support/tracer/environment/uniform_environment.h"
#include "tests/support/tracer/estimate_fixture.h"
#include "tests/support/tracer/trace_input.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "tests/support/model/prepared_model.h"

enum { N_FIBER = 60, N_ROW = 12 };
#define RADIUS_MM 0.01
#define TILE_MM 1.0
#define DEPTH_MM 1.0
#define RATIO 2.0

/* C_T of three channels, from which a parabola extrapolates to 1. */
static const double param[8] = {0.999, 0.998, 0.997, 1.55, RATIO, 3 * RAD_PER_DEG, 8 * RAD_PER_DEG, 15 * RAD_PER_DEG};

/* Fibers along x at random places of a slab, each with its section turned at random. */
struct medium {
    double y_z_m[N_FIBER][2], turn_rad[N_FIBER]; /* of the long axis, from y */
    struct scene *scene;
};

static struct scene *make_scene(const struct medium *m, size_t n, double radius_mm)
{
    struct fiber_set f;
    struct scene *scene = NULL;
    struct error err = {0};
    hand_straight(&f, n, (const double(*)[2])m->y_z_m, 1e-3 * TILE_MM, 1e-3 * radius_mm);
    assert_int_equal(fiber_set_add_shapes(&f, NULL), STATUS_OK);
    for (size_t v = 0; v < f.n_vertex; v++) {
        const double turn = m->turn_rad[v / 2];
        f.shape[v].ratio = (float)RATIO;
        f.shape[v].long_axis[1] = (float)cos(turn);
        f.shape[v].long_axis[2] = (float)sin(turn);
    }
    if (scene_new(&f, &(struct scene_option){.sections = true}, &scene, &err) != STATUS_OK) fail_msg("%s", err.text);
    fiber_set_release(&f);
    return scene;
}

static void make_medium(struct medium *m)
{
    struct rng r;
    rng_start(&r, &(struct rng_key){91, 0, 0, 0}, 0, 0);
    for (int i = 0; i < N_FIBER; i++) {
        m->y_z_m[i][0] = 1e-3 * TILE_MM * rng_double(&r);
        m->y_z_m[i][1] = -1e-3 * DEPTH_MM * rng_double(&r);
        m->turn_rad[i] = M_PI * rng_double(&r);
    }
    m->scene = make_scene(m, N_FIBER, RADIUS_MM);
}

static struct medium with_sections;

static int make_all(void **state)
{
    (void)state;
    make_medium(&with_sections);
    return 0;
}

static int free_all(void **state)
{
    (void)state;
    scene_free(with_sections.scene);
    return 0;
}

/* Half of the width that fiber i shows to a ray whose direction across it is at an angle from y. */
static double half_width_mm(const struct medium *m, int i, double angle_rad)
{
    const double from_long = angle_rad - m->turn_rad[i], a = sqrt(RATIO) * sin(from_long),
                 b = cos(from_long) / sqrt(RATIO);
    return RADIUS_MM * sqrt(a * a + b * b);
}

/* Distance to the first fiber that a ray down the plane across them meets, in double precision, by all fibers and their
 * copies; INFINITY: none. z is that of the fiber set. */
static double first_hit_mm(const struct medium *m, double y_mm, double z_mm, double angle_rad, double *second)
{
    double nearest = INFINITY;
    *second = INFINITY;
    for (int i = 0; i < N_FIBER; i++)
        for (int copy = -12; copy <= 12; copy++) {
            const double c = cos(m->turn_rad[i]), s = sin(m->turn_rad[i]), dy = cos(angle_rad), dz = sin(angle_rad);
            const double oy = y_mm - 1e3 * m->y_z_m[i][0] - copy * TILE_MM, oz = z_mm - 1e3 * m->y_z_m[i][1];
            const double major = RADIUS_MM * sqrt(RATIO), minor = RADIUS_MM / sqrt(RATIO);
            const double ow = (oy * c + oz * s) / major, ov = (oz * c - oy * s) / minor;
            const double dw = (dy * c + dz * s) / major, dv = (dz * c - dy * s) / minor;
            const double q = dw * dw + dv * dv, b = ow * dw + ov * dv, root2 = b * b - q * (ow * ow + ov * ov - 1);
            if (root2 <= 0) continue;
            const double t = (-b - sqrt(root2)) / q;
            if (t <= 0) continue;
            *second = t < nearest ? nearest : fmin(*second, t);
            nearest = fmin(nearest, t);
        }
    return nearest;
}

/* The rays of the scene against the closed form, also after crossing tiles: place, normal, short axis, and the width
 * that the model takes the section to show. */
static void hits_lie_on_the_ellipses(void **state)
{
    (void)state;
    enum { N_RAY = 20000 };
    const struct medium *m = &with_sections;
    const struct scattering_model *model = scattering_find("elliptical_oriented.v1");
    struct scattering_state *s = prepare(model, param);
    struct rng r;
    rng_start(&r, &(struct rng_key){92, 0, 0, 0}, 0, 0);
    int n_hit = 0, n_differ = 0;
    double top_mm = -INFINITY;
    for (int i = 0; i < N_FIBER; i++)
        top_mm = fmax(top_mm, 1e3 * m->y_z_m[i][1] + half_width_mm(m, i, 0)); /* seen along y: how high it is */
    for (int k = 0; k < N_RAY; k++) {
        const double y = TILE_MM * rng_double(&r), angle = -M_PI * (0.1 + 0.8 * rng_double(&r));
        struct scene_ray ray;
        struct scene_hit hit;
        assert_true(scene_ray_enter(m->scene, (const double[3]){0.5, y, 1e-6},
                                    (const double[3]){0, cos(angle), sin(angle)}, &ray));
        double second;
        const double want = first_hit_mm(m, y, top_mm + 1e-6, angle, &second);
        const bool met = scene_trace(m->scene, &ray, &hit);
        const double got = met ? (1e-6 - (double)hit.position_mm[2]) / -sin(angle) : INFINITY;
        n_hit += met;
        if (met != isfinite(want) || (met && fabs(got - want) > 2e-4 * RADIUS_MM / fmax(1e-2, fabs(sin(angle))))) {
            n_differ++; /* rays that graze an ellipse to the last digits */
            continue;
        }
        if (!met) continue;
        float normal[3];
        assert_true(scene_section_normal(m->scene, &hit, normal));
        const int fiber = (int)scene_fiber_of(m->scene, hit.i_segment);
        const double turn = m->turn_rad[fiber];
        assert_true(fabs((double)normal[1] * cos(turn) + (double)normal[2] * sin(turn)) < 1e-5);
        assert_true((double)hit.normal[1] * cos(angle) + (double)hit.normal[2] * sin(angle) < 1e-3);
        struct fiber_frame frame;
        float back[3];
        fiber_frame_flat_in(&frame, hit.tangent, normal);
        fiber_frame_to_local(&frame, (const float[3]){0, -(float)cos(angle), -(float)sin(angle)}, back);
        assert_true(fabs((double)model->width(s, back, NULL) * RADIUS_MM / half_width_mm(m, fiber, angle) - 1) < 1e-4);
    }
    model->release(s);
    print_message("%d of %d rays hit, %d differ\n", n_hit, N_RAY, n_differ);
    assert_true(n_hit > N_RAY / 2 && n_differ < N_RAY / 500);
}

static bool count(void *context, uint32_t i_segment, float sin_theta)
{
    (void)i_segment;
    (void)sin_theta;
    ++*(int *)context;
    return true;
}

/* The mean number of fibers on a ray through the whole slab is the sum of the widths that they show over the width of
 * the tile as the ray sees it, also for rays that run aslant along the fibers: that makes the mean free path what the
 * projected width demands. Tubes of the same area would have another number. */
static void mean_free_path(void **state)
{
    (void)state;
    enum { N_RAY = 40000 };
    static const double angle_deg[3] = {-90, -60, -140};
    for (int k = 0; k < 3; k++) {
        const double angle = angle_deg[k] * RAD_PER_DEG, slant = 0.3 * k;
        double want = 0, of_tubes = 0;
        for (int i = 0; i < N_FIBER; i++) {
            want += 2 * half_width_mm(&with_sections, i, angle) / (TILE_MM * fabs(sin(angle)));
            of_tubes += 2 * RADIUS_MM / (TILE_MM * fabs(sin(angle)));
        }
        struct sample_mean mean = {0};
        struct rng r;
        rng_start(&r, &(struct rng_key){93, 0, 0, 0}, (uint32_t)k, 0);
        for (int i = 0; i < N_RAY; i++) {
            const double start[3] = {TILE_MM * rng_double(&r), TILE_MM * rng_double(&r), 0.01};
            const double d[3] = {sin(slant), cos(slant) * cos(angle), cos(slant) * sin(angle)};
            struct scene_ray ray;
            int n = 0;
            assert_true(scene_ray_enter(with_sections.scene, start, d, &ray));
            assert_true(scene_visit_ahead(with_sections.scene, &ray, count, &n));
            sample_mean_add(&mean, n);
        }
        const double se = sample_mean_se(&mean);
        print_message("%g degrees: %.4f +- %.4f fibers, by widths %.4f, of tubes %.4f\n", angle_deg[k], mean.mean, se,
                      want, of_tubes);
        assert_true(fabs(mean.mean - want) < 4 * se);
        assert_true(fabs(want - of_tubes) > 8 * se);
    }
}

static struct configuration far_away(double lamp_deg, double lamp_phi_deg, double camera_deg, double camera_phi_deg)
{
    return (struct configuration){.light_theta_rad = lamp_deg * RAD_PER_DEG,
                                  .light_phi_rad = lamp_phi_deg * RAD_PER_DEG,
                                  .camera_theta_rad = camera_deg * RAD_PER_DEG,
                                  .camera_phi_rad = camera_phi_deg * RAD_PER_DEG,
                                  .crop_m = 0.1,
                                  .light = LIGHT_DIRECTIONAL,
                                  .camera = CAMERA_FAR_FIELD};
}

/* Radiance of clear fibers in a uniform environment of radiance 1, with its standard error and the mean number of
 * bounces of a path. */
static double furnace(const struct scene *scene, const struct configuration *c, bool shows_width, double *se,
                      double *n_bounce)
{
    enum { N_PATH = 30000 };
    const struct scattering_model *m = scattering_find("elliptical_oriented.v1");
    struct scattering_state *s = prepare(m, param);
    struct path_setting setting;
    struct camera camera;
    struct sample_mean mean[3] = {{0}};
    path_setting_init(&setting, scene, m, s, c, false);
    assert_true(setting.shows_width);
    setting.shows_width = shows_width;
    camera_init(&camera, c);
    uniform_environment_set(&setting);
    setting.guided_paths = false;
    *n_bounce = 0;
    for (uint32_t i = 0; i < N_PATH; i++) {
        struct path_result path;
        uniform_environment_trace(&setting, &camera, 94, i, &path);
        for (int k = 0; k < 3; k++) sample_mean_add(&mean[k], (double)path.radiance[k]);
        *n_bounce += path.n_bounce / (double)N_PATH;
    }
    m->release(s);
    *se = sample_mean_se(&mean[0]);
    return 3 * mean[0].mean - 3 * mean[1].mean + mean[2].mean;
}

/* What comes from all sides leaves to the camera, from every side of flat fibers. Each bounce of the model may lose or
 * gain 1e-3 + (a^2 - 1) h^2 / 8 (test_elliptical_oriented.c, lossless). Without the widths it does not. */
static void lossless_cloth(void **state)
{
    (void)state;
    const double h = 3.75 * RAD_PER_DEG, each = 1e-3 + (RATIO * RATIO - 1) * h * h / 8;
    double worst_without = 0;
    for (int k = 0; k < 3; k++) {
        const struct configuration c = far_away(0, 0, 10 + 30 * k, 90);
        double se, n, unused;
        const double white = furnace(with_sections.scene, &c, true, &se, &n),
                     without = furnace(with_sections.scene, &c, false, &unused, &unused);
        print_message("camera at %d degrees: %.5f +- %.5f after %.2f bounces; without widths %.5f\n", 10 + 30 * k,
                      white, se, n, without);
        assert_true(fabs(white - 1) < 4 * se + n * each);
        worst_without = fmax(worst_without, fabs(without - 1));
    }
    assert_true(worst_without > 0.01);
}

/* The same on a cylinder, where rays reach the sections in cells of the shell that are sheared and turned. */
static void lossless_bent_cloth(void **state)
{
    (void)state;
    const double h = 3.75 * RAD_PER_DEG, each = 1e-3 + (RATIO * RATIO - 1) * h * h / 8;
    struct mesh m;
    struct scene *bent = NULL;
    struct error err = {0};
    double se, n, unused;
    assert_int_equal(mesh_cylinder(15, 20, 1.5, 200, &m, NULL), STATUS_OK);
    if (mesh_check(&m, &err) != STATUS_OK || scene_bend(with_sections.scene, &m, false, &bent, &err) != STATUS_OK)
        fail_msg("%s", err.text);
    const struct configuration c = {.camera_theta_rad = 30 * RAD_PER_DEG,
                                    .camera_distance_m = 0.6,
                                    .camera_phi_rad = M_PI_2,
                                    .crop_m = 0.01,
                                    .light = LIGHT_DIRECTIONAL};
    const double white = furnace(bent, &c, true, &se, &n), without = furnace(bent, &c, false, &unused, &unused);
    print_message("%.5f +- %.5f after %.2f bounces; without widths %.5f\n", white, se, n, without);
    assert_true(n > 1 && fabs(white - 1) < 4 * se + n * each && fabs(without - 1) > 0.01);
    scene_free(bent);
    mesh_release(&m);
}

/* Exchanging lamp and camera leaves radiance over cos(theta of the lamp) the same: fibers of one layer that do not
 * shade each other, all turned by the same angle. Light leaves this model's fibers where they are seen, so cloth that
 * shades parts of their widths is not reciprocal (test_reciprocity.c). */
static void reciprocal_cloth(void **state)
{
    (void)state;
    enum { N_PAIR = 2 };
    const struct configuration c[2 * N_PAIR] = {far_away(25, 90, 60, 250), far_away(60, 250, 25, 90),
                                                far_away(50, 70, 15, 100), far_away(15, 100, 50, 70)};
    const size_t n_path[2 * N_PAIR] = {200000, 200000, 200000, 200000};
    struct medium row;
    for (int i = 0; i < N_ROW; i++) {
        row.y_z_m[i][0] = 1e-3 * TILE_MM * (i + 0.5) / N_ROW;
        row.y_z_m[i][1] = 0;
        row.turn_rad[i] = 0.5;
    }
    row.scene = make_scene(&row, N_ROW, 0.4 * RADIUS_MM);
    struct appearance model;
    struct estimate e[2 * N_PAIR];
    const struct estimate_request q = {
        .input = trace_input_surface(row.scene, scattering_find("elliptical_oriented.v1"), param, &model),
        .configuration = c,
        .n_configuration = 2 * N_PAIR,
        .n_path = n_path,
        .seed = 7};
    estimate_fixture_run(&q, 0, e);
    for (int k = 0; k < N_PAIR; k++) {
        const struct estimate *a = &e[2 * k], *b = a + 1;
        const double ratio =
                         a->mean[0] / cos(c[2 * k].light_theta_rad) / (b->mean[0] / cos(c[2 * k + 1].light_theta_rad)),
                     se = ratio * sqrt(a->var[0] / (a->mean[0] * a->mean[0]) + b->var[0] / (b->mean[0] * b->mean[0]));
        print_message("pair %d: ratio %.4f +- %.4f\n", k, ratio, se);
        assert_true(se < 0.02 && fabs(ratio - 1) < 3.5 * se);
    }
    scene_free(row.scene);
}

/* The factor of the widths and the derivative of its logarithm against differences; the other parameters do not move
 * it. */
static void derivatives_of_the_widths(void **state)
{
    (void)state;
    enum { P_RATIO = 4 };
    const struct scattering_model *m = scattering_find("elliptical_oriented.v1");
    const double step = 1e-2;
    struct scattering_state *s = prepare(m, param), *moved[2];
    for (int side = 0; side < 2; side++) {
        double at[8];
        memcpy(at, param, sizeof at);
        at[P_RATIO] += side == 0 ? -step : step;
        moved[side] = prepare(m, at);
    }
    struct rng r;
    rng_start(&r, &(struct rng_key){96, 0, 0, 0}, 0, 0);
    for (int k = 0; k < 1000; k++) {
        float w[2][3], score[3 * 8] = {0};
        double ln[2];
        for (int i = 0; i < 2; i++) {
            const double theta = 3 * (rng_double(&r) - 0.5), phi = 2 * M_PI * rng_double(&r);
            w[i][0] = (float)sin(theta);
            w[i][1] = (float)(cos(theta) * cos(phi));
            w[i][2] = (float)(cos(theta) * sin(phi));
        }
        const float there = path_scatter_widths(m, s, w[0], w[1], score);
        const float back = path_scatter_widths(m, s, w[1], w[0], NULL);
        assert_true(fabs((double)(there * back) - 1) < 1e-5);
        for (int side = 0; side < 2; side++)
            ln[side] = log((double)path_scatter_widths(m, moved[side], w[0], w[1], NULL));
        for (size_t c = 0; c < 3; c++)
            for (size_t p = 0; p < 8; p++) {
                const double want = p == P_RATIO ? (ln[1] - ln[0]) / (2 * step) : 0;
                /* rounding of single precision over the step, and its cube */
                if (fabs((double)score[c * 8 + p] - want) > 1e-4) fail_msg("%g for %g", (double)score[c * 8 + p], want);
            }
    }
    for (int side = 0; side < 2; side++) m->release(moved[side]);
    m->release(s);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(hits_lie_on_the_ellipses), cmocka_unit_test(mean_free_path),
        cmocka_unit_test(lossless_cloth),           cmocka_unit_test(lossless_bent_cloth),
        cmocka_unit_test(reciprocal_cloth),         cmocka_unit_test(derivatives_of_the_widths)};
    return cmocka_run_group_tests(tests, make_all, free_all);
}
