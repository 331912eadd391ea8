/* Markers around a sample, drawn as a pinhole camera sees them: the crop and the camera's place follow. */
#include "geometry/vision/vision_markers.h"
#include "optimizer/job/document/job_photograph.h"
#include "optimizer/job/document/job_rows.h"
#include "optimizer/photographs/camera/marker_views.h"
#include "optimizer/photographs/camera/photograph_develop.h"
#include "optimizer/photographs/camera/photograph_process_load.h"
#include "optimizer/photographs/camera/plane_pose.h"
#include "tests/support/scratch_folder.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "tests/support/job_document_text.h"

enum { WIDTH = 900, HEIGHT = 700, BITS = 60, N_MARKER = 4 };
static const double focal_px = 1500.0, center_px[2] = {440, 360}, side_mm = 22.0;
static const double place_mm[N_MARKER][2] = {{-40, 40}, {42, 38}, {40, -41}, {-39, -40}};
static const int marker_id[N_MARKER] = {3, 7, 11, 20};

static double dot(const double a[3], const double b[3]) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

static void cross(const double a[3], const double b[3], double out[3])
{
    for (int k = 0; k < 3; k++) out[k] = a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3];
    double length = sqrt(dot(out, out));
    for (int k = 0; k < 3; k++) out[k] /= length;
}

/* Brightness of the plane at a point in mm: white, with the cells of the markers. */
static double brightness(uint8_t (*marker)[BITS * BITS], double x, double y)
{
    for (size_t m = 0; m < N_MARKER; m++) {
        double u = (x - place_mm[m][0]) / side_mm + 0.5, v = 0.5 - (y - place_mm[m][1]) / side_mm;
        if (u >= 0.0 && v >= 0.0 && u < 1.0 && v < 1.0)
            return marker[m][(size_t)(v * BITS) * BITS + (size_t)(u * BITS)] > 127 ? 0.8 : 0.03;
    }
    return 0.8;
}

/* A picture from `camera` (mm), which looks at the origin. covered: how many markers are left out. */
static void draw(struct image *im, const double camera[3], size_t covered)
{
    static uint8_t marker[N_MARKER][BITS * BITS];
    const double up[3] = {0, 0, 1};
    double forward[3], right[3], down[3], length = sqrt(dot(camera, camera));
    for (size_t m = 0; m < N_MARKER; m++) {
        assert_int_equal(vision_draw_marker("4x4_50", marker_id[m], BITS, marker[m], NULL), STATUS_OK);
        if (m < covered) memset(marker[m], 255, sizeof marker[m]);
    }
    for (int k = 0; k < 3; k++) forward[k] = -camera[k] / length;
    cross(forward, up, right);
    cross(forward, right, down);
    assert_int_equal(image_init(im, WIDTH, HEIGHT, 3, NULL), STATUS_OK);
    for (size_t i = 0; i < (size_t)WIDTH * HEIGHT * 4; i++) { /* 2 x 2 rays a pixel */
        size_t p = i / 4;
        double u = ((double)(p % WIDTH) + 0.25 + 0.5 * (double)(i % 2) - center_px[0]) / focal_px;
        double v = ((double)(p / WIDTH) + 0.25 + 0.5 * (double)(i / 2 % 2) - center_px[1]) / focal_px, ray[3];
        for (int k = 0; k < 3; k++) ray[k] = forward[k] + u * right[k] + v * down[k];
        double t = -camera[2] / ray[2], b = brightness(marker, camera[0] + t * ray[0], camera[1] + t * ray[1]);
        for (size_t c = 0; c < 3; c++) im->pixel[3 * p + c] += (float)(0.25 * b);
    }
}

static void camera_at(double theta_deg, double phi_deg, double camera[3])
{
    double theta = theta_deg * M_PI / 180.0, phi = phi_deg * M_PI / 180.0;
    camera[0] = 500.0 * sin(theta) * cos(phi);
    camera[1] = 500.0 * sin(theta) * sin(phi);
    camera[2] = 500.0 * cos(theta);
}

static struct marker_board board(void)
{
    struct marker_board b = {.n = N_MARKER, .dictionary = "4x4_50", .side_mm = side_mm};
    memcpy(b.id, marker_id, sizeof marker_id);
    memcpy(b.center_mm, place_mm, sizeof place_mm);
    return b;
}

static void test_plane_map(void **state)
{
    const double map[9] = {3.1, 0.2, 440, -0.1, -2.9, 360, 1e-4, 3e-4, 1},
                 line[4][2] = {{0, 0}, {1, 1}, {2, 2}, {3, 3}};
    double plane[6][2] = {{0, 0}, {50, 0}, {0, 50}, {-40, 30}, {20, -60}, {-30, -35}}, pixel[6][2], found[9], rms;
    struct error err = {0};
    (void)state;
    for (size_t i = 0; i < 6; i++) plane_map_apply(map, plane[i], pixel[i]);
    assert_int_equal(plane_map_fit(6, (const double(*)[2])plane, (const double(*)[2])pixel, found, &rms, &err),
                     STATUS_OK);
    assert_true(rms < 1e-6);
    for (size_t i = 0; i < 9; i++) assert_true(fabs(found[i] / found[8] - map[i]) < 1e-6);
    assert_int_equal(plane_map_fit(4, line, line, found, &rms, &err), STATUS_NUMERIC);
}

static void test_camera_from_markers(void **state)
{
    static const double place[3][2] = {{35, 200}, {60, -30}, {5, 90}};
    const struct lens lens = {
        .has_distortion = true, .focal_px = {focal_px, focal_px}, .center_px = {center_px[0], center_px[1]}};
    const struct marker_board b = board();
    (void)state;
    for (size_t i = 0; i < 3; i++) {
        double camera[3];
        struct image im;
        struct marker_view view;
        struct error err = {0};
        camera_at(place[i][0], place[i][1], camera);
        draw(&im, camera, i); /* up to two markers are covered */
        if (marker_view_find(&b, &lens, &im, &view, &err) != STATUS_OK) fail_msg("%zu: %s", i, err.text);
        assert_true(view.n_marker == N_MARKER - i && view.rms_px < 0.6);
        assert_true(hypot(view.center_px[0] - center_px[0], view.center_px[1] - center_px[1]) < 0.7);
        assert_true(fabs(view.px_per_mm / 3.0 - 1.0) < 0.01);
        for (int k = 0; k < 3; k++)
            if (!(fabs(view.camera_mm[k] - camera[k]) < (i == 2 ? 15.0 : 8.0)))
                fail_msg("%zu: %g, not %g", i, view.camera_mm[k], camera[k]);
        image_release(&im);
    }
}

/* Markers that the picture's border cuts are not used: the others say where the crop is. */
static void test_markers_cut_by_the_border(void **state)
{
    const struct lens lens = {.has_distortion = false};
    const struct marker_board b = board();
    struct image whole;
    double camera[3];
    (void)state;
    camera_at(5.0, 90.0, camera);
    draw(&whole, camera, 0);
    for (size_t cut = 280; cut <= 360; cut += 8) { /* two markers lie from about 286 to 355 */
        struct image im;
        struct marker_view view;
        struct error err = {0};
        assert_int_equal(image_init(&im, WIDTH - cut, HEIGHT, 3, NULL), STATUS_OK);
        for (size_t y = 0; y < HEIGHT; y++)
            memcpy(im.pixel + 3 * y * im.width, whole.pixel + 3 * (y * WIDTH + cut), 3 * im.width * sizeof *im.pixel);
        if (marker_view_find(&b, &lens, &im, &view, &err) != STATUS_OK) fail_msg("cut %zu: %s", cut, err.text);
        double x = view.center_px[0] + (double)cut;
        if (cut > 292 && cut < 350) assert_int_equal(view.n_marker, 2);
        if (!(hypot(x - center_px[0], view.center_px[1] - center_px[1]) < 1.6)) /* half a millimetre */
            fail_msg("cut %zu: %zu markers, center at %g, %g", cut, view.n_marker, x, view.center_px[1]);
        image_release(&im);
    }
    image_release(&whole);
}

/* A job of one photograph of view v, loaded with its rig. folder: 1024 bytes, where the files are. */
static struct job_document *load_job(void **state, const char *rig, const struct image *im,
                                     struct photograph_process *k, char *folder)
{
    struct error err = {0};
    const char *path = scratch_path(state, "rig.json");
    snprintf(folder, 1024, "%.*s", (int)(strrchr(path, '/') - path), path);
    scratch_write(path, rig, strlen(rig));
    assert_int_equal(image_write_exr(im, scratch_path(state, "a.exr"), NULL), STATUS_OK);
    struct job_document *doc = job_document_of_text(
        "{\"sample\":\"s\",\"fibers\":{\"file\":\"c.hair\"},\"rig\":{\"file\":\"rig.json\"},\"photographs\":[{\"file\":"
        "\"a.exr\",\"set\":\"fit\",\"view\":\"v\"}]}");
    photograph_process_init(k);
    if (photograph_process_load(k, doc->setup, doc->rows, folder, &err) != STATUS_OK) fail_msg("%s", err.text);
    return doc;
}

static void test_job_with_markers(void **state)
{
    static const char rig[] =
        "{\"selvedge_rig\":1,\"lamps\":{\"a\":{\"theta_deg\":20,\"phi_deg\":0}},\"views\":{\"v\":{\"lamp\":\"a\","
        "\"cloth_rotation_deg\":30}},\"lens\":{\"distortion\":{\"focal_px\":[1500,1500],\"center_px\":[440,360],"
        "\"k\":[0,0,0],\"p\":[0,0]}},\"markers\":{\"dictionary\":\"4x4_50\",\"side_mm\":22,\"center_mm\":{\"3\":[-40,"
        "40],"
        "\"7\":[42,38],\"11\":[40,-41],\"20\":[-39,-40]}}}";
    double camera[3];
    struct image im;
    struct error err = {0};
    struct photograph_process k;
    char folder[1024];
    camera_at(35, 200, camera);
    draw(&im, camera, 0);
    struct job_document *doc = load_job(state, rig, &im, &k, folder);
    const struct job_photograph *p = &doc->rows->photograph[0];
    assert_true(fabs(p->camera_theta_deg - 35.0) < 0.5 && fabs(p->camera_phi_deg - (200.0 - 360.0 + 30.0)) < 0.7);
    assert_true(fabs(p->camera_distance_cm - 50.0) < 0.6 && p->light_theta_deg == 20.0);
    assert_true(p->crop_px[0] >= 424 && p->crop_px[0] <= 426 && p->crop_px[2] - p->crop_px[0] == 30);
    photograph_process_release(&k);
    for (size_t i = 0; i < (size_t)WIDTH * HEIGHT * 3; i++) im.pixel[i] = 0.5f;
    assert_int_equal(image_write_exr(&im, scratch_path(state, "a.exr"), NULL), STATUS_OK);
    doc->rows->photograph[0].crop_px[2] = 0;
    assert_int_equal(photograph_process_load(&k, doc->setup, doc->rows, folder, &err), STATUS_INVALID);
    assert_non_null(strstr(err.text, "'a.exr': it shows 0 of the 4 markers"));
    assert_string_equal(err.field, "photograph_file[0]");
    photograph_process_release(&k);
    image_release(&im);
    job_document_free(doc);
}

/* ---- a ChArUco board ---- */

enum { COLUMNS = 9, ROWS = 7, N_SQUARE = COLUMNS * ROWS };
static const double square_mm = 11.0, small_mm = 8.0, upper_left_mm[2] = {-49.5, 38.5};

/* Brightness of the board, whose upper left square is black; a dark patch of covered_mm lies on its middle. */
static double board_brightness(uint8_t (*marker)[BITS * BITS], double covered_mm, double x, double y)
{
    double u = (x - upper_left_mm[0]) / square_mm, v = (upper_left_mm[1] - y) / square_mm;
    if (fabs(x) < 0.5 * covered_mm && fabs(y) < 0.5 * covered_mm)
        return 0.3 + 0.2 * sin(x * 9.0) * sin(y * 7.0); /* cloth */
    if (u < 0.0 || v < 0.0 || u >= COLUMNS || v >= ROWS) return 0.8;
    size_t i = (size_t)u, j = (size_t)v;
    if ((i + j) % 2 == 0) return 0.03;
    double a = (u - (double)i - 0.5) * square_mm / small_mm + 0.5,
           b = (v - (double)j - 0.5) * square_mm / small_mm + 0.5;
    if (a < 0.0 || b < 0.0 || a >= 1.0 || b >= 1.0) return 0.8;
    return marker[(j * COLUMNS + i) / 2][(size_t)(b * BITS) * BITS + (size_t)(a * BITS)] > 127 ? 0.8 : 0.03;
}

/* Draws it through a lens with distortion. */
static void draw_board(struct image *im, const double camera[3], const struct lens *lens, double covered_mm)
{
    static uint8_t marker[N_SQUARE / 2][BITS * BITS];
    const double up[3] = {0, 0, 1};
    double forward[3], right[3], down[3], length = sqrt(dot(camera, camera));
    for (int m = 0; m < N_SQUARE / 2; m++)
        assert_int_equal(vision_draw_marker("4x4_50", m, BITS, marker[m], NULL), STATUS_OK);
    for (int k = 0; k < 3; k++) forward[k] = -camera[k] / length;
    cross(forward, up, right);
    cross(forward, right, down);
    assert_int_equal(image_init(im, WIDTH, HEIGHT, 3, NULL), STATUS_OK);
    for (size_t i = 0; i < (size_t)WIDTH * HEIGHT * 4; i++) {
        size_t p = i / 4;
        const double real[2] = {(double)(p % WIDTH) + 0.25 + 0.5 * (double)(i % 2),
                                (double)(p / WIDTH) + 0.25 + 0.5 * (double)(i / 2 % 2)};
        double ideal[2] = {real[0], real[1]}, back[2], ray[3];
        for (int n = 0; n < 4; n++) {
            lens_distort(lens, ideal, back);
            for (int k = 0; k < 2; k++) ideal[k] += real[k] - back[k];
        }
        double u = (ideal[0] - center_px[0]) / focal_px, v = (ideal[1] - center_px[1]) / focal_px;
        for (int k = 0; k < 3; k++) ray[k] = forward[k] + u * right[k] + v * down[k];
        double t = -camera[2] / ray[2];
        double b = board_brightness(marker, covered_mm, camera[0] + t * ray[0], camera[1] + t * ray[1]);
        for (size_t c = 0; c < 3; c++) im->pixel[3 * p + c] += (float)(0.25 * b);
    }
}

static void test_charuco_board(void **state)
{
    static const double place[2][2] = {{55, -30}, {8, 90}};
    const struct lens lens = {.has_distortion = true,
                              .focal_px = {focal_px, focal_px},
                              .center_px = {center_px[0], center_px[1]},
                              .k = {-0.12, 0.05, 0}};
    struct marker_board b = {.dictionary = "4x4_50", .side_mm = small_mm, .square_mm = square_mm};
    (void)state;
    assert_true(marker_board_fill(&b, (size_t[2]){COLUMNS, ROWS}, upper_left_mm, true));
    assert_true(b.n == N_SQUARE / 2 && b.n_corner == (COLUMNS - 1) * (ROWS - 1));
    for (size_t i = 0; i < 2; i++) {
        double camera[3], off = 0.0;
        struct image im;
        struct marker_view view;
        struct error err = {0};
        camera_at(place[i][0], place[i][1], camera);
        draw_board(&im, camera, &lens, 25.0 + 5.0 * (double)i);
        if (marker_view_find(&b, &lens, &im, &view, &err) != STATUS_OK) fail_msg("%zu: %s", i, err.text);
        image_release(&im);
        for (int k = 0; k < 3; k++) off += (view.camera_mm[k] - camera[k]) * (view.camera_mm[k] - camera[k]);
        /* from straight above a tilt hardly shows */
        if (!(sqrt(off) < (i == 1 ? 10.0 : 2.5) && view.rms_px < 0.5 && view.n_marker >= 20 && view.n_corner >= 16))
            fail_msg("%zu: %g mm off, %g px, %zu markers, %zu corners", i, sqrt(off), view.rms_px, view.n_marker,
                     view.n_corner);
        assert_true(hypot(view.center_px[0] - center_px[0], view.center_px[1] - center_px[1]) < 0.3);
    }
}

static void test_job_with_a_board(void **state)
{
    static const char rig[] =
        "{\"selvedge_rig\":1,\"lamps\":{\"a\":{\"theta_deg\":20,\"phi_deg\":0}},\"views\":{\"v\":{\"lamp\":\"a\"}},"
        "\"lens\":{\"distortion\":{\"focal_px\":[1500,1500],\"center_px\":[440,360],\"k\":[0.1,0,0],\"p\":[0,0]}},"
        "\"markers\":{\"dictionary\":\"4x4_50\",\"side_mm\":8,\"charuco\":{\"squares\":[9,7],\"square_mm\":11,"
        "\"upper_left_mm\":[-49.5,38.5]}}}";
    const struct lens lens = {
        .has_distortion = true, .focal_px = {1500, 1500}, .center_px = {440, 360}, .k = {0.1, 0, 0}};
    double camera[3];
    struct image im;
    struct photograph_process k;
    char folder[1024];
    camera_at(40, 120, camera);
    draw_board(&im, camera, &lens, 20.0);
    struct job_document *doc = load_job(state, rig, &im, &k, folder);
    const struct job_photograph *p = &doc->rows->photograph[0];
    assert_true(fabs(p->camera_theta_deg - 40.0) < 0.3 && fabs(p->camera_phi_deg - 120.0) < 0.4);
    assert_true(fabs(p->camera_distance_cm - 50.0) < 0.3);
    assert_true(p->crop_px[0] >= 424 && p->crop_px[0] <= 426 && p->crop_px[2] - p->crop_px[0] == 30);
    photograph_process_release(&k);
    image_release(&im);
    job_document_free(doc);
}

static void test_layout_of_boards(void **state)
{
    struct marker_board b = {.side_mm = 1, .square_mm = 2};
    const double corner[2] = {10, 20};
    (void)state;
    assert_true(marker_board_fill(&b, (size_t[2]){3, 4}, corner, false)); /* the first square has marker 0 */
    assert_true(b.n == 6 && b.n_corner == 6 && b.id[5] == 5);
    assert_true(b.center_mm[0][0] == 11 && b.center_mm[0][1] == 19 && b.center_mm[1][0] == 15);
    assert_true(b.corner_mm[0][0] == 12 && b.corner_mm[0][1] == 18);
    assert_true(b.corner_marker[0][0] + b.corner_marker[0][1] == 2); /* markers 0 and 2 meet there */
    assert_false(marker_board_fill(&b, (size_t[2]){2, 9}, corner, true));
    assert_false(marker_board_fill(&b, (size_t[2]){20, 20}, corner, true));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_charuco_board),
        cmocka_unit_test(test_job_with_a_board),
        cmocka_unit_test(test_layout_of_boards),
        cmocka_unit_test(test_plane_map),
        cmocka_unit_test(test_markers_cut_by_the_border),
        cmocka_unit_test(test_camera_from_markers),
        cmocka_unit_test(test_job_with_markers),
    };
    return cmocka_run_group_tests(tests, scratch_folder_setup, scratch_folder_teardown);
}
