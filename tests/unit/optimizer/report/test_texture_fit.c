/* Surfaces of texture sets: least squares with bounds, the energy of their lobes, and a fit that finds the radiances of
 * a surface of the same kind. */
#include "optimizer/report/textures/texture_principled.h"
#include "optimizer/report/textures/zeltner_sheen.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>

#include <cmocka.h>

/* Rosenbrock's valley as residuals: its lowest point is (1, 1). */
static void valley(void *context, const double *x, double *out)
{
    (void)context;
    out[0] = 10.0 * (x[1] - x[0] * x[0]);
    out[1] = 1.0 - x[0];
}

static void a_valley_with_and_without_a_bound(void **unused)
{
    (void)unused;
    static const double lower[2] = {-2.0, -2.0}, upper[2] = {2.0, 2.0}, low_upper[2] = {0.5, 2.0};
    struct least_squares p = {2, 2, lower, upper, valley, NULL};
    double x[2] = {-1.2, 1.0}, value;
    assert_int_equal(least_squares_run(&p, x, &value, NULL), STATUS_OK);
    assert_true(value < 1e-6 && fabs(x[0] - 1.0) < 1e-3 && fabs(x[1] - 1.0) < 1e-3);
    p.upper = low_upper; /* along the bound the valley's floor is at x_1 = x_0^2 */
    x[0] = 3.0, x[1] = 1.0;
    assert_int_equal(least_squares_run(&p, x, &value, NULL), STATUS_OK);
    assert_true(x[0] == 0.5 && fabs(x[1] - 0.25) < 1e-3 && fabs(value - 0.25) < 1e-4);
}

enum { N_THETA = 120, N_PHI = 120, EDGE = 8, N_ROW = 60 };

static void direction(double cosine, double phi, double out[3])
{
    const double sine = sqrt(1.0 - cosine * cosine);
    out[0] = sine * cos(phi);
    out[1] = sine * sin(phi);
    out[2] = cosine;
}

/* The lobe is a density: all of it lies above the surface. */
static void sheen_is_a_density(void **unused)
{
    (void)unused;
    for (double roughness = 0.2; roughness <= 1.0; roughness += 0.2)
        for (double cosine = 0.1; cosine <= 1.0; cosine += 0.3) {
            double sum = 0.0, wo[3], wi[3];
            direction(cosine, 0.3, wo);
            for (int i = 0; i < N_THETA; i++)
                for (int k = 0; k < N_PHI; k++) {
                    direction((i + 0.5) / N_THETA, 2.0 * M_PI * (k + 0.5) / N_PHI, wi);
                    sum += zeltner_sheen_density(wi, wo, roughness) * 2.0 * M_PI / (N_THETA * N_PHI);
                }
            assert_true(fabs(sum - 1.0) < 0.02);
            assert_true(zeltner_sheen_albedo(cosine, roughness) > 0.0);
        }
}

/* ---- a fit ---- */

static void fill_maps(struct texture_maps *m)
{
    const size_t n = EDGE * EDGE;
    *m = (struct texture_maps){.width = EDGE, .height = EDGE, .pixel_mm = {0.01, 0.01}};
    m->normal = calloc(3 * n, sizeof *m->normal);
    m->spread = calloc(n, sizeof *m->spread);
    m->direction_rad = calloc(n, sizeof *m->direction_rad);
    m->coherence = calloc(n, sizeof *m->coherence);
    assert_true(m->normal && m->spread && m->direction_rad && m->coherence);
    for (size_t i = 0; i < n; i++) { /* yarns along x: slopes along y */
        const double slope = 0.4 * sin(2.0 * M_PI * (double)(i / EDGE) / EDGE), length = sqrt(1.0 + slope * slope);
        m->normal[3 * i + 1] = (float)(slope / length);
        m->normal[3 * i + 2] = (float)(1.0 / length);
        m->spread[i] = 1.0f;
        m->coherence[i] = 1.0f;
    }
}

static const double albedo[3] = {0.3, 0.2, 0.1};

/* Rows of a matt surface. Every third is held out. */
static void make_target(struct texture_target *t)
{
    *t = (struct texture_target){.n = N_ROW, .n_row = N_ROW};
    t->item = calloc(N_ROW, sizeof *t->item);
    assert_non_null(t->item);
    for (size_t i = 0; i < N_ROW; i++) {
        struct texture_radiance *r = &t->item[i];
        r->configuration = (struct configuration){.light = LIGHT_DIRECTIONAL,
                                                  .light_theta_rad = 0.02 * (double)i,
                                                  .light_phi_rad = 1.7 * (double)i,
                                                  .camera_theta_rad = fmod(0.31 * (double)i, 1.1),
                                                  .camera_phi_rad = 0.9 * (double)i};
        r->part = i % 3 == 0 ? TEXTURE_HELDOUT_ROW : TEXTURE_FITTED_ROW;
        r->weight = i % 3 == 0 ? 0.0 : 1.5 / N_ROW;
        for (int c = 0; c < 3; c++) r->rgb[c] = albedo[c] * cos(r->configuration.light_theta_rad);
        r->scale = 3.0 / (r->rgb[0] + r->rgb[1] + r->rgb[2]);
    }
}

/* Both find the matt surface in spite of the slopes of the maps, which they must flatten. */
static void fits_find_a_matt_surface(void **unused)
{
    (void)unused;
    struct texture_maps maps;
    struct texture_target target;
    fill_maps(&maps);
    make_target(&target);
    struct texture_surface open_pbr = {.maps = &maps, .means = {{0.3, 0.2, 0.1}, {0.0, 0.0, 0.0}}};
    struct texture_principled principled = {.maps = &maps, .means = open_pbr.means};
    assert_int_equal(texture_surface_fit(&open_pbr, &maps, &target, NULL), STATUS_OK);
    assert_int_equal(texture_principled_fit(&principled, &target, NULL), STATUS_OK);
    assert_true(open_pbr.error.rel_rms < 0.02 && open_pbr.error.heldout_rel_rms < 0.02);
    assert_true(principled.error.rel_rms < 0.06 && principled.error.heldout_rel_rms < 0.06);
    assert_true(isnan(open_pbr.error.hemisphere_rel_rms));
    for (int c = 0; c < 3; c++) assert_true(fabs(open_pbr.base[c] / albedo[c] - 1.0) < 0.15);
    /* a row of another surface stands out */
    target.item[3].rgb[0] *= 2.0;
    texture_surface_release(&open_pbr);
    assert_int_equal(texture_surface_fit(&open_pbr, &maps, &target, NULL), STATUS_OK);
    assert_true(open_pbr.error.row_rel_error[3] > 10.0 * open_pbr.error.row_rel_error[6]);
    texture_surface_release(&open_pbr);
    texture_principled_release(&principled);
    texture_maps_release(&maps);
    texture_target_release(&target);
}

/* What is written of an index under a coat gives back the reflected share that was fitted, by OpenPBR's formulas. */
static void inputs_stand_for_the_fit(void **unused)
{
    (void)unused;
    for (double coat = 0.0; coat <= 1.0; coat += 0.25)
        for (double share = 0.001; share < 0.25; share *= 2.0) {
            const struct texture_surface t = {.specular = share, .coat_weight = coat};
            const struct texture_open_pbr in = texture_surface_inputs(&t);
            const double ratio = in.specular_ior / in.coat_ior,
                         eta = coat * fmax(ratio, 1.0 / ratio) + (1.0 - coat) * in.specular_ior,
                         root = (eta - 1.0) / (eta + 1.0);
            assert_true(in.specular_weight <= 1.0 + 1e-9 && in.specular_ior >= 1.0);
            assert_true(fabs(in.specular_weight * root * root / share - 1.0) < 1e-6);
        }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_valley_with_and_without_a_bound),
        cmocka_unit_test(sheen_is_a_density),
        cmocka_unit_test(fits_find_a_matt_surface),
        cmocka_unit_test(inputs_stand_for_the_fit),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
