/* A cloth on a cylinder below a sheet of markers with a slot, drawn by rays: the outline follows from the markers where
 * the picture does not show it, and a radius that contradicts them is refused. */
#include "base/angle.h"
#include "geometry/vision/vision_markers.h"
#include "optimizer/job/document/job_photograph.h"
#include "optimizer/job/document/job_rows.h"
#include "optimizer/photographs/camera/photograph_process_load.h"
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

enum { BITS = 60, N_MARKER = 4, WIDTH = 480, HEIGHT = 460 };
static const double side_mm = 22.0, slot_mm = 24.0, distance_mm = 600.0, px_per_mm = 4.0;
static const double place_mm[N_MARKER][2] = {{-42, 40}, {42, 38}, {41, -41}, {-41, -40}};
static const int marker_id[N_MARKER] = {3, 7, 11, 20};
static uint8_t marker[N_MARKER][BITS * BITS];

/* White paper with markers and a slot along the axis, which the cylinder touches from below. */
static double sheet(double x, double y)
{
    if (fabs(x) < slot_mm) return NAN;
    for (size_t m = 0; m < N_MARKER; m++) {
        const double u = (x - place_mm[m][0]) / side_mm + 0.5, v = 0.5 - (y - place_mm[m][1]) / side_mm;
        if (u >= 0.0 && v >= 0.0 && u < 1.0 && v < 1.0)
            return marker[m][(size_t)(v * BITS) * BITS + (size_t)(u * BITS)] > 127 ? 0.8 : 0.03;
    }
    return 0.8;
}

static struct drawn_cylinder drawn(double lamp_deg, double background, double roll_deg)
{
    struct drawn_cylinder d = {.radius = 15,
                               .px_per_mm = px_per_mm,
                               .width = WIDTH,
                               .height = HEIGHT,
                               .background = background,
                               .roll = roll_deg * RAD_PER_DEG,
                               .sheet = sheet};
    for (size_t m = 0; m < N_MARKER; m++)
        assert_int_equal(vision_draw_marker("4x4_50", marker_id[m], BITS, marker[m], NULL), STATUS_OK);
    drawn_cylinder_place(lamp_deg, 0, 610, d.light);
    drawn_cylinder_place(25, 300, distance_mm, d.eye);
    return d;
}

static void write_files(void **state, const struct drawn_cylinder *d, double lamp_deg)
{
    char rig[1200];
    struct image im;
    const double focal = px_per_mm * distance_mm;
    snprintf(
        rig, sizeof rig,
        "{\"selvedge_rig\":1,\"lamps\":{\"a\":{\"theta_deg\":%g,\"phi_deg\":0}},\"views\":{\"v\":{\"lamp\":\"a\"}},"
        "\"lens\":{\"distortion\":{\"focal_px\":[%g,%g],\"center_px\":[%g,%g],\"k\":[0,0,0],\"p\":[0,0]}},"
        "\"markers\":{\"dictionary\":\"4x4_50\",\"side_mm\":22,\"center_mm\":{\"3\":[-42,40],\"7\":[42,38],\"11\":[41,"
        "-41],\"20\":[-41,-40]}}}",
        lamp_deg, focal, focal, 0.5 * WIDTH, 0.5 * HEIGHT);
    scratch_write(scratch_path(state, "rig.json"), rig, strlen(rig));
    drawn_cylinder_draw(d, &im);
    assert_int_equal(image_write_exr(&im, scratch_path(state, "roll.exr"), NULL), STATUS_OK);
    image_release(&im);
}

struct heard {
    size_t n_radius; /* warnings that ask for the radius */
};

static void hear(void *context, const char *option, const char *text)
{
    struct heard *heard = context;
    (void)option;
    heard->n_radius += strstr(text, "check 'cylinder_radius_mm'") != NULL;
}

static status load(void **state, double radius_mm, const char *axis, struct heard *heard, struct job_document **doc,
                   struct error *err)
{
    char text[1000];
    struct photograph_process k;
    *heard = (struct heard){0};
    snprintf(
        text, sizeof text,
        "{\"sample\":\"s\"," VOLUME ",\"lamp\":{\"side_cm\":1},\"rig\":{\"file\":\"rig.json\"},\"photographs\":[{"
        "\"file\":\"roll.exr\",\"set\":\"fit\",\"view\":\"v\",\"cylinder_radius_mm\":%g,\"cylinder_axis\":\"%s\"}]}",
        radius_mm, axis);
    *doc = job_document_of_text(text);
    photograph_process_init(&k);
    const struct warning_sink sink = {hear, heard};
    k.warn = &sink;
    const status s = photograph_process_load(&k, (*doc)->setup, (*doc)->rows, (const char *)*state, err);
    photograph_process_release(&k);
    return s;
}

/* The place around the cylinder that the ray through the middle of a column meets. */
static double angle_of_middle(const struct drawn_cylinder *d, const struct job_column *column)
{
    double forward[3], right[3], down[3], ray[3], p[3], middle[2] = {0};
    drawn_cylinder_axes(d, forward, right, down);
    for (size_t i = 0; i < 4; i++)
        for (size_t k = 0; k < 2; k++) middle[k] += 0.25 * column->corner_px[i][k];
    for (int a = 0; a < 3; a++)
        ray[a] = forward[a] + ((middle[0] - 0.5 * WIDTH) * right[a] + (middle[1] - 0.5 * HEIGHT) * down[a]) /
                                  (px_per_mm * distance_mm);
    assert_true(drawn_cylinder_meet(d->radius, d->eye, ray, p));
    return atan2(p[0], p[2] + d->radius);
}

/* Columns lie where their angles say, within a pixel of the 60 from the axis to a silhouette (markers give the camera
 * to 8 mm of 600, half a pixel, and their plane to half a pixel) and the half degree between the mean and the middle of
 * a column. The camera's angle is known to 8 mm of 600. Columns are 10 mm long, which is 40 pixels, shortened to 37 by
 * the view at 22 degrees along the axis. */
static void check_columns(const struct drawn_cylinder *d, const struct job_rows *rows, size_t along)
{
    assert_true(rows->n_photograph >= 12);
    for (size_t i = 0; i < rows->n_photograph; i++) {
        const struct job_photograph *p = &rows->photograph[i];
        const double found = p->column.angle_deg * RAD_PER_DEG, true_angle = angle_of_middle(d, &p->column);
        const double camera = atan2(d->eye[0], d->eye[2] + d->radius);
        if (fabs(sin(found - camera) - sin(true_angle - camera)) > 1.0 / 60.0 + 0.5 * RAD_PER_DEG * cos(found - camera))
            fail_msg("column %zu: %.2f degrees, by a ray %.2f", i, p->column.angle_deg, true_angle * DEG_PER_RAD);
        const double normal[3] = {sin(true_angle), 0, cos(true_angle)};
        double to[3] = {d->eye[0] - d->radius * normal[0], d->eye[1], d->eye[2] - d->radius * (normal[2] - 1.0)};
        const double cosine =
            (to[0] * normal[0] + to[2] * normal[2]) / sqrt(to[0] * to[0] + to[1] * to[1] + to[2] * to[2]);
        assert_true(fabs(p->camera_theta_deg - acos(cosine) * DEG_PER_RAD) < 3.0);
        const double length = fabs(p->column.corner_px[3][along] - p->column.corner_px[0][along]);
        assert_true(length > 34.0 && length < 41.0);
        assert_true(p->column.angle_se_deg > 0.0);
    }
}

/* The outline is found in the picture, where the markers promise it. */
static void test_outline_beside_markers(void **state)
{
    const struct drawn_cylinder d = drawn(10, 0.9, 0);
    struct job_document *doc;
    struct heard heard;
    struct error err = {0};
    write_files(state, &d, 10);
    if (load(state, 15, "up", &heard, &doc, &err) != STATUS_OK) fail_msg("%s", err.text);
    check_columns(&d, doc->rows, 1);
    assert_int_equal(heard.n_radius, 0);
    job_document_free(doc);
    /* a radius that is a fifth too large is refused; the outline of one that is too small lies on the cloth */
    assert_int_equal(load(state, 18, "up", &heard, &doc, &err), STATUS_INVALID);
    assert_string_equal(err.field, "cylinder_radius[0]");
    if (strstr(err.text, "by the markers a cylinder of radius 18 mm") == NULL) fail_msg("%s", err.text);
    job_document_free(doc);
    const status small = load(state, 12, "up", &heard, &doc, &err);
    if (small != STATUS_OK || heard.n_radius != 1) fail_msg("%d, %zu warnings: %s", small, heard.n_radius, err.text);
    job_document_free(doc);
}

/* One silhouette lies in shadow before a dark background: the outline is the one by the markers. */
static void test_outline_by_markers(void **state)
{
    for (int turned = 0; turned < 2; turned++) {
        const struct drawn_cylinder d = drawn(50, 0.0, turned ? -90 : 0);
        struct job_document *doc;
        struct heard heard;
        struct error err = {0};
        write_files(state, &d, 50);
        if (load(state, 15, turned ? "right" : "up", &heard, &doc, &err) != STATUS_OK) fail_msg("%s", err.text);
        check_columns(&d, doc->rows, turned ? 0 : 1);
        assert_int_equal(heard.n_radius, 0);
        job_document_free(doc);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(test_outline_beside_markers, scratch_folder_setup, scratch_folder_teardown),
        cmocka_unit_test_setup_teardown(test_outline_by_markers, scratch_folder_setup, scratch_folder_teardown),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
