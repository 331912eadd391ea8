/* Helmholtz reciprocity of a whole cloth: exchanging lamp and camera leaves radiance over cos(theta of the lamp) the
 * same. It needs a reciprocal S and light that enters a fiber across its width. With the same S but light that enters
 * where the camera's ray hits, packed fibers break it.
 */
#include "base/angle.h"
#include "tests/support/cloth/hand_weave.h"
#include "tests/support/tracer/estimate_fixture.h"
#include "tests/support/tracer/trace_input.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { N_PAIR = 3, N_LAYER = 3, N_ROW = 20 };
#define RADIUS_M 10e-6
#define PITCH_M (2.05 * RADIUS_M)

static const double angles_deg[N_PAIR][4] = {/* theta and phi of one direction, then of the other */
                                             {40, 90, 75, 270},
                                             {20, 90, 70, 90},
                                             {30, 60, 72, 200}};

/* Three layers of parallel fibers that nearly touch. */
static struct scene *packed_fibers(void)
{
    double y_z[N_LAYER * N_ROW][2];
    struct fiber_set f;
    struct scene *scene = NULL;
    for (int layer = 0; layer < N_LAYER; layer++)
        for (int row = 0; row < N_ROW; row++) {
            y_z[layer * N_ROW + row][0] = PITCH_M * (row + 0.25 + 0.5 * (layer % 2));
            y_z[layer * N_ROW + row][1] = -layer * sqrt(0.75) * PITCH_M;
        }
    hand_straight(&f, N_LAYER * N_ROW, (const double(*)[2])y_z, N_ROW * PITCH_M, RADIUS_M);
    assert_int_equal(scene_new(&f, &(struct scene_option){.black_sheet = true}, &scene, NULL), STATUS_OK);
    fiber_set_release(&f);
    return scene;
}

static struct configuration far_away(const double lamp_deg[2], const double camera_deg[2])
{
    return (struct configuration){.light_theta_rad = lamp_deg[0] * RAD_PER_DEG,
                                  .light_phi_rad = lamp_deg[1] * RAD_PER_DEG,
                                  .camera_theta_rad = camera_deg[0] * RAD_PER_DEG,
                                  .camera_phi_rad = camera_deg[1] * RAD_PER_DEG,
                                  .crop_m = 1, /* thousands of tiles: its edges do not count */
                                  .light = LIGHT_DIRECTIONAL,
                                  .camera = CAMERA_FAR_FIELD};
}

/* Largest |ratio - 1| of a pair in its standard errors, and the largest itself, over the pairs, channel 0. */
static void asymmetry(const struct scattering_model *m, double *worst_se, double *worst)
{
    static const double param[] = {0.1, 0.1, 0.1, 0.6, 0.6, 0.6, 10 * RAD_PER_DEG, 30 * RAD_PER_DEG, 40 * RAD_PER_DEG,
                                   0.5, 0.5, 0.4, 0.7};
    struct scene *scene = packed_fibers();
    struct appearance model;
    struct configuration c[2 * N_PAIR];
    size_t n_path[2 * N_PAIR];
    struct estimate e[2 * N_PAIR];
    for (int k = 0; k < N_PAIR; k++) {
        c[2 * k] = far_away(angles_deg[k], angles_deg[k] + 2);
        c[2 * k + 1] = far_away(angles_deg[k] + 2, angles_deg[k]);
        n_path[2 * k] = n_path[2 * k + 1] = 100000;
    }
    struct estimate_request q = {.input = trace_input_surface(scene, m, param, &model),
                                 .configuration = c,
                                 .n_configuration = 2 * N_PAIR,
                                 .n_path = n_path,
                                 .seed = 5};
    estimate_fixture_run(&q, 0, e);
    *worst = *worst_se = 0;
    for (int k = 0; k < N_PAIR; k++) {
        const struct estimate *a = &e[2 * k], *b = a + 1;
        double ratio = a->mean[0] / cos(c[2 * k].light_theta_rad) / (b->mean[0] / cos(c[2 * k + 1].light_theta_rad));
        double se = ratio * sqrt(a->var[0] / (a->mean[0] * a->mean[0]) + b->var[0] / (b->mean[0] * b->mean[0]));
        print_message("%s, pair %d: ratio %.4f +- %.4f\n", m->across_width ? "across" : "at the hit", k, ratio, se);
        assert_true(se < 0.01);
        *worst_se = fmax(*worst_se, fabs(ratio - 1) / se);
        *worst = fmax(*worst, fabs(ratio - 1));
    }
    scene_free(scene);
}

static void packed_cloth_is_reciprocal(void **state)
{
    (void)state;
    double worst_se, worst;
    asymmetry(scattering_find("textile.v3"), &worst_se, &worst);
    assert_true(worst_se < 3.5); /* one run in 700 fails by chance */
}

static void light_that_enters_where_it_is_seen_is_not(void **state)
{
    (void)state;
    double worst_se, worst;
    struct scattering_model at_hit = *scattering_find("textile.v3");
    at_hit.across_width = false;
    asymmetry(&at_hit, &worst_se, &worst);
    assert_true(worst > 0.05 && worst_se > 6);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(packed_cloth_is_reciprocal),
                                       cmocka_unit_test(light_that_enters_where_it_is_seen_is_not)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
