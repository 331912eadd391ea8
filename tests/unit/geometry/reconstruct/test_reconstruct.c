/* The whole reconstruction of small volumes with straight fibers, from a TIFF file to fibers. The result is the same
 * for any number of threads. */
#include "base/option_id.h"
#include "tests/support/scan/cylinder_scan.h"
#include "tests/support/scan/scan_files.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

static char path[128];
/* Of the scan in memory with axes "xyz" and three threads; tests only read it. */
static struct cylinder_result reference;

static int make_scan(void **state)
{
    (void)state;
    char folder[64];
    test_make_folder(folder);
    snprintf(path, sizeof path, "%s/scan.tif", folder);
    cylinder_scan_write(path);
    cylinder_scan_run_axes(NULL, path, "xyz", 3, &reference);
    return 0;
}

static int release_reference(void **state)
{
    (void)state;
    cylinder_result_release(&reference);
    return 0;
}

/* Root mean square of the distances of all vertices from the nearest cylinder's axis, in voxels. */
static double rms_from_axes(const struct fiber_set *f)
{
    double square = 0.0;
    for (size_t i = 0; i < f->n_vertex; i++) {
        double least = INFINITY;
        for (int c = 0; c < CYLINDER_N; c++) {
            double norm = 0.0, along = 0.0, d2 = 0.0;
            for (size_t a = 0; a < 3; a++)
                norm += cylinder_scan_axis[c].direction[a] * cylinder_scan_axis[c].direction[a];
            for (size_t a = 0; a < 3; a++) {
                double p = (double)f->position_m[3 * i + a] / 2e-6 - cylinder_scan_axis[c].point[a];
                along += p * cylinder_scan_axis[c].direction[a] / sqrt(norm);
                d2 += p * p;
            }
            least = fmin(least, d2 - along * along);
        }
        square += least;
    }
    return sqrt(square / (double)f->n_vertex);
}

static void test_chain(void **state)
{
    (void)state;
    const struct cylinder_result x = reference;
    print_message("low %.0f high %.0f noise %.3f diameter %.2f radius %.3f um (7.0) rms %.3f voxels length %.1f um "
                  "dice %.3f change %.2f\n",
                  x.r.density_low, x.r.density_high, x.r.noise.scan_sd, x.r.fiber_diameter_voxel, x.r.radius_m[0] * 1e6,
                  rms_from_axes(&x.f), x.r.total_length_m * 1e6, x.r.dice, x.r.direction_change_mean_deg);
    assert_true(fabs(x.r.density_low - 20000.0) < 500.0 && fabs(x.r.density_high - 30000.0) < 1500.0);
    assert_true(fabs(x.r.noise.scan_sd - 0.2) < 0.04);
    assert_int_equal(x.f.n_fiber, CYLINDER_N);
    assert_true(rms_from_axes(&x.f) < 0.3);
    assert_true(fabs(x.r.radius_m[0] / 7e-6 - 1.0) < 0.03);
    assert_true(x.r.dice > 0.85);
    for (size_t l = 0; l < CYLINDER_N; l++) { /* every fiber runs from face to face */
        const float *a = x.f.position_m + 3 * x.f.first_vertex[l],
                    *b = x.f.position_m + 3 * (x.f.first_vertex[l + 1] - 1);
        int axis = x.f.axis_class[l];
        double low = fmin((double)a[axis], (double)b[axis]) / 2e-6,
               high = fmax((double)a[axis], (double)b[axis]) / 2e-6;
        double edge = axis == 0 ? CYLINDER_NX : CYLINDER_NY;
        bool leaning = fabs((double)(a[2] - b[2])) > 60e-6; /* leaves through the top and the bottom */
        assert_true(leaning || (low < 0.01 && high > edge - 0.01));
    }
    assert_true(fabs(x.f.tile_size_m[0] - CYLINDER_NX * 2e-6) < 1e-12 &&
                fabs(x.f.tile_size_m[1] - CYLINDER_NY * 2e-6) < 1e-12);
    uint8_t *rgb;
    size_t width, height, red = 0;
    assert_int_equal(reconstruct_slice_picture(&x.v, &x.f, 0, CYLINDER_NX / 2, &rgb, &width, &height, NULL), STATUS_OK);
    assert_true(width == 3 * CYLINDER_NY && height == 3 * CYLINDER_NZ);
    for (size_t i = 0; i < width * height; i++) red += rgb[3 * i] == 255 && rgb[3 * i + 1] == 0;
    assert_true(red >= 3 * 13); /* crosses of 13 pixels for the three fibers along x */
    free(rgb);
    assert_int_equal(reconstruct_slice_picture(&x.v, &x.f, 0, CYLINDER_NX, &rgb, &width, &height, NULL),
                     STATUS_INVALID);
}

/* Values that are chosen from the data are written into the options. A run with these values as options gives the same
 * result, and a run with other values uses those. */
static void test_choices_are_reported_and_overridable(void **state)
{
    (void)state;
    const struct cylinder_result x = reference;
    struct cylinder_result y;
    const struct reconstruct_option *o = &x.o;
    const double chosen[] = {o->density_low, o->density_high, o->s,           o->t,           (double)o->h,
                             o->eps_d,       o->eps_j,        o->radius_m[0], o->radius_m[1], o->radius_m[2]};
    for (size_t i = 0; i < sizeof chosen / sizeof *chosen; i++) assert_true(isfinite(chosen[i]) && chosen[i] != 0.0);
    assert_true(x.r.density_low == o->density_low && x.r.density_high == o->density_high);
    for (int a = 0; a < 3; a++) assert_true(x.r.radius_m[a] == o->radius_m[a] && x.r.radius_se_m[a] > 0.0);
    cylinder_scan_run_in(NULL, path, o, 2, &y);
    assert_int_equal(y.f.n_vertex, x.f.n_vertex);
    assert_memory_equal(y.f.position_m, x.f.position_m, x.f.n_vertex * 3 * sizeof(float));
    assert_true(isnan(y.r.radius_se_m[0])); /* given, not measured */
    cylinder_result_release(&y);
    struct reconstruct_option other = *o;
    other.density_low += 500.0;
    other.density_high -= 500.0;
    other.s *= 1.2;
    other.t *= 1.1;
    other.h += 2;
    other.eps_d += 0.03;
    other.eps_j *= 0.9;
    for (int a = 0; a < 3; a++) other.radius_m[a] *= 1.1;
    cylinder_scan_run_in(NULL, path, &other, 2, &y);
    assert_true(y.o.density_low == other.density_low && y.o.density_high == other.density_high && y.o.s == other.s &&
                y.o.t == other.t);
    assert_true(y.o.h == other.h && y.o.eps_d == other.eps_d && y.o.eps_j == other.eps_j &&
                y.o.radius_m[1] == other.radius_m[1]);
    assert_true(y.r.density_low == other.density_low && y.r.radius_m[1] == other.radius_m[1]);
    assert_true(y.r.n_kept_voxel != x.r.n_kept_voxel);
    assert_true(fabs((double)y.f.radius_m[0] / other.radius_m[y.f.axis_class[0]] - 1.0) < 1e-6);
    cylinder_result_release(&y);
}

struct advice {
    int n_said;
    size_t x0, x1, y0, y1;
};

static void take_advice(void *context, const char *option, const char *text)
{
    (void)option;
    struct advice *a = context;
    const char *at = strstr(text, "crop to x ");
    if (at != NULL && sscanf(at, "crop to x %zu..%zu, y %zu..%zu", &a->x0, &a->x1, &a->y0, &a->y1) == 4) a->n_said++;
}

/* The box that a warning names is in voxels of the whole volume, as in the job document, also when the job has a box.
 * A job with the named box has no such warning. */
static void test_advice_to_crop_can_be_followed(void **state)
{
    (void)state;
    struct advice advice[2] = {0};
    struct reconstruct_option o;
    for (int i = 0; i < 2; i++) {
        struct volume v;
        struct reconstruct_report r = {0};
        struct error err = {0};
        const char *file = path;
        const double turned[9] = {0.985, -0.174, 0.0, 0.174, 0.985, 0.0, 0.0, 0.0, 1.0};
        const size_t box[6] = {30, 2, 0, CYLINDER_NX, CYLINDER_NY - 2, CYLINDER_NZ};
        reconstruct_option_default(&o);
        for (int a = 0; a < 3; a++) o.voxel_size_m[a] = 2e-6;
        memcpy(o.matrix, turned, sizeof o.matrix);
        memcpy(o.crop_voxel, box, sizeof o.crop_voxel);
        if (i == 1)
            memcpy(o.crop_voxel,
                   (const size_t[6]){advice[0].x0, advice[0].y0, 0, advice[0].x1, advice[0].y1, CYLINDER_NZ},
                   sizeof o.crop_voxel);
        if (reconstruct_read(&file, 1, &o, NULL, NULL, NULL, &v, &r, &err) != STATUS_OK) fail_msg("%s", err.text);
        reconstruct_warn_volume(&o, &r, &(struct warning_sink){take_advice, &advice[i]});
        volume_release(&v);
    }
    assert_int_equal(advice[0].n_said, 1);
    assert_true(advice[0].x0 >= 30 && advice[0].x1 > 55 && advice[0].x1 <= CYLINDER_NX && advice[0].y0 >= 2 &&
                advice[0].y1 <= CYLINDER_NY - 2);
    assert_int_equal(advice[1].n_said, 0);
}

/* A value of t that fits no s that the data can give is refused before the filter runs, and the error names it. */
static void test_filter_that_finds_nothing(void **state)
{
    (void)state;
    struct volume v;
    struct direction_volume d;
    struct reconstruct_option o;
    struct reconstruct_report r = {0};
    struct error err = {0};
    const char *file = path;
    reconstruct_option_default(&o);
    for (int a = 0; a < 3; a++) o.voxel_size_m[a] = 2e-6;
    o.t = 0.01;
    assert_int_equal(reconstruct_read(&file, 1, &o, NULL, NULL, NULL, &v, &r, &err), STATUS_OK);
    assert_int_equal(reconstruct_orientation(&v, &o, NULL, NULL, &d, &r, &err), STATUS_INVALID);
    assert_string_equal(err.field, OPTION_FILTER_T);
    assert_non_null(strstr(err.text, "t, 0.01, must be above half of its s"));
    assert_null(d.density);
    volume_release(&v);
}

static void assert_same(const struct cylinder_result *a, const struct cylinder_result *b)
{
    size_t n = (size_t)CYLINDER_NX * CYLINDER_NY * CYLINDER_NZ;
    assert_memory_equal(a->v.density, b->v.density, n * sizeof(float));
    assert_memory_equal(a->d.density, b->d.density, n);
    assert_memory_equal(a->d.octahedral, b->d.octahedral, 4 * n);
    assert_int_equal(a->f.n_fiber, b->f.n_fiber);
    assert_int_equal(a->f.n_vertex, b->f.n_vertex);
    assert_memory_equal(a->f.first_vertex, b->f.first_vertex, (a->f.n_fiber + 1) * sizeof *a->f.first_vertex);
    assert_memory_equal(a->f.position_m, b->f.position_m, a->f.n_vertex * 3 * sizeof(float));
    assert_memory_equal(a->f.radius_m, b->f.radius_m, a->f.n_fiber * sizeof(float));
}

static void test_threads(void **state)
{
    (void)state;
    struct cylinder_result one;
    cylinder_scan_run_axes(NULL, path, "xyz", 1, &one);
    assert_same(&one, &reference);
    cylinder_result_release(&one);
}

/* Processing in slabs of a few slices with arrays in files gives the same bits as processing in memory. The axes
 * "zxy" make it write across the slices. */
static void test_memory_limit(void **state)
{
    (void)state;
    char folder[64];
    test_make_folder(folder);
    for (int turned = 0; turned < 2; turned++) {
        struct cylinder_result free_of_limit = reference, limited;
        const char *axes = turned ? "zxy" : "xyz";
        if (turned) cylinder_scan_run_axes(NULL, path, axes, 2, &free_of_limit);
        for (size_t mib = 1; mib <= 4; mib += 3) {
            struct scratch_space *space;
            assert_int_equal(scratch_space_new(folder, mib << 20, &space, NULL), STATUS_OK);
            cylinder_scan_run_axes(space, path, axes, 2, &limited);
            assert_true(mib > 1 || scratch_file_bytes(space) > 0);
            assert_same(&free_of_limit, &limited);
            cylinder_result_release(&limited);
            scratch_space_free(space);
        }
        if (turned) cylinder_result_release(&free_of_limit);
    }
}

/* For the test of a permuted file, which must give the permuted cloth: "zxy" uses z of the file as x of the cloth. */
static bool starts_and_ends_at_faces(const struct cylinder_result *x, size_t fiber)
{
    for (int last = 0; last < 2; last++) {
        const float *p = x->f.position_m + 3 * (last ? x->f.first_vertex[fiber + 1] - 1 : x->f.first_vertex[fiber]);
        double room = INFINITY;
        for (int a = 0; a < 3; a++)
            room = fmin(room, fmin(fabs((double)p[a]), fabs((double)p[a] - (double)x->v.n[a] * 2e-6)));
        if (!(room < 0.02e-6)) return false;
    }
    return true;
}

static void test_axes(void **state)
{
    (void)state;
    const struct cylinder_result plain = reference;
    struct cylinder_result turned;
    cylinder_scan_run_axes(NULL, path, "zx-y", 2, &turned);
    assert_true(turned.v.n[0] == CYLINDER_NZ && turned.v.n[1] == CYLINDER_NX && turned.v.n[2] == CYLINDER_NY);
    for (size_t k = 0; k < CYLINDER_NZ; k += 5)
        for (size_t j = 0; j < CYLINDER_NY; j += 3)
            for (size_t i = 0; i < CYLINDER_NX; i += 7)
                assert_true(plain.v.density[volume_index(plain.v.n, i, j, k)] ==
                            turned.v.density[volume_index(turned.v.n, k, i, CYLINDER_NY - 1 - j)]);
    assert_int_equal(turned.f.n_fiber, CYLINDER_N);
    /* All fibers end where their axes meet a face, at up to 48 degrees from its normal. Axes are found to a tenth of
     * a voxel (test_chain), and so is each of the ten ends: one voxel in total. */
    print_message("length %.3f voxels, turned %.3f\n", plain.r.total_length_m / 2e-6, turned.r.total_length_m / 2e-6);
    assert_true(fabs(turned.r.total_length_m - plain.r.total_length_m) < 2e-6);
    for (size_t l = 0; l < CYLINDER_N; l++) {
        assert_true(starts_and_ends_at_faces(&plain, l));
        assert_true(starts_and_ends_at_faces(&turned, l));
    }
    cylinder_result_release(&turned);
}

static void test_cancel(void **state)
{
    (void)state;
    struct volume v;
    struct direction_volume d;
    struct reconstruct_option o = reference.o;
    struct reconstruct_report r = reference.r;
    struct error err = {0};
    atomic_bool cancel = true;
    const struct progress progress = {.cancel = &cancel};
    const char *list[1] = {path};
    assert_int_equal(reconstruct_orientation(&reference.v, &o, NULL, &progress, &d, &r, &err), STATUS_CANCELLED);
    assert_int_equal(reconstruct_read(list, 1, &o, NULL, NULL, &progress, &v, &r, &err), STATUS_CANCELLED);
}

/* Removes the folder during the search, so that no more arrays can be kept in files, as when a disk fails. */
static void remove_folder(void *context, double fraction)
{
    if (fraction > 0.85) rmdir(context);
}

static void test_first_error_is_the_one_told(void **state)
{
    (void)state;
    char folder[64];
    struct scratch_space *space;
    struct cylinder_result x;
    struct error err = {0};
    void *most_of_memory;
    const struct progress progress = {.report = remove_folder, .context = folder};
    test_make_folder(folder);
    assert_int_equal(scratch_space_new(folder, 1 << 20, &space, NULL), STATUS_OK);
    cylinder_scan_run_axes(space, path, "xyz", 2, &x);
    direction_volume_release(&x.d);
    assert_int_equal(scratch_new(space, 500000, "the rest", &most_of_memory, NULL), STATUS_OK);
    assert_int_equal(reconstruct_orientation(&x.v, &x.o, NULL, &progress, &x.d, &x.r, &err), STATUS_NOT_FOUND);
    if (strstr(err.text, "cannot keep the directions of neighbourhoods in") == NULL) fail_msg("'%s'", err.text);
    assert_null(x.d.density);
    cylinder_result_release(&x);
    scratch_space_free(space);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_chain),
                                       cmocka_unit_test(test_choices_are_reported_and_overridable),
                                       cmocka_unit_test(test_advice_to_crop_can_be_followed),
                                       cmocka_unit_test(test_filter_that_finds_nothing),
                                       cmocka_unit_test(test_threads),
                                       cmocka_unit_test(test_axes),
                                       cmocka_unit_test(test_cancel),
                                       cmocka_unit_test(test_memory_limit),
                                       cmocka_unit_test(test_first_error_is_the_one_told)};
    return cmocka_run_group_tests(tests, make_scan, release_reference);
}
