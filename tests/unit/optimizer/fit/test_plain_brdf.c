/* The plain BRDF: known answers come back, the bounds hold, and on measured fabrics it reaches the figures that an
 * independent least-squares fit of the same terms gave. */
#include "base/angle.h"
#include "optimizer/fit/baseline/plain_brdf.h"
#include "optimizer/job/job_parse.h"
#include "optimizer/photographs/rows/measurement_table.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static void add_row(struct observation_set *rows, enum job_set set, double light_deg, double camera_deg, double phi_deg)
{
    struct error err;
    struct observation o = {.set = set, .weight = 1.0};
    o.configuration.light_theta_rad = light_deg * RAD_PER_DEG;
    o.configuration.camera_theta_rad = camera_deg * RAD_PER_DEG;
    o.configuration.camera_phi_rad = phi_deg * RAD_PER_DEG;
    assert_int_equal(observation_set_append(rows, &o, &err), STATUS_OK);
}

/* Rows over the hemisphere; those from behind only where asked for. */
static void make_rows(struct observation_set *rows, bool behind)
{
    static const double theta[] = {0, 20, 45, 60, 75}, phi[] = {180, 135, 60, 20};
    observation_set_init(rows);
    for (size_t i = 0; i < 5; i++)
        for (size_t j = 0; j < 4; j++)
            add_row(rows, (i + j) % 3 == 2 ? JOB_SET_HELD_OUT : JOB_SET_FIT, theta[i], theta[(i + j) % 5], phi[j]);
    if (behind) add_row(rows, JOB_SET_FIT, 150, 0, 180);
}

static void fill_means(struct observation_set *rows, const struct plain_brdf *b)
{
    for (size_t i = 0; i < rows->n; i++) plain_brdf_radiance(b, &rows->item[i].configuration, rows->item[i].mean_rgb);
}

static const struct plain_brdf truth[] = {
    {{0.2, 0.1, 0.05}, {0.05, 0.04, 0.06}, {0.1, 0.2, 0.0}, {0.3, 0.2, 0.1}, 0.7, 0.4, 0.3, false},
    {{0.5, 0.0, 0.3}, {0.2, 0.2, 0.0}, {0.0, 0.3, 0.3}, {0.0, 0.5, 0.1}, 1.2, 0.25, 0.6, true},
};

static void fitted_rows_only(const struct observation_set *all, struct observation_set *fit)
{
    struct error err;
    observation_set_init(fit);
    assert_int_equal(observation_set_select(all, JOB_SET_FIT, fit, &err), STATUS_OK);
}

static void test_known_answers(void **state)
{
    (void)state;
    for (size_t k = 0; k < 2; k++) {
        struct observation_set rows, fit;
        struct plain_brdf found;
        struct error err;
        make_rows(&rows, true);
        fill_means(&rows, &truth[k]);
        fitted_rows_only(&rows, &fit);
        assert_int_equal(plain_brdf_fit(&fit, &found, &err), STATUS_OK);
        assert_true(plain_brdf_rel_rms(&found, &rows, JOB_SET_FIT) < 1e-4);
        assert_true(plain_brdf_rel_rms(&found, &rows, JOB_SET_HELD_OUT) < 1e-3);
        assert_true(found.separable_masking == truth[k].separable_masking);
        for (size_t c = 0; c < 3; c++) {
            assert_true(fabs(found.diffuse_rgb[c] - truth[k].diffuse_rgb[c]) < 2e-3);
            assert_true(fabs(found.transmission_rgb[c] - truth[k].transmission_rgb[c]) < 1e-9);
        }
        observation_set_release(&rows);
        observation_set_release(&fit);
    }
}

/* A white diffuser facing the lamp is the unit of radiance. */
static void test_unit(void **state)
{
    (void)state;
    const struct plain_brdf lambert = {.diffuse_rgb = {1, 1, 1}, .retro = 0.25, .roughness = 1, .sheen_roughness = 1};
    struct configuration c = {.camera_theta_rad = 0.5};
    double rgb[3];
    plain_brdf_radiance(&lambert, &c, rgb);
    /* f_d90 is 1 - sin^2 of the difference angle here and cos(theta_l) is 1; what is left is GGX's Fresnel term
     * alone */
    double grazing = 0.5 * pow(cos(0.25), 2) - 0.5, expected = 1 + grazing * pow(1 - cos(0.5), 5);
    double fresnel = pow(1 - cos(0.25), 5);
    assert_true(fabs(rgb[0] - expected) < fresnel);
    assert_true(rgb[0] == rgb[1] && rgb[1] == rgb[2]);
}

static void test_reciprocal(void **state)
{
    (void)state;
    for (size_t k = 0; k < 2; k++) {
        struct configuration c = {.light_theta_rad = 0.3, .camera_theta_rad = 1.2, .camera_phi_rad = 2.5};
        double forth[3], back[3];
        plain_brdf_radiance(&truth[k], &c, forth);
        c = (struct configuration){.light_theta_rad = 1.2, .camera_theta_rad = 0.3, .camera_phi_rad = 2.5};
        plain_brdf_radiance(&truth[k], &c, back);
        for (size_t ch = 0; ch < 3; ch++)
            assert_true(fabs(forth[ch] / cos(0.3) - back[ch] / cos(1.2)) < 1e-12 * forth[ch] / cos(0.3));
    }
}

/* Rows of weight 0 must not move the fit, and a set without any other is refused. */
static void test_weights(void **state)
{
    (void)state;
    struct observation_set rows;
    struct plain_brdf with, without;
    struct error err;
    make_rows(&rows, false);
    fill_means(&rows, &truth[0]);
    rows.item[3].mean_rgb[0] *= 30;
    rows.item[3].weight = 0;
    assert_int_equal(plain_brdf_fit(&rows, &with, &err), STATUS_OK);
    rows.item[3].mean_rgb[0] /= 1000;
    assert_int_equal(plain_brdf_fit(&rows, &without, &err), STATUS_OK);
    assert_memory_equal(with.diffuse_rgb, without.diffuse_rgb, sizeof with.diffuse_rgb);
    assert_memory_equal(with.sheen_rgb, without.sheen_rgb, sizeof with.sheen_rgb);
    assert_true(with.retro == without.retro && with.roughness == without.roughness);
    for (size_t i = 0; i < rows.n; i++) rows.item[i].weight = 0;
    assert_int_equal(plain_brdf_fit(&rows, &with, &err), STATUS_INVALID);
    observation_set_release(&rows);
}

/* Rows of such a surface are predicted without having been fitted; a wrong row is predicted as the others want it,
 * which makes its error larger than the fitted one; and fewer than four directions are too few. */
static void test_left_out(void **state)
{
    (void)state;
    struct observation_set rows, few;
    struct plain_brdf b;
    double left_out, moved;
    make_rows(&rows, false);
    fill_means(&rows, &truth[0]);
    assert_int_equal(plain_brdf_left_out(&rows, &left_out, NULL), STATUS_OK);
    assert_true(left_out < 5e-3);
    rows.item[7].mean_rgb[1] *= 1.5;
    assert_int_equal(plain_brdf_left_out(&rows, &moved, NULL), STATUS_OK);
    assert_int_equal(plain_brdf_fit(&rows, &b, NULL), STATUS_OK);
    for (size_t i = 0; i < rows.n; i++) rows.item[i].set = JOB_SET_FIT;
    assert_true(moved > 1.02 * plain_brdf_rel_rms(&b, &rows, JOB_SET_FIT));
    observation_set_init(&few);
    for (size_t i = 0; i < 6; i++) assert_int_equal(observation_set_append(&few, &rows.item[i % 3], NULL), STATUS_OK);
    assert_int_equal(plain_brdf_left_out(&few, &left_out, NULL), STATUS_OK);
    assert_true(isnan(left_out));
    observation_set_release(&few);
    observation_set_release(&rows);
}

static bool load_table(const char *name, struct observation_set *o)
{
    static const char document[] =
        "{\"sample\":\"t\",\"fibers\":{\"file\":\"a.hair\"},\"measurements\":{\"file\":\"b.csv\"}}";
    static char text[1 << 20];
    char path[1024];
    const char *folder = getenv("SELVEDGE_DATA");
    struct job_document *doc;
    struct error err;
    if (folder == NULL) return false;
    snprintf(path, sizeof path, "%s/measured-reflectance-dense/%s.csv", folder, name);
    FILE *f = fopen(path, "r");
    if (f == NULL) return false;
    size_t n = fread(text, 1, sizeof text - 1, f);
    fclose(f);
    text[n] = '\0';
    assert_int_equal(job_document_parse(document, strlen(document), &doc, &err), STATUS_OK);
    observation_set_init(o);
    assert_int_equal(measurement_table_parse(text, n, name, doc->setup, o, &err), STATUS_OK);
    job_document_free(doc);
    return true;
}

/* Fitted errors of an independent least-squares fit (scipy, 18 starts, the better masking), and no more than 1 %
 * above. */
static void test_measured_fabrics(void **state)
{
    (void)state;
    static const struct {
        const char *name;
        double fitted;
    } known[] = {{"merl-beige-fabric", 0.0750},
                 {"merl-blue-fabric", 0.0950},
                 {"merl-light-brown-fabric", 0.0730},
                 {"merl-pink-felt", 0.0370},
                 {"merl-red-fabric", 0.1900},
                 {"nielsen-greencloth", 0.0280},
                 {"rgl-isotropic-acrylic_felt_green", 0.1690},
                 {"rgl-isotropic-acrylic_felt_white", 0.0900}};
    for (size_t k = 0; k < sizeof known / sizeof known[0]; k++) {
        struct observation_set rows, fit;
        struct plain_brdf b;
        struct error err;
        if (!load_table(known[k].name, &rows)) {
            print_message("no measured tables (SELVEDGE_DATA)\n");
            skip();
        }
        fitted_rows_only(&rows, &fit);
        assert_int_equal(plain_brdf_fit(&fit, &b, &err), STATUS_OK);
        double fitted = plain_brdf_rel_rms(&b, &rows, JOB_SET_FIT),
               held_out = plain_brdf_rel_rms(&b, &rows, JOB_SET_HELD_OUT);
        print_message("%s: fitted %.4f, held out %.4f\n", known[k].name, fitted, held_out);
        assert_true(fitted < 1.01 * known[k].fitted + 0.0005); /* the known figures have three digits */
        observation_set_release(&rows);
        observation_set_release(&fit);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_known_answers), cmocka_unit_test(test_unit),     cmocka_unit_test(test_reciprocal),
        cmocka_unit_test(test_weights),       cmocka_unit_test(test_left_out), cmocka_unit_test(test_measured_fabrics),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
