/* Previews by diffusion: no light is lost, the deep medium of straight fibers in closed form, its density, a velvet
 * against path tracing and dual scattering, a mesh against the flat cloth, and what is refused. */
#include "base/angle.h"
#include "base/rng.h"
#include "renderer/estimate/estimate.h"
#include "renderer/estimate/radiance_source.h"
#include "renderer/mesh/mesh_shapes.h"
#include "renderer/quick/diffusion_tables.h"
#include "tests/support/cloth/dual_cloth.h"
#include "tests/support/cloth/hand_weave.h"
#include "tests/support/cloth/make_phantom.h"
#include "tests/support/statistics_test.h"
#include "tests/support/tracer/trace_input.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static void velvet(struct fiber_set *f)
{
    struct phantom_option o;
    struct phantom_report report;
    phantom_option_default(&o, PHANTOM_VELVET);
    make_phantom(&o, 0, f, &report);
}

/* Releases f. Without averages for dual scattering; fraction: what fibers of isotropic.v1 scatter. */
static void cloth_of(struct dual_cloth *c, struct fiber_set *f, double fraction)
{
    struct error err = {0};
    memset(c, 0, sizeof *c);
    if (scene_new(f, &(struct scene_option){false}, &c->scene, &err) != STATUS_OK) fail_msg("%s", err.text);
    fiber_set_release(f);
    c->model = scattering_find("isotropic.v1");
    for (size_t p = 0; p < c->model->n_param; p++) c->param[p] = fraction;
}

static void tables_of(const struct dual_cloth *c, uint32_t n_traced, uint32_t n_walk, struct diffusion_tables *t)
{
    struct error err = {0};
    const struct diffusion_request q = {
        .scene = c->scene, .model = c->model, .param = c->param, .n_traced = n_traced, .n_walk = n_walk};
    if (diffusion_tables_make(&q, NULL, NULL, t, &err) != STATUS_OK) fail_msg("%s", err.text);
}

static struct configuration view_of(double light_deg, double camera_deg)
{
    return (struct configuration){.light_theta_rad = light_deg * RAD_PER_DEG,
                                  .light_phi_rad = 90 * RAD_PER_DEG,
                                  .camera_theta_rad = camera_deg * RAD_PER_DEG,
                                  .camera_phi_rad = 270 * RAD_PER_DEG,
                                  .light = LIGHT_DIRECTIONAL,
                                  .camera = CAMERA_FAR_FIELD,
                                  .crop_m = 1e-3};
}

/* The sky of radiance 1, and no lamp. */
static struct configuration sky_of(double camera_deg)
{
    struct configuration c = view_of(0, camera_deg);
    c.light = LIGHT_NO_LAMP;
    for (int k = 0; k < 3; k++) c.environment_rgb[k] = 1;
    return c;
}

/* diffusion and dual may be NULL. */
static void estimate_of(const struct scene *scene, const struct dual_cloth *c, const struct configuration *view,
                        const struct diffusion_option *diffusion, const struct dual_option *dual, struct estimate *e)
{
    struct appearance model;
    struct error err = {0};
    size_t n_path = 4096;
    struct estimate_request q = {.input = trace_input_surface(scene, c->model, c->param, &model),
                                 .configuration = view,
                                 .n_configuration = 1,
                                 .n_path = &n_path,
                                 .seed = 21,
                                 .replica = diffusion != NULL || dual != NULL};
    q.input.diffusion = diffusion;
    q.input.dual = dual;
    if (estimate_run(&q, NULL, NULL, e, &err) != STATUS_OK) fail_msg("%s", err.text);
}

/* Under a sky of radiance 1 on both sides, a cloth that absorbs nothing is as bright. After one traced hit that holds
 * from every side, after two in the mean over all directions of the eye, as they are seen. */
static void furnace(void **state)
{
    (void)state;
    static struct diffusion_tables t[2];
    struct fiber_set f;
    struct dual_cloth c;
    struct sample_mean all = {0};
    velvet(&f);
    cloth_of(&c, &f, 1);
    for (uint32_t i = 0; i < 2; i++) tables_of(&c, i + 1, 16384, &t[i]);
    for (int k = 0; k < 3; k++) {
        double more = t[1].share[0][k] + t[1].share[1][k];
        assert_true(more > 0.3 && more < 1.0); /* the rest leaves within the traced hits */
    }
    for (int i = 0; i < 9; i++) {
        struct estimate e;
        struct configuration sky = sky_of(acos(sqrt((i + 0.5) / 9.0)) / RAD_PER_DEG);
        sky.camera_phi_rad = 2.4 * i;
        const struct diffusion_option option[2] = {{&t[0]}, {&t[1]}};
        estimate_of(c.scene, &c, &sky, &option[1], NULL, &e);
        sample_mean_add(&all, e.mean[1]);
        if (i % 4 != 0) continue;
        print_message("furnace at %.0f degrees: two hits %.4f +- %.4f", sky.camera_theta_rad / RAD_PER_DEG, e.mean[1],
                      sqrt(e.var[1]));
        estimate_of(c.scene, &c, &sky, &option[0], NULL, &e);
        print_message(", one hit %.4f +- %.4f\n", e.mean[1], sqrt(e.var[1]));
        /* a cell of directions has some 110 walks, and four of them count: 1 % each way */
        assert_true(fabs(e.mean[1] - 1.0) < 0.03 + 4.0 * sqrt(e.var[1]));
    }
    print_message("furnace: two hits, mean %.4f +- %.4f\n", all.mean, sample_mean_se(&all));
    assert_true(fabs(all.mean - 1.0) < 4.0 * sample_mean_se(&all) && sample_mean_se(&all) < 0.03);
    dual_cloth_release(&c);
}

/* ---- straight fibers ---- */

/* n straight fibers of radius 1 um at random in a layer of 1 mm; tile 0.4 mm. */
static void random_layer(size_t n, uint64_t seed, double scale, struct fiber_set *f)
{
    double(*y_z)[2] = malloc(n * sizeof *y_z);
    struct rng rng;
    rng_start(&rng, &(struct rng_key){.seed = seed}, 0, 0);
    for (size_t i = 0; i < n; i++) {
        y_z[i][0] = scale * 0.4e-3 * rng_double(&rng);
        y_z[i][1] = -scale * 1e-3 * rng_double(&rng);
    }
    hand_straight(f, n, (const double(*)[2])y_z, scale * 0.4e-3, scale * 1e-6);
    free(y_z);
}

/* Radiance of a deep medium of parallel fibers across which light is scattered alike in all directions, under a sky of
 * radiance 1: 1 - sqrt(1 - a) H(mu), mu being the cosine of the eye's azimuth about the fibers to the normal. H is that
 * of two dimensions: ln H = -mu / pi times the integral of ln(1 - a / sqrt(1 + t^2)) / (1 + mu^2 t^2) over t > 0, with
 * t = tan(x) / mu. */
static double deep_radiance(double a, double mu)
{
    enum { N = 4000 };
    double sum = 0.0;
    for (int i = 0; i < N; i++) {
        double t = tan(0.5 * M_PI * (i + 0.5) / N) / mu;
        sum += log(1.0 - a / sqrt(1.0 + t * t)) * 0.5 * M_PI / N;
    }
    return 1.0 - sqrt(1.0 - a) * exp(-sum / M_PI);
}

/* Paths and diffusion have the radiance of the closed form, over four random layers ten mean free paths thick. Fibers
 * fill 1.6 % of the space, which the closed form takes to be none. */
static void deep_layer_in_closed_form(void **state)
{
    (void)state;
    static struct diffusion_tables t;
    static const double filled = 0.016;
    const struct diffusion_option option = {&t};
    struct sample_mean path[2] = {{0}}, preview[2] = {{0}};
    for (uint64_t seed = 1; seed <= 4; seed++) {
        struct fiber_set f;
        struct dual_cloth c;
        random_layer(2000, seed, 1, &f);
        cloth_of(&c, &f, 0.8);
        tables_of(&c, 1, 16384, &t);
        for (int i = 0; i < 2; i++) {
            struct configuration sky = sky_of(60.0 * i); /* the eye turns about the fibers */
            struct estimate e;
            estimate_of(c.scene, &c, &sky, NULL, NULL, &e);
            sample_mean_add(&path[i], e.mean[1]);
            estimate_of(c.scene, &c, &sky, &option, NULL, &e);
            sample_mean_add(&preview[i], e.mean[1]);
        }
        dual_cloth_release(&c);
    }
    for (int i = 0; i < 2; i++) {
        double wanted = deep_radiance(0.8, cos(60.0 * i * RAD_PER_DEG));
        print_message("deep layer at %d degrees: closed form %.4f, paths %.4f +- %.4f, diffusion %.4f +- %.4f\n",
                      60 * i, wanted, path[i].mean, sample_mean_se(&path[i]), preview[i].mean,
                      sample_mean_se(&preview[i]));
        assert_true(fabs(path[i].mean - wanted) < filled * wanted + 4.0 * sample_mean_se(&path[i]));
        assert_true(fabs(preview[i].mean - wanted) < filled * wanted + 4.0 * sample_mean_se(&preview[i]));
    }
}

/* Half as many fibers: light comes back as much, from twice as far (the dissertation prints the root of the density,
 * the wrong way up; that is of cloths that are magnified as a whole). Magnified by 2, all lengths double. */
static void density_and_scale(void **state)
{
    (void)state;
    static struct diffusion_tables t;
    static const struct {
        size_t n;
        double scale, length;
    } is[3] = {{4000, 1, 1}, {2000, 1, 2}, {4000, 2, 2}};
    struct sample_mean share[3] = {{0}}, depth[3] = {{0}};
    for (int i = 0; i < 3; i++)
        for (uint64_t seed = 1; seed <= 4; seed++) {
            struct fiber_set f;
            struct dual_cloth c;
            random_layer(is[i].n, seed, is[i].scale, &f);
            cloth_of(&c, &f, 0.8);
            tables_of(&c, 2, 8192, &t);
            sample_mean_add(&share[i], t.share[0][1]);
            sample_mean_add(&depth[i], t.dipole[0][1].depth_mm / is[i].length);
            dual_cloth_release(&c);
        }
    for (int i = 0; i < 3; i++)
        print_message("density: share %.4f +- %.4f, depth over length %.4f +- %.4f mm\n", share[i].mean,
                      sample_mean_se(&share[i]), depth[i].mean, sample_mean_se(&depth[i]));
    for (int i = 1; i < 3; i++) {
        double share_se = hypot(sample_mean_se(&share[0]), sample_mean_se(&share[i])),
               depth_se = hypot(sample_mean_se(&depth[0]), sample_mean_se(&depth[i]));
        assert_true(fabs(share[i].mean - share[0].mean) < 4.0 * share_se + 0.032 * share[0].mean);
        assert_true(fabs(depth[i].mean - depth[0].mean) < 4.0 * depth_se + 0.032 * depth[0].mean);
    }
}

/* ---- a velvet ---- */

static void velvet_under_lamps(void **state)
{
    (void)state;
    static struct diffusion_tables t;
    const struct diffusion_option option = {&t};
    struct fiber_set f;
    struct dual_cloth c;
    double error2[2] = {0.0, 0.0}, difference[2] = {0.0, 0.0}, mean = 0.0, noise2 = 0.0;
    velvet(&f);
    dual_cloth_init(&c, &f, 0, dual_cloth_wide);
    const struct dual_option dual = {&c.tables, 1, 1};
    tables_of(&c, 2, 16384, &t);
    for (int i = 0; i < 6; i++) {
        struct estimate path, other[2];
        struct configuration view = view_of(15.0 + 30.0 * (i % 3), i < 3 ? 10.0 : 55.0);
        estimate_of(c.scene, &c, &view, NULL, NULL, &path);
        estimate_of(c.scene, &c, &view, &option, NULL, &other[0]);
        estimate_of(c.scene, &c, &view, NULL, &dual, &other[1]);
        for (int k = 0; k < 3; k++) {
            mean += path.mean[k] / 18.0;
            noise2 += (path.var[k] + other[0].var[k]) / 18.0;
            for (int m = 0; m < 2; m++) {
                error2[m] += pow(other[m].mean[k] - path.mean[k], 2) / 18.0;
                difference[m] += (other[m].mean[k] - path.mean[k]) / 18.0;
            }
        }
    }
    print_message("velvet: diffusion rms %.3f, mean %+.3f; dual scattering rms %.3f, mean %+.3f; noise %.3f\n",
                  sqrt(error2[0]) / mean, difference[0] / mean, sqrt(error2[1]) / mean, difference[1] / mean,
                  sqrt(noise2) / mean);
    assert_true(error2[0] < 0.25 * error2[1] && fabs(difference[0]) < 0.25 * fabs(difference[1]));
    dual_cloth_release(&c);
}

/* The shell of a level mesh shades nothing: light that enters beside a hit is that of the flat cloth. */
static void level_mesh_is_the_flat_cloth(void **state)
{
    (void)state;
    static struct diffusion_tables t;
    const struct diffusion_option option = {&t};
    struct fiber_set f;
    struct dual_cloth c;
    struct mesh m;
    struct scene *level;
    struct estimate flat, bent;
    struct error err = {0};
    struct configuration view = view_of(40, 20);
    velvet(&f);
    cloth_of(&c, &f, 0.8);
    tables_of(&c, 2, 4096, &t);
    assert_int_equal(mesh_flat((const double[2]){20, 20}, (const size_t[2]){8, 8}, &m, &err), STATUS_OK);
    assert_int_equal(scene_bend(c.scene, &m, false, &level, &err), STATUS_OK);
    mesh_release(&m);
    estimate_of(c.scene, &c, &view, &option, NULL, &flat);
    estimate_of(level, &c, &view, &option, NULL, &bent);
    for (int k = 0; k < 3; k++) assert_true(fabs(flat.mean[k] - bent.mean[k]) < 4.0 * sqrt(flat.var[k] + bent.var[k]));
    scene_free(level);
    dual_cloth_release(&c);
}

static void refuse(struct radiance_input *in, const struct configuration *view, const char *why)
{
    struct radiance_source source;
    struct error err = {0};
    assert_int_equal(radiance_source_init(&source, in, view, 1, &err), STATUS_INVALID);
    assert_non_null(strstr(err.text, why));
}

static void what_is_refused(void **state)
{
    (void)state;
    static struct diffusion_tables t, none;
    struct diffusion_option option = {&t};
    struct fiber_set f;
    struct dual_cloth pile, weave;
    struct appearance model;
    struct configuration view = view_of(40, 20);
    struct error err = {0};
    velvet(&f);
    cloth_of(&pile, &f, 0.5);
    hand_weave_small(&f);
    cloth_of(&weave, &f, 0.5);
    double standing[2];
    assert_int_equal(diffusion_check_pile(pile.scene, &standing[0], &err), STATUS_OK);
    assert_int_equal(diffusion_check_pile(weave.scene, &standing[1], &err), STATUS_INVALID);
    print_message("standing: velvet %.2f, hand weave %.2f\n", standing[0], standing[1]);
    assert_true(standing[0] > 0.9 && standing[1] == 0.0);
    assert_non_null(strstr(err.text, "pile"));
    assert_string_equal(err.field, "cloth");
    tables_of(&pile, 2, 1024, &t);
    struct radiance_input in = trace_input_surface(weave.scene, weave.model, weave.param, &model);
    in.diffusion = &option;
    refuse(&in, &view, "another cloth");
    in.scene.fibers = pile.scene;
    in.want_derivative = true;
    refuse(&in, &view, "derivatives");
    in.want_derivative = false;
    in.discrepancy = &(const struct discrepancy){.n = 0};
    refuse(&in, &view, "discrepancy");
    in.discrepancy = NULL;
    t.black_sheet = true;
    refuse(&in, &view, "black sheet");
    for (const struct scattering_model *const *m = scattering_registry(); *m != NULL; m++) {
        double start[SCATTERING_MAX_PARAM];
        for (size_t p = 0; p < (*m)->n_param; p++) start[p] = (*m)->param[p].start;
        const struct diffusion_request q = {
            .scene = pile.scene, .model = *m, .param = start, .n_traced = 1, .n_walk = 512};
        status s = diffusion_tables_make(&q, NULL, NULL, &none, &err);
        assert_int_equal(s, scattering_frame_reason(*m) != NULL ? STATUS_INVALID : STATUS_OK);
        for (size_t i = 0; i < DIFFUSION_N_DIRECTION && s == STATUS_OK; i++)
            for (int k = 0; k < 3; k++)
                assert_true(none.leaving[0][i][k] >= 0 && isfinite(none.leaving[0][i][k]) &&
                            isfinite(none.entering[i][k]));
    }
    dual_cloth_release(&pile);
    dual_cloth_release(&weave);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(furnace),
        cmocka_unit_test(deep_layer_in_closed_form),
        cmocka_unit_test(density_and_scale),
        cmocka_unit_test(velvet_under_lamps),
        cmocka_unit_test(level_mesh_is_the_flat_cloth),
        cmocka_unit_test(what_is_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
