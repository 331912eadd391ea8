/* Meshes: OBJ files as they are found, and what is refused with the triangle or the line that is at fault. */
#include "renderer/mesh/mesh.h"
#include "renderer/mesh/mesh_shapes.h"
#include "tests/support/scratch_folder.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static status read_text(void **state, const char *text, struct mesh *m, struct error *err)
{
    const char *path = scratch_path(state, "a.obj");
    scratch_write(path, text, strlen(text));
    return mesh_read_obj(path, 10.0, m, err);
}

#define SQUARE                                                                                                         \
    "# a square of centimetres\r\nv 0 0 0\nv 1 0 0 1\nv\t1 1 0\nv 0 1 0\nvt 0 0\nvt 2 0 0\nvt 2 2\nvt 0 2\nvn 0 0 1\n"

static void polygons_become_triangles(void **state)
{
    static const char *const face[] = {"f 1/1 2/2 3/3 4/4\n", "s off\nf 1/1/1 2/2/1 3/3/1 4/4/1",
                                       "f -4/-4 -3/-3 -2/-2 -1/-1\n", "f 1/1 2/2 3/3\r\nf 1/1 3/3 4/4\r\n"};
    for (size_t i = 0; i < sizeof face / sizeof face[0]; i++) {
        char text[512];
        struct mesh m;
        struct error err = {0};
        snprintf(text, sizeof text, "%s%s", SQUARE, face[i]);
        if (read_text(state, text, &m, &err) != STATUS_OK) fail_msg("%zu: %s", i, err.text);
        assert_int_equal(m.n_triangle, 2);
        assert_int_equal(m.n_position, 4);
        assert_true(m.position_mm[2][0] == 10.0 && m.texture_mm[2][1] == 20.0);
        assert_int_equal(m.triangle[1].position[1], 2);
        assert_int_equal(m.triangle[1].texture[2], 3);
        mesh_release(&m);
    }
}

/* The same square with what other programs write: byte order mark, comments after a statement, continued lines, ends of
 * lines of all systems, faces before their points. */
static void other_spellings_are_read(void **state)
{
    static const char *const file[] = {
        "\xef\xbb\xbf" SQUARE "f 1/1 2/2 3/3 4/4\n",
        SQUARE "f 1/1 2/2 3/3 # upper\nf 1/1 3/3 4/4#lower\n",
        SQUARE "f 1/1 2/2 \\\n3/3 4/4\n",
        SQUARE "f 1/1 2/2 3/3\\\r\n 4/4\r\n",
        SQUARE "f \\  \n1/1 \\\n\\\n2/2 3/3 4/4",
        SQUARE "# C:\\meshes\\\nf 1/1 2/2 3/3 4/4\n",
        SQUARE "usemtl a#b\\\n c\nf 1/1 2/2 3/3 4/4\n",
        "f 1/1/1 2/2/1 3/3/1 4/4/1\n" SQUARE,
        "v 0 0 0\rv 1 0 0\rv 1 1 0\rv 0 1 0\rvt 0 0\rvt 2 0\rvt 2 2\rvt 0 2\rf -4/-4 2/2 3/3 -1/-1\r",
    };
    for (size_t i = 0; i < sizeof file / sizeof file[0]; i++) {
        struct mesh m;
        struct error err = {0};
        if (read_text(state, file[i], &m, &err) != STATUS_OK) fail_msg("%zu: %s", i, err.text);
        assert_int_equal(m.n_triangle, 2);
        assert_int_equal(m.n_position, 4);
        assert_true(m.position_mm[2][0] == 10.0 && m.texture_mm[2][1] == 20.0);
        assert_int_equal(m.triangle[1].position[2], 3);
        mesh_release(&m);
    }
}

static void other_statements_are_in_the_ledger(void **state)
{
    const char *path = scratch_path(state, "a.obj");
    static const char text[] = "mtllib a.mtl\nusemtl red\nusemtl blue\n" SQUARE "f 1/1 2/2 3/3 4/4\nl 1 2\n";
    struct file_ledger ledger = {0};
    struct mesh m;
    scratch_write(path, text, sizeof text - 1);
    assert_int_equal(mesh_read_obj_ledger(path, 1.0, &m, &ledger, NULL), STATUS_OK);
    mesh_release(&m);
    assert_int_equal(ledger.n, 4);
    assert_string_equal(file_ledger_find(&ledger, "material")->value, "red");
    assert_int_equal(file_ledger_find(&ledger, "normals")->use, FILE_STATEMENT_NOT_USED);
    assert_non_null(file_ledger_find(&ledger, "material library"));
    assert_non_null(file_ledger_find(&ledger, "lines"));
}

/* Texture coordinates of 20 mm on 10 mm, and such that equal areas hide. */
static void stretch_is_measured(void **state)
{
    static const struct {
        const char *texture;
        double area, u, v;
    } of[] = {
        {"vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n", 1.0, 1.0, 1.0},
        {"vt 0 0\nvt 2 0\nvt 2 2\nvt 0 2\n", 0.25, 0.5, 0.5},
        {"vt 0 0\nvt 4 0\nvt 4 .25\nvt 0 .25\n", 1.0, 0.25, 4.0},
        {"vt 0 0\nvt 0 .1\nvt -.1 .1\nvt -.1 0\n", 100.0, 10.0, 10.0}, /* turned */
    };
    for (size_t i = 0; i < sizeof of / sizeof of[0]; i++) {
        char text[512];
        struct mesh m;
        snprintf(text, sizeof text, "v 0 0 0\nv 1 0 0\nv 1 0 1\nv 0 0 1\n%sf 1/1 2/2 3/3 4/4\n", of[i].texture);
        assert_int_equal(read_text(state, text, &m, NULL), STATUS_OK);
        const struct mesh_stretch s = mesh_stretch(&m);
        assert_true(fabs(s.area / of[i].area - 1.0) < 1e-12);
        assert_true(fabs(s.along[0] / of[i].u - 1.0) < 1e-12 && fabs(s.along[1] / of[i].v - 1.0) < 1e-12);
        mesh_release(&m);
    }
}

static void equal_positions_become_one(void **state)
{
    struct mesh m;
    struct error err = {0};
    if (read_text(state, SQUARE "v 0 0 0\nv 1 1 0\nf 1/1 2/2 3/3\nf 5/1 6/3 4/4\n", &m, &err) != STATUS_OK)
        fail_msg("%s", err.text);
    assert_int_equal(m.triangle[1].position[0], 0);
    assert_int_equal(m.triangle[1].position[1], 2);
    assert_int_equal(m.triangle[1].position[2], 3);
    mesh_release(&m);
}

static void faults_are_named(void **state)
{
    static const struct {
        const char *text, *word;
        status code;
    } bad[] = {
        {SQUARE "f 1 2 3\n", "line 11: the face has no texture coordinates", STATUS_FORMAT},
        {SQUARE "f 1//1 2//1 3//1\n", "no texture coordinates", STATUS_FORMAT},
        {SQUARE "f 1/1 2/2 9/3\n", "position (v) that is not there", STATUS_FORMAT},
        {SQUARE "f 1/1 2/2 3/-9\n", "texture coordinate (vt) that is not there", STATUS_FORMAT},
        {SQUARE "f 1/1 2/2\n", "three corners", STATUS_FORMAT},
        {SQUARE "f 1/1 \\\n2/2 9/9\n", "line 11: the face names a position", STATUS_FORMAT},
        {SQUARE "vt 0 \\\n0\nf 1/1 2/2 9/9\n", "line 13: the face names a position", STATUS_FORMAT},
        {SQUARE "f 1/1 2/2 3/3x\n", "line 11: a corner of the face is not v/vt/vn", STATUS_FORMAT},
        {SQUARE "f -9/-1 2/2 3/3\n", "position (v) that is not there", STATUS_FORMAT},
        {SQUARE "cstype bspline\n", "line 11: it is of a curved surface", STATUS_FORMAT},
        {"v 1,5 2 3\n", "line 1: a number is missing", STATUS_FORMAT},
        {"v 1 2\n", "line 1: a number is missing", STATUS_FORMAT},
        {"", "no triangles", STATUS_INVALID},
        {SQUARE "f 1/1 2/2 2/3\n", "triangle 1 of the mesh has no area", STATUS_INVALID},
        {SQUARE "f 1/1 2/2 3/2\n", "triangle 1 of the mesh has no area in its texture", STATUS_INVALID},
        {SQUARE "f 1/1 2/4 3/3\n", "triangle 1 of the mesh is mirrored", STATUS_INVALID},
        {SQUARE "v 0 0 nan\nf 1/1 2/2 3/3\n", "not finite", STATUS_INVALID},
        {SQUARE "v 0 0 9\nf 1/1 2/2 3/3\nf 1/1 2/2 5/3\n", "more than two triangles", STATUS_INVALID},
        {SQUARE "v 0 0 9\nf 1/1 2/2 3/3\nf 2/1 1/2 4/3\nf 1/1 2/2 5/3\n", "triangles 1 and 3", STATUS_INVALID},
    };
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        struct mesh m;
        struct error err = {0};
        assert_int_equal(read_text(state, bad[i].text, &m, &err), bad[i].code);
        if (strstr(err.text, bad[i].word) == NULL) fail_msg("%zu: '%s' does not say '%s'", i, err.text, bad[i].word);
        assert_null(m.triangle);
    }
    struct error err = {0};
    struct mesh m;
    const char *utf16 = scratch_path(state, "utf16.obj");
    scratch_write(utf16, "\xff\xfev\0 \0", 6);
    assert_int_equal(mesh_read_obj(utf16, 1.0, &m, &err), STATUS_FORMAT);
    assert_non_null(strstr(err.text, "UTF-16"));
    assert_int_equal(mesh_read_obj("/nowhere/a.obj", 1.0, &m, &err), STATUS_NOT_FOUND);
}

/* The normals of a cylinder point away from its axis; at the ends of the mesh they belong to one triangle only. */
static void shapes_are_sound(void **state)
{
    (void)state;
    struct mesh m;
    double normal[2 * 101][3];
    assert_int_equal(mesh_cylinder(15.0, 20.0, 1.5, 100, &m, NULL), STATUS_OK);
    assert_int_equal(mesh_check(&m, NULL), STATUS_OK);
    assert_int_equal(mesh_normals(&m, normal, NULL), STATUS_OK);
    for (size_t i = 0; i < m.n_position; i++) {
        double x = m.position_mm[i][0], z = m.position_mm[i][2] + 15.0;
        assert_true(fabs(hypot(x, z) - 15.0) < 1e-12);
        assert_true((normal[i][0] * x + normal[i][2] * z) / 15.0 > cos(1.51 / 100));
        assert_true(fabs(m.texture_mm[i][0] - 15.0 * atan2(x, z)) < 1e-12);
    }
    mesh_release(&m);
    assert_int_equal(mesh_flat((const double[2]){3, 4}, (const size_t[2]){2, 5}, &m, NULL), STATUS_OK);
    assert_int_equal(mesh_check(&m, NULL), STATUS_OK);
    assert_int_equal(m.n_triangle, 20);
    mesh_release(&m);
    assert_int_equal(mesh_flat((const double[2]){3, 0}, (const size_t[2]){2, 5}, &m, NULL), STATUS_INVALID);
    assert_int_equal(mesh_cylinder(15.0, 20.0, 4.0, 100, &m, NULL), STATUS_INVALID);
}

/* What is written is read again as the same mesh, to the digits written. */
static void a_written_mesh_is_read_again(void **state)
{
    struct mesh m, read;
    struct error err = {0};
    char *text;
    size_t n;
    const char *path = scratch_path(state, "b.obj");
    assert_int_equal(mesh_cylinder(15.0, 20.0, 1.0, 7, &m, &err), STATUS_OK);
    assert_int_equal(mesh_obj_text(&m, &text, &n, &err), STATUS_OK);
    scratch_write(path, text, n);
    free(text);
    if (mesh_read_obj(path, 1.0, &read, &err) != STATUS_OK) fail_msg("%s", err.text);
    assert_int_equal(read.n_triangle, m.n_triangle);
    assert_memory_equal(read.triangle, m.triangle, m.n_triangle * sizeof *m.triangle);
    for (size_t i = 0; i < m.n_position; i++)
        for (int k = 0; k < 3; k++) assert_true(fabs(read.position_mm[i][k] - m.position_mm[i][k]) <= 5e-6 * 20.0);
    mesh_release(&read);
    mesh_release(&m);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(polygons_become_triangles, scratch_folder_setup, scratch_folder_teardown),
        cmocka_unit_test_setup_teardown(other_spellings_are_read, scratch_folder_setup, scratch_folder_teardown),
        cmocka_unit_test_setup_teardown(other_statements_are_in_the_ledger, scratch_folder_setup,
                                        scratch_folder_teardown),
        cmocka_unit_test_setup_teardown(stretch_is_measured, scratch_folder_setup, scratch_folder_teardown),
        cmocka_unit_test_setup_teardown(equal_positions_become_one, scratch_folder_setup, scratch_folder_teardown),
        cmocka_unit_test_setup_teardown(a_written_mesh_is_read_again, scratch_folder_setup, scratch_folder_teardown),
        cmocka_unit_test_setup_teardown(faults_are_named, scratch_folder_setup, scratch_folder_teardown),
        cmocka_unit_test(shapes_are_sound),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
