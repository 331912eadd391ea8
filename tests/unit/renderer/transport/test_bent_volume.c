/* Volumes on meshes: a flat mesh changes nothing but the noise, no light is lost on a cylinder. */
#include "base/angle.h"
#include "renderer/estimate/render.h"
#include "renderer/mesh/mesh_shapes.h"
#include "renderer/transport/volume/volume_bent.h"
#include "tests/support/scan/hand_volume.h"
#include "tests/support/tracer/trace_input.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static const double density_per_m = 4e4;
static struct volume_scene flat[2]; /* with and without the black sheet */

static int set_up(void **state)
{
    (void)state;
    const size_t n[3] = {30, 34, 13};
    struct direction_volume v;
    hand_volume_weave(&v, n, 8e-6, 0.4);
    for (int k = 0; k < 2; k++)
        if (volume_scene_init(&flat[k], &v, &(struct volume_scene_option){k == 0}, NULL) != STATUS_OK) return 1;
    direction_volume_release(&v);
    return 0;
}

static int tear_down(void **state)
{
    (void)state;
    for (int k = 0; k < 2; k++) volume_scene_release(&flat[k]);
    return 0;
}

static struct configuration view(double light_theta_deg, double crop_m)
{
    return (struct configuration){.light_theta_rad = light_theta_deg * RAD_PER_DEG,
                                  .light_phi_rad = 0.3,
                                  .camera_theta_rad = 40 * RAD_PER_DEG,
                                  .camera_phi_rad = 2.5,
                                  .light_distance_m = 0.6,
                                  .lamp_side_m = 0.1,
                                  .camera_distance_m = 1,
                                  .crop_m = crop_m};
}

static void bend(const struct volume_scene *from, struct mesh *m, bool black_sheet, struct volume_scene *bent)
{
    struct error err = {0};
    if (mesh_check(m, &err) != STATUS_OK || volume_scene_bend(from, m, black_sheet, bent, &err) != STATUS_OK)
        fail_msg("%s", err.text);
    mesh_release(m);
}

static void render(const struct volume_scene *scene, const char *id, const double *param, const struct configuration *c,
                   struct image *im)
{
    struct trace_volume storage;
    struct error err = {0};
    const struct render_request q = {.input = trace_input_volume(scene, phase_find(id), param, density_per_m, &storage),
                                     .configuration = c,
                                     .width = 16,
                                     .height = 16,
                                     .n_sample = 100,
                                     .seed = 5,
                                     .stream = scene->bent != NULL};
    if (render_run(&q, NULL, NULL, im, &err) != STATUS_OK) fail_msg("%s", err.text);
}

static void mean_of(const struct image *im, double *mean, double *variance)
{
    *mean = *variance = 0;
    for (size_t i = 0; i < 256; i++) {
        *mean += (double)im->pixel[i * im->n_channel + 1] / 256;
        *variance += (double)im->pixel[i * im->n_channel + 4] / 65536;
    }
}

/* The mesh is cut so that most paths go through several cells. */
static void a_flat_mesh_changes_nothing(void **state)
{
    (void)state;
    static const char *const id[] = {"phase_two_lobe.v1", "microflake.v1"};
    for (int k = 0; k < 4; k++) {
        const struct phase_model *m = phase_find(id[k / 2]);
        const struct configuration c = view(k % 2 == 0 ? 50 : 140, 1e-3);
        double param[SCATTERING_MAX_PARAM], mean[2], variance[2];
        struct volume_scene bent;
        struct mesh mesh;
        struct image im;
        for (size_t p = 0; p < m->n_param; p++) param[p] = m->param[p].start;
        assert_int_equal(mesh_flat((const double[2]){6, 6}, (const size_t[2]){57, 43}, &mesh, NULL), STATUS_OK);
        bend(&flat[k % 2], &mesh, k % 2 == 0, &bent);
        render(&flat[k % 2], id[k / 2], param, &c, &im);
        mean_of(&im, &mean[0], &variance[0]);
        image_release(&im);
        render(&bent, id[k / 2], param, &c, &im);
        mean_of(&im, &mean[1], &variance[1]);
        image_release(&im);
        double se = sqrt(variance[0] + variance[1]);
        if (fabs(mean[0] - mean[1]) > 4 * se || !(se < 0.1 * mean[0]))
            fail_msg("%s: flat %g, bent %g, standard error %g", id[k / 2], mean[0], mean[1], se);
        volume_scene_release(&bent);
    }
}

/* In a uniform environment of radiance 1 every path of n bounces has the radiance alpha^n, and over the sheet that or
 * nothing. */
static void no_light_is_lost_on_the_cylinder(void **state)
{
    (void)state;
    const double alpha = 0.999, grey[3] = {alpha, alpha, alpha};
    const struct phase_model *model = phase_find("phase_isotropic.v1");
    struct volume_parameters parameters = {.model = model, .multiplier_per_m = density_per_m};
    struct configuration c = view(50, 6e-3);
    assert_int_equal(model->prepare(grey, &parameters.state, NULL), STATUS_OK);
    c.light = LIGHT_NO_LAMP;
    for (int k = 0; k < 3; k++) c.environment_rgb[k] = 1;
    for (int sheet = 0; sheet < 2; sheet++) {
        struct volume_scene bent;
        struct volume_setting setting;
        struct mesh m;
        double worst = 0;
        size_t n_dark = 0, n_bounce = 0;
        assert_int_equal(mesh_cylinder(2, 4, 1.4, 100, &m, NULL), STATUS_OK);
        bend(&flat[1 - sheet], &m, sheet == 1, &bent);
        volume_setting_init(&setting, &bent, &parameters, &c, false);
        setting.roulette_below = 0;
        for (uint32_t i = 0; i < 4000; i++) {
            struct rng rng;
            struct volume_result path;
            rng_start(&rng, &(struct rng_key){3, 0, 0, 0}, i, 0);
            double x = 3 * (rng_double(&rng) - 0.5), y = 3 * (rng_double(&rng) - 0.5), tilt = rng_double(&rng) - 0.5;
            const double d[3] = {sin(tilt), 0, -cos(tilt)}, origin[3] = {x - 50 * d[0], y, -50 * d[2]};
            volume_bent_trace(&setting, origin, d, &rng, &path);
            bool dark = sheet == 1 && path.radiance[0] == 0;
            n_dark += dark;
            n_bounce += path.n_bounce;
            if (!dark) worst = fmax(worst, fabs((double)path.radiance[0] - pow(alpha, path.n_bounce)));
        }
        if (worst > 1e-4) fail_msg("the radiance of a path is wrong by %g", worst);
        assert_true(n_bounce > 4000 && (n_dark > 100) == (sheet == 1));
        volume_scene_release(&bent);
    }
    model->release(parameters.state);
}

static void what_is_refused(void **state)
{
    (void)state;
    struct volume_scene bent;
    struct mesh m;
    struct error err = {0};
    assert_int_equal(mesh_cylinder(0.04, 1, 1.5, 100, &m, NULL), STATUS_OK);
    assert_int_equal(volume_scene_bend(&flat[0], &m, true, &bent, &err), STATUS_INVALID);
    assert_non_null(strstr(err.text, "folds over itself"));
    volume_scene_release(&bent);
    mesh_release(&m);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_flat_mesh_changes_nothing),
        cmocka_unit_test(no_light_is_lost_on_the_cylinder),
        cmocka_unit_test(what_is_refused),
    };
    return cmocka_run_group_tests(tests, set_up, tear_down);
}
