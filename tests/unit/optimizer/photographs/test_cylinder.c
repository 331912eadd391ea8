/* Photographs of a cloth on a cylinder, drawn by rays of a pinhole camera: angles of the columns, the outline in the
 * picture, and the rows of a job. */
#include "base/angle.h"
#include "base/rng.h"
#include "optimizer/job/document/job_photograph.h"
#include "optimizer/job/document/job_rows.h"
#include "optimizer/job/document/job_setup.h"
#include "optimizer/photographs/camera/photograph_develop.h"
#include "optimizer/photographs/camera/photograph_process_load.h"
#include "optimizer/photographs/cylinder/column_picture.h"
#include "optimizer/photographs/cylinder/cylinder_edges.h"
#include "optimizer/photographs/cylinder/cylinder_view.h"
#include "optimizer/photographs/rows/observation_load.h"
#include "tests/support/drawn_cylinder.h"
#include "tests/support/scratch_folder.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "tests/support/job_document_text.h"

static double dot(const double a[3], const double b[3]) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

static void unit(double v[3])
{
    const double length = sqrt(dot(v, v));
    for (int k = 0; k < 3; k++) v[k] /= length;
}

/* Tangents to the right of the picture's middle between which rays of the middle row meet the cylinder. */
static void silhouettes(const struct drawn_cylinder *d, double edge[2])
{
    double forward[3], right[3], down[3];
    drawn_cylinder_axes(d, forward, right, down);
    for (int k = 0; k < 2; k++) {
        const double far = 2.0 * d->radius / sqrt(dot(d->eye, d->eye)) * (k == 0 ? -1.0 : 1.0);
        double in = 0.0, out = far * 4.0;
        for (int i = 0; i < 60; i++) {
            double ray[3], p[3];
            for (int a = 0; a < 3; a++) ray[a] = forward[a] + 0.5 * (in + out) * right[a];
            *(drawn_cylinder_meet(d->radius, d->eye, ray, p) ? &in : &out) = 0.5 * (in + out);
        }
        edge[k] = in;
    }
}

/* Columns across the row of the orbit center against rays: the place, both angles, and the mean angle of a part. The
 * picture's plane is perpendicular to the view of the orbit center, not of the axis, which moves s by (radius /
 * D)^2. */
static void test_angles_of_rays(void **state)
{
    struct rng rng;
    (void)state;
    rng_start(&rng, &(struct rng_key){.seed = 3}, 0, 0);
    for (int i = 0; i < 200; i++) {
        struct drawn_cylinder d = {.radius = 5.0 + 20.0 * rng_double(&rng)};
        struct cylinder_view v = {.radius_mm = d.radius};
        const double theta = 70.0 * rng_double(&rng), phi = 360.0 * rng_double(&rng),
                     far = 300.0 + 900.0 * rng_double(&rng), lamp = 60.0 * rng_double(&rng);
        double forward[3], right[3], down[3], ray[3], p[3], s;
        v.camera = (struct cylinder_station){false, theta * RAD_PER_DEG, phi * RAD_PER_DEG, far};
        v.light = (struct cylinder_station){false, lamp * RAD_PER_DEG, 1.0, 500.0};
        drawn_cylinder_place(theta, phi, far, d.eye);
        drawn_cylinder_place(lamp, DEG_PER_RAD, 500.0, d.light);
        assert_int_equal(cylinder_view_init(&v, NULL), STATUS_OK);
        drawn_cylinder_axes(&d, forward, right, down);
        const double at = (2.0 * rng_double(&rng) - 1.0) * 0.8 * d.radius / far;
        for (int a = 0; a < 3; a++) ray[a] = forward[a] + at * right[a];
        if (!drawn_cylinder_meet(d.radius, d.eye, ray, p)) continue;
        const double angle = atan2(p[0], p[2] + d.radius), tolerance = 4.0 * pow(d.radius / v.axis_distance_mm, 2.0);
        struct cylinder_angles found;
        cylinder_view_angles(&v, angle, &found);
        const double normal[3] = {sin(angle), 0, cos(angle)}, around[3] = {cos(angle), 0, -sin(angle)};
        double to[3] = {d.light[0] - p[0], d.light[1] - p[1], d.light[2] - p[2]};
        assert_true(fabs(found.light_distance_mm - sqrt(dot(to, to))) < 1e-6);
        unit(to);
        assert_true(fabs(cos(found.light_theta_rad) - dot(to, normal)) < 1e-9);
        assert_true(fabs(sin(found.light_theta_rad) * cos(found.light_phi_rad) - dot(to, around)) < 1e-9);
        for (int a = 0; a < 3; a++) to[a] = d.eye[a] - p[a];
        unit(to);
        assert_true(fabs(cos(found.camera_theta_rad) - dot(to, normal)) < 1e-9);
        assert_true(fabs(sin(found.camera_theta_rad) * sin(found.camera_phi_rad) - to[1]) < 1e-9);
        s = cylinder_view_s(&v, angle);
        assert_true(fabs(cylinder_view_angle(&v, s) - angle) < 1e-9 || fabs(s) == 1.0);
        double edge[2];
        silhouettes(&d, edge);
        assert_true(fabs((2.0 * at - edge[0] - edge[1]) / (edge[1] - edge[0]) - s) < tolerance);
        assert_true(fabs(cylinder_view_width_px(&v, 1.0) / (edge[1] - edge[0]) - 1.0) < tolerance);
        const double mean = cylinder_view_mean_angle(&v, s - 1e-4, s + 1e-4);
        assert_true(fabs(mean - angle) < 1e-3 || fabs(s) > 0.99);
    }
}

/* The mean over [0, 1] of asin with weights that rise to the middle and fall again, by an integral of its own. */
static void test_mean_angle(void **state)
{
    struct cylinder_view v = {.radius_mm = 15, .camera = {.far = true}, .light = {.far = true}};
    (void)state;
    assert_int_equal(cylinder_view_init(&v, NULL), STATUS_OK);
    double wanted = 0.0;
    for (int i = 0; i < 100000; i++) wanted += 2e-5 * (1.0 - fabs(2e-5 * i + 1e-5 - 1.0)) * asin(1e-5 * i + 5e-6);
    assert_true(fabs(cylinder_view_mean_angle(&v, 0.0, 1.0) - wanted) < 1e-3);
    assert_true(fabs(cylinder_view_mean_angle(&v, 0.2, 0.3) - (cylinder_view_angle(&v, 0.25))) < 1e-3);
    v.camera = (struct cylinder_station){false, 0.5 * M_PI - 0.01, 0.0, 5.0};
    assert_int_equal(cylinder_view_init(&v, NULL), STATUS_INVALID);
}

/* Outlines that lie aslant, with the axis to all sides, are found within a fifth of a pixel before a bright background.
 * Before a dark one no lamp lights both silhouettes of a cylinder, so the place is not tested. */
static void test_outline(void **state)
{
    (void)state;
    for (int i = 0; i < 8; i++) {
        static const double quarter[4] = {0, -90, 180, 90}; /* roll that turns the axis up, right, down, left */
        const enum job_axis axis = (enum job_axis)(i % 4);
        struct drawn_cylinder d = {.radius = 15,
                                   .px_per_mm = 5,
                                   .width = 240,
                                   .height = 220,
                                   .background = i < 4 ? 0.9 : 0.0,
                                   .roll = (quarter[i % 4] + 3.0) * RAD_PER_DEG};
        struct image im;
        struct cylinder_edges e;
        struct error err = {0};
        drawn_cylinder_place(10, 40, 610, d.light);
        drawn_cylinder_place(0, 0, 1000, d.eye);
        drawn_cylinder_draw(&d, &im);
        if (cylinder_edges_find(&im, (double[2]){100, 50}, axis, &e, &err) != STATUS_OK) fail_msg("%s", err.text);
        image_release(&im);
        assert_true(e.dark_background == (i >= 4));
        if (i >= 4) continue; /* one side is in shadow */
        double uv[2];
        cylinder_edges_to_frame(axis, (double[2]){100 + 120, 50 + 110}, uv);
        /* D = 1015; the silhouettes are seen at tan beta = R / sqrt(D^2 - R^2) */
        const double wide = 2 * 5000.0 * 15.0 / sqrt(1015.0 * 1015.0 - 225.0);
        assert_true(fabs(cylinder_edges_width_px(&e, uv[1]) - wide) < 0.4);
        const double middle = 0.5 * (e.line[0][0] + e.line[1][0] + (e.line[0][1] + e.line[1][1]) * uv[1]);
        assert_true(fabs(middle - uv[0]) < 0.2);
        assert_true(fabs(e.line[0][1] - e.line[1][1]) < 5e-3);
        assert_true(fabs(fabs(e.line[0][1]) - tan(3.0 * RAD_PER_DEG)) < 5e-3);
    }
}

static void test_outline_that_is_not_there(void **state)
{
    struct drawn_cylinder d = {.radius = 15, .px_per_mm = 5, .width = 240, .height = 100, .background = 0.9};
    struct cylinder_edges e;
    struct image im;
    struct error err = {0};
    (void)state;
    drawn_cylinder_place(10, 0, 610, d.light);
    drawn_cylinder_place(0, 0, 1000, d.eye);
    d.radius = 40; /* beyond the picture */
    drawn_cylinder_draw(&d, &im);
    assert_int_equal(cylinder_edges_find(&im, (double[2]){0, 0}, JOB_AXIS_UP, &e, &err), STATUS_NOT_FOUND);
    image_release(&im);
    const double cross_px[8] = {10, 0, 50, 100, 40, 0, 0, 100};
    assert_int_equal(cylinder_edges_of_points(JOB_AXIS_UP, cross_px, &e, &err), STATUS_INVALID);
    const double right_first[8] = {60, 0, 62, 100, 10, 0, 12, 100};
    assert_int_equal(cylinder_edges_of_points(JOB_AXIS_UP, right_first, &e, &err), STATUS_OK);
    assert_true(fabs(e.line[0][0] - 10.0) < 1e-9 && fabs(e.line[1][1] - 0.02) < 1e-9);
}

/* ---- rows of a job ---- */

static void write_photograph(void **state, const struct drawn_cylinder *d)
{
    struct image im;
    drawn_cylinder_draw(d, &im);
    assert_int_equal(image_write_exr(&im, scratch_path(state, "roll.exr"), NULL), STATUS_OK);
    image_release(&im);
}

static status load(void **state, const char *extra, const char *section, struct observation_set *o, struct error *err)
{
    char text[2000];
    struct photograph_process k;
    struct job_document *doc = NULL;
    snprintf(text, sizeof text,
             "{\"sample\":\"s\"," VOLUME ",\"lamp\":{\"side_cm\":1}%s,\"photographs\":[{\"file\":\"roll.exr\","
             "\"set\":\"fit\",\"cylinder_radius_mm\":15,%s}]}",
             section, extra);
    if (job_document_parse(text, strlen(text), &doc, err) != STATUS_OK) fail_msg("%s", err->text);
    photograph_process_init(&k);
    observation_set_init(o);
    status s = photograph_process_load(&k, doc->setup, doc->rows, (const char *)*state, err);
    if (s == STATUS_OK)
        s = observation_set_load(doc->setup, doc->rows, doc->fit, (const char *)*state, &k, NULL, o, err);
    photograph_process_release(&k);
    job_document_free(doc);
    return s;
}

/* Direction in the frame of the turned cloth. */
static void direction(double theta, double phi, double out[3])
{
    out[0] = sin(theta) * cos(phi), out[1] = sin(theta) * sin(phi), out[2] = cos(theta);
}

/* Each row has the radiance that cloth has at the row's own angles: to half a percent, or a hundredth of the brightest
 * for the curvature over a column. */
static void check_rows(const struct observation_set *o, size_t least)
{
    static const double normal[3] = {0, 0, 1}, weft[3] = {1, 0, 0};
    assert_true(o->n >= least);
    for (size_t i = 0; i < o->n; i++) {
        const struct observation *row = &o->item[i];
        const struct configuration *c = &row->configuration;
        double light[3], eye[3];
        direction(c->light_theta_rad, c->light_phi_rad - c->cloth_rotation_rad, light);
        direction(c->camera_theta_rad, c->camera_phi_rad - c->cloth_rotation_rad, eye);
        const double wanted = drawn_cylinder_cloth(light, eye, normal, weft);
        assert_true(c->light_theta_rad < 71.0 * RAD_PER_DEG && c->camera_theta_rad < 71.0 * RAD_PER_DEG);
        for (size_t k = 0; k < 3; k++) {
            const double factor = 1.0 - 0.2 * (double)k;
            if (fabs(row->mean_rgb[k] / factor - wanted) > 0.005 * wanted + 0.002)
                fail_msg("%s at %.2f degrees: %.5f, and by its angles %.5f", row->name, row->column.angle_deg,
                         row->mean_rgb[k] / factor, wanted);
            assert_true(row->se_rgb[k] > 0.0 && row->se_rgb[k] < 0.05 * wanted + 0.003);
        }
        assert_true(row->column.number == i + 1 && row->column.n == o->n && row->n_cell == 0);
    }
    assert_string_equal(o->item[0].name, "roll-c01.exr");
}

static void test_rows_of_a_roll(void **state)
{
    struct drawn_cylinder d = {.radius = 15, .px_per_mm = 8, .width = 300, .height = 80, .background = 0.9};
    struct observation_set o;
    struct error err = {0};
    drawn_cylinder_place(40, 30, 610, d.light);
    drawn_cylinder_place(0, 270, 1000, d.eye);
    d.turn = 30 * RAD_PER_DEG;
    write_photograph(state, &d);
    static const char *const view = "\"light_theta_deg\":40,\"light_phi_deg\":30,\"camera_theta_deg\":0,"
                                    "\"camera_phi_deg\":270,\"cloth_rotation_deg\":30";
    if (load(state, view, "", &o, &err) != STATUS_OK) fail_msg("%s", err.text);
    check_rows(&o, 14);
    observation_set_release(&o);
}

/* The camera looks aslant along and around the axis, and is turned by a quarter; the outline is given. */
static void test_rows_of_an_oblique_roll(void **state)
{
    struct drawn_cylinder d = {.radius = 15, .px_per_mm = 8, .width = 60, .height = 400, .background = 0.0};
    struct observation_set o;
    struct error err = {0};
    drawn_cylinder_place(100, 0, 610, d.light);
    drawn_cylinder_place(35, 300, 1000, d.eye);
    d.roll = -90 * RAD_PER_DEG;
    write_photograph(state, &d);
    char extra[400];
    /* by rays: the first and last of the middle row that meet the cylinder */
    double forward[3], right[3], down[3], ray[3], p[3], edge[2] = {NAN, NAN};
    drawn_cylinder_axes(&d, forward, right, down);
    for (double y = 0.0; y < 400.0; y += 0.01) {
        for (int a = 0; a < 3; a++) ray[a] = forward[a] + (y - 200.0) / 8000.0 * down[a];
        if (!drawn_cylinder_meet(15, d.eye, ray, p)) continue;
        if (isnan(edge[0])) edge[0] = y;
        edge[1] = y;
    }
    snprintf(extra, sizeof extra,
             "\"light_theta_deg\":100,\"light_phi_deg\":0,\"camera_theta_deg\":35,\"camera_phi_deg\":300,"
             "\"cylinder_axis\":\"right\",\"cylinder_edges_px\":[0,%.2f,60,%.2f,0,%.2f,60,%.2f]",
             edge[0], edge[0], edge[1], edge[1]);
    if (load(state, extra, "", &o, &err) != STATUS_OK) fail_msg("%s", err.text);
    check_rows(&o, 7);
    observation_set_release(&o);
}

static void check_same_picture(const struct image *a, const struct image *b)
{
    assert_true(a->width == b->width && a->height == b->height);
    for (size_t i = 0; i < 3 * a->width * a->height; i++) assert_true(fabsf(a->pixel[i] - b->pixel[i]) < 1e-6f);
}

/* The second column does not read the file again, and is the picture that it would have read; with a lens and without
 * one, which read the whole picture and the crop. */
static void test_columns_read_once(void **state)
{
    struct drawn_cylinder d = {.radius = 15, .px_per_mm = 8, .width = 300, .height = 80, .background = 0.9};
    drawn_cylinder_place(40, 30, 610, d.light);
    drawn_cylinder_place(0, 270, 1000, d.eye);
    static const char *const rig[2] = {"", ",\"rig\":{\"file\":\"rig.json\"}"};
    static const char lens[] = "{\"selvedge_rig\":1,\"lens\":{\"distortion\":{\"focal_px\":[8000,8000],\"center_px\":"
                               "[150,40],\"k\":[0.1,0,0],\"p\":[0,0]}}}";
    scratch_write(scratch_path(state, "rig.json"), lens, sizeof lens - 1);
    for (size_t i = 0; i < 2; i++) {
        struct photograph_process k;
        struct image first, second, again;
        char text[1000];
        write_photograph(state, &d);
        snprintf(text, sizeof text,
                 "{\"sample\":\"s\"," VOLUME "%s,\"photographs\":[{\"file\":\"roll.exr\",\"set\":\"fit\","
                 "\"light_theta_deg\":40,\"light_phi_deg\":30,\"camera_theta_deg\":0,\"camera_phi_deg\":270,"
                 "\"cylinder_radius_mm\":15}]}",
                 rig[i]);
        struct job_document *doc = job_document_of_text(text);
        photograph_process_init(&k);
        const char *folder = (const char *)*state;
        assert_int_equal(photograph_process_load(&k, doc->setup, doc->rows, folder, NULL), STATUS_OK);
        const struct job_photograph *column = doc->rows->photograph;
        assert_true(doc->rows->n_photograph > 8 && column[0].column.number == 1);
        assert_int_equal(photograph_develop(&k, folder, &column[3], &first, NULL, NULL), STATUS_OK);
        assert_int_equal(rename(scratch_path(state, "roll.exr"), scratch_path(state, "away.exr")), 0);
        assert_int_equal(photograph_develop(&k, folder, &column[7], &second, NULL, NULL), STATUS_OK);
        assert_int_equal(rename(scratch_path(state, "away.exr"), scratch_path(state, "roll.exr")), 0);
        struct column_views *kept = k.columns;
        k.columns = NULL;
        assert_int_equal(photograph_develop(&k, folder, &column[7], &again, NULL, NULL), STATUS_OK);
        check_same_picture(&second, &again);
        k.columns = kept;
        image_release(&first);
        image_release(&second);
        image_release(&again);
        photograph_process_release(&k);
        job_document_free(doc);
    }
}

static void check_refused(void **state, const char *extra, const char *section, const char *field, const char *part)
{
    struct observation_set o;
    struct error err = {0};
    assert_int_equal(load(state, extra, section, &o, &err), STATUS_INVALID);
    observation_set_release(&o);
    if (strstr(err.text, part) == NULL) fail_msg("%s", err.text);
    assert_string_equal(err.field, field);
}

static void test_refused(void **state)
{
    struct drawn_cylinder d = {.radius = 15, .px_per_mm = 5, .width = 200, .height = 60, .background = 0.0};
    drawn_cylinder_place(60, 0, 610, d.light);
    drawn_cylinder_place(0, 270, 1000, d.eye);
    write_photograph(state, &d);
#define VIEW "\"light_theta_deg\":60,\"light_phi_deg\":0,\"camera_theta_deg\":0,\"camera_phi_deg\":270"
#define EDGES ",\"cylinder_edges_px\":[26,0,26,60,174,0,174,60]"
    check_refused(state, VIEW, "", "cylinder_edges[0]", "were not found");
    check_refused(state, VIEW ",\"cylinder_edges_px\":[26,0,26,0,174,0,174,60]", "", "cylinder_edges[0]",
                  "do not lie along");
    check_refused(state, VIEW ",\"cylinder_step_deg\":0.5" EDGES, "", "photograph_file[0]", "no column");
    FILE *rig = fopen(scratch_path(state, "rig.json"), "w");
    fputs("{\"selvedge_rig\":1,\"lens\":{\"distortion\":{\"focal_px\":[4000,4000],\"center_px\":[100,30],\"k\":[0,0,0],"
          "\"p\":[0,0]}}}",
          rig);
    fclose(rig);
    check_refused(state, VIEW EDGES, ",\"rig\":{\"file\":\"rig.json\"}", "cylinder_radius[0]", "148.0 pixels apart");
    job_document_check_error(
        PHOTO_OF("\"set\":\"fit\",\"light_theta_deg\":1,\"camera_theta_deg\":1,\"cylinder_step_deg\":6"),
        "photographs[0].cylinder_step_deg", "cylinder_radius_mm");
    static const char *const roll =
        "{\"sample\":\"s\"," VOLUME ",\"photographs\":[{\"file\":\"roll.exr\",\"set\":\"fit\"," VIEW
        ",\"cylinder_radius_mm\":15}%s],\"fit\":{\"texture\":{\"block_mm\":1}}}";
    char text[1000];
    snprintf(text, sizeof text, roll, "");
    job_document_check_error(text, "fit.texture", "flat cloth");
    snprintf(text, sizeof text, roll, "," PHOTO);
    job_document_free(job_document_of_text(text));
}

/* Light that rises across the picture is the same in all channels, wherever in a pixel their samples lie. */
static void test_places_of_colors(void **state)
{
    static const double place[3][2] = {{-0.25, -0.25}, {0, 0}, {0.25, 0.25}},
                        corner[4][2] = {{104, 52}, {112, 52}, {112, 58}, {104, 58}};
    struct image im;
    (void)state;
    assert_int_equal(image_init(&im, 20, 10, 3, NULL), STATUS_OK);
    for (size_t i = 0; i < 3 * 20 * 10; i++)
        im.pixel[i] =
            (float)(3.0 * ((double)(i / 3 % 20) + place[i % 3][0]) + 2.0 * ((double)(i / 60) + place[i % 3][1]));
    assert_int_equal(column_picture_cut(corner, (const size_t[2]){100, 50}, place, &im, NULL), STATUS_OK);
    assert_true(im.width == 8 && im.height == 6);
    for (size_t i = 0; i < 3 * 8 * 6; i++)
        assert_true(fabs((double)im.pixel[i] - 3.0 * (double)(4 + i / 3 % 8) - 2.0 * (double)(2 + i / 24)) < 1e-4);
    image_release(&im);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_angles_of_rays),
        cmocka_unit_test(test_mean_angle),
        cmocka_unit_test(test_outline),
        cmocka_unit_test(test_outline_that_is_not_there),
        cmocka_unit_test(test_places_of_colors),
        cmocka_unit_test_setup_teardown(test_rows_of_a_roll, scratch_folder_setup, scratch_folder_teardown),
        cmocka_unit_test_setup_teardown(test_rows_of_an_oblique_roll, scratch_folder_setup, scratch_folder_teardown),
        cmocka_unit_test_setup_teardown(test_columns_read_once, scratch_folder_setup, scratch_folder_teardown),
        cmocka_unit_test_setup_teardown(test_refused, scratch_folder_setup, scratch_folder_teardown),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
