/* Phantoms: seamless tiles, fibers that do not interpenetrate, volumes with the material and the noise that were asked for. */
#include "base/angle.h"
#include "geometry/phantom/phantom.h"
#include "tests/support/scratch_folder.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <tiffio.h>

#include <cmocka.h>

static void make(const struct phantom_option *o, size_t n_thread, struct fiber_set *f, struct phantom_report *r)
{
    struct thread_pool *pool = NULL;
    struct error err = {0};
    if (n_thread > 0) assert_int_equal(thread_pool_new(n_thread, &pool, NULL), STATUS_OK);
    fiber_set_init(f);
    if (phantom_generate(o, pool, NULL, f, r, &err) != STATUS_OK) fail_msg("%s", err.text);
    thread_pool_free(pool);
}

static void test_every_weave_is_a_valid_tile(void **state)
{
    (void)state;
    for (int w = 0; w < PHANTOM_WEAVE_COUNT; w++) {
        struct phantom_option o;
        struct phantom_report r;
        struct fiber_set f;
        double low, high;
        enum phantom_weave found;
        assert_int_equal(phantom_weave_find(phantom_weave_name((enum phantom_weave)w), &found, NULL), STATUS_OK);
        assert_int_equal(found, w);
        phantom_option_default(&o, (enum phantom_weave)w);
        o.n_relax = 50; /* quicker than a good phantom */
        make(&o, 2, &f, &r);
        assert_int_equal(fiber_set_validate(&f, NULL), STATUS_OK);
        fiber_set_z_range_m(&f, &low, &high);
        assert_true(fabs(low - 4.0 * o.voxel_size_m) < 0.5 * o.voxel_size_m);
        for (int a = 0; a < 2; a++)
            assert_true(fabs((double)r.n_voxel[a] * o.voxel_size_m / f.tile_size_m[a] - 1.0) < 1e-9);
        assert_true((double)r.n_voxel[2] * o.voxel_size_m >= high + 3.9 * o.voxel_size_m);
        assert_true(r.overlap_mean < 0.03 && r.overlap_max < 0.35);
        assert_true(r.volume_fraction > 0.2 && r.volume_fraction < 0.8);
        assert_true(r.cover > 0.8);
        for (size_t i = 0; i < f.n_fiber; i++) /* smooth: vertices 1.5 voxels apart, hardly more */
            for (size_t k = f.first_vertex[i]; k + 1 < f.first_vertex[i + 1]; k++) {
                const float *p = f.position_m + 3 * k;
                double step =
                    sqrt(pow((double)(p[3] - p[0]), 2) + pow((double)(p[4] - p[1]), 2) + pow((double)(p[5] - p[2]), 2));
                assert_true(step < 2.5 * o.voxel_size_m);
            }
        fiber_set_release(&f);
    }
}

static void test_same_fibers_for_any_number_of_threads(void **state)
{
    (void)state;
    struct phantom_option o;
    struct phantom_report r;
    struct fiber_set f[3];
    phantom_option_default(&o, PHANTOM_PLAIN);
    o.n_flyaway_per_yarn = 2;
    o.n_relax = 30;
    for (size_t i = 0; i < 3; i++) make(&o, i, &f[i], &r);
    for (size_t i = 1; i < 3; i++) {
        assert_int_equal(f[i].n_vertex, f[0].n_vertex);
        assert_memory_equal(f[i].position_m, f[0].position_m, 3 * f[0].n_vertex * sizeof(float));
    }
    o.seed = 2;
    fiber_set_release(&f[2]);
    make(&o, 1, &f[2], &r);
    assert_memory_not_equal(f[2].position_m, f[0].position_m, 30 * sizeof(float));
    for (size_t i = 0; i < 3; i++) fiber_set_release(&f[i]);
}

/* Pushing apart alone leaves kinks that no fiber survives: strains of 0.51 in the plain weave, 0.46 in the velvet, 0.34 in the felt. */
static void test_no_fiber_is_bent_until_it_breaks(void **state)
{
    (void)state;
    static const struct {
        enum phantom_weave weave;
        double strain;
    } want[] = {{PHANTOM_PLAIN, 0.38}, {PHANTOM_VELVET, 0.33}, {PHANTOM_FELT, 0.28}};
    for (size_t i = 0; i < sizeof want / sizeof *want; i++) {
        struct phantom_option o;
        struct phantom_report r;
        struct fiber_set f;
        phantom_option_default(&o, want[i].weave);
        make(&o, 2, &f, &r);
        print_message("%s: strain %.3f, overlap %.4f, at most %.3f\n", phantom_weave_name(want[i].weave), r.strain_p95,
                      r.overlap_mean, r.overlap_max);
        assert_true(r.strain_p95 < want[i].strain);
        assert_true(r.overlap_mean < 0.01 && r.overlap_max < 0.1);
        fiber_set_release(&f);
    }
}

/* Distance in the other two coordinates, wrapped. */
static double apart(const struct fiber_set *f, const float *a, const float *b, size_t along)
{
    size_t across = 1 - along;
    double d = (double)a[across] - (double)b[across], tile = f->tile_size_m[across];
    return hypot(d - tile * round(d / tile), (double)a[2] - (double)b[2]);
}

/* Every fiber of a twill runs from face to face and goes on as exactly one fiber at the opposite face. */
static void test_twill_has_no_seam(void **state)
{
    (void)state;
    struct phantom_option o;
    struct phantom_report r;
    struct fiber_set f;
    phantom_option_default(&o, PHANTOM_TWILL_2_2);
    make(&o, 1, &f, &r);
    assert_int_equal(f.n_fiber, 8 * 19);
    assert_true(r.overlap_mean < 0.003 && r.overlap_max < 0.05);
    assert_true(r.cover > 0.99);
    for (size_t i = 0; i < f.n_fiber; i++) {
        size_t along = f.axis_class[i], n_next = 0;
        const float *first = f.position_m + 3 * f.first_vertex[i],
                    *last = f.position_m + 3 * (f.first_vertex[i + 1] - 1);
        assert_true(fabs((double)first[along]) < 1e-9);
        assert_true(fabs((double)last[along] - f.tile_size_m[along]) < 1e-9);
        for (size_t j = 0; j < f.n_fiber; j++)
            if (f.axis_class[j] == along && apart(&f, last, f.position_m + 3 * f.first_vertex[j], along) < 1e-9) {
                const float *next = f.position_m + 3 * f.first_vertex[j];
                double cosine = 0, a2 = 0, b2 = 0; /* and in the same direction */
                for (int k = 0; k < 3; k++) {
                    double a = (double)last[k] - (double)last[k - 3], b = (double)next[k + 3] - (double)next[k];
                    cosine += a * b;
                    a2 += a * a;
                    b2 += b * b;
                }
                assert_true(cosine / sqrt(a2 * b2) > cos(5.0 * RAD_PER_DEG));
                n_next++;
            }
        assert_int_equal(n_next, 1);
    }
    fiber_set_release(&f);
}

static void test_wrong_options_are_named(void **state)
{
    (void)state;
    struct phantom_option o;
    struct phantom_report r;
    struct fiber_set f;
    struct error err;
    enum phantom_weave w;
    fiber_set_init(&f);
    phantom_option_default(&o, PHANTOM_TWILL_2_2);
    o.n_yarn[0] = 3;
    assert_int_equal(phantom_generate(&o, NULL, NULL, &f, &r, &err), STATUS_INVALID);
    assert_string_equal(err.field, "n_yarn");
    phantom_option_default(&o, PHANTOM_TWILL_2_2);
    o.packing = (double)NAN;
    assert_int_equal(phantom_generate(&o, NULL, NULL, &f, &r, &err), STATUS_INVALID);
    assert_string_equal(err.field, "packing");
    assert_int_equal(phantom_weave_find("tweed", &w, &err), STATUS_INVALID);
    assert_non_null(strstr(err.text, "'tweed'"));
    fiber_set_release(&f);
}

/* One fiber, straight, through the whole tile of 40 voxels in an oblique direction; z in the middle of 30 voxels. */
static struct fiber_set oblique_fiber(double radius_m)
{
    struct fiber_set f;
    fiber_set_init(&f);
    assert_int_equal(fiber_set_reserve(&f, 1, 41, NULL), STATUS_OK);
    f.first_vertex[1] = 41;
    f.tile_size_m[0] = f.tile_size_m[1] = 80e-6;
    f.radius_m[0] = (float)radius_m;
    for (size_t k = 0; k <= 40; k++) {
        f.position_m[3 * k] = 2e-6f * (float)k;
        f.position_m[3 * k + 1] = 1.46e-6f * (float)k + 45.3e-6f; /* leaves through y and comes back */
        f.position_m[3 * k + 2] = 28.7e-6f + 0.11e-6f * (float)k;
    }
    return f;
}

static void test_volume_holds_the_material(void **state)
{
    (void)state;
    const size_t n[3] = {40, 40, 30};
    const double radius_voxel[] = {0.1, 0.3, 0.5, 1.0, 1.7, 3.5, 6.0};
    for (size_t i = 0; i < sizeof radius_voxel / sizeof radius_voxel[0]; i++)
        for (int blurred = 0; blurred < 2; blurred++) {
            struct fiber_set f = oblique_fiber(2e-6 * radius_voxel[i]);
            struct phantom_scan_option o;
            struct volume v;
            double sum = 0;
            phantom_scan_option_default(&o);
            o.snr = 0.0;
            o.blur_sd_voxel = blurred ? 0.9 : 0.0;
            assert_int_equal(phantom_scan(&f, n, &o, NULL, NULL, &v, NULL), STATUS_OK);
            for (size_t k = 0; k < volume_n_voxel(n); k++) {
                assert_true(v.density[k] >= 0.0f && v.density[k] <= 1.0f + 1e-5f);
                sum += (double)v.density[k];
            }
            double want = M_PI * radius_voxel[i] * radius_voxel[i] * 40.0 * sqrt(1.0 + 0.73 * 0.73 + 0.055 * 0.055);
            /* the flat ends are cut to whole voxel centres: at most half a voxel of 49 */
            if (fabs(sum / want - 1.0) >= 0.01) fail_msg("radius %g: %g of the material", radius_voxel[i], sum / want);
            volume_release(&v);
            fiber_set_release(&f);
        }
}

static void test_noise_is_as_asked(void **state)
{
    (void)state;
    const size_t n[3] = {40, 40, 60};
    struct fiber_set f = oblique_fiber(4e-6);
    struct phantom_scan_option o;
    struct volume clean, v[3];
    phantom_scan_option_default(&o);
    o.snr = 0.0;
    assert_int_equal(phantom_scan(&f, n, &o, NULL, NULL, &clean, NULL), STATUS_OK);
    o.snr = 5.0;
    for (size_t i = 0; i < 3; i++) {
        struct thread_pool *pool = NULL;
        if (i > 0) assert_int_equal(thread_pool_new(i, &pool, NULL), STATUS_OK);
        struct scratch_space *space = NULL; /* the last one in slabs of eight slices */
        if (i == 2) assert_int_equal(scratch_space_new(".", 1 << 20, &space, NULL), STATUS_OK);
        assert_int_equal(phantom_scan_in(&f, n, &o, space, pool, NULL, &v[i], NULL), STATUS_OK);
        thread_pool_free(pool);
        assert_memory_equal(v[i].density, v[0].density, volume_n_voxel(n) * sizeof(float));
        if (i == 2) volume_release(&v[2]);
        scratch_space_free(space);
    }
    double sum = 0, square = 0, count = (double)volume_n_voxel(n);
    for (size_t k = 0; k < volume_n_voxel(n); k++) {
        double d = (double)(v[0].density[k] - clean.density[k]);
        sum += d;
        square += d * d;
    }
    assert_true(fabs(sum / count) < 5.0 * 0.2 / sqrt(count));
    assert_true(fabs(square / count - 0.04) < 5.0 * 0.04 * sqrt(2.0 / count));
    for (size_t i = 0; i < 2; i++) volume_release(&v[i]);
    volume_release(&clean);
    /* Poisson: in the void a tenth of the counts, variance 0.1 / N / 0.81 */
    o.snr = 0.0;
    o.poisson_count = 400.0;
    assert_int_equal(phantom_scan(&f, n, &o, NULL, NULL, &v[0], NULL), STATUS_OK);
    square = 0;
    count = 0;
    for (size_t k = 40 * 40 * 35; k < volume_n_voxel(n); k++, count++) square += pow((double)v[0].density[k], 2);
    double want = 0.1 / 400.0 / 0.81,
           fourth = (1.0 + 3.0 * 40.0) / 40.0; /* of the fourth moment to the variance's square */
    assert_true(fabs(square / count - want) < 5.0 * want * sqrt((fourth - 1.0) / count));
    volume_release(&v[0]);
    fiber_set_release(&f);
}

static void test_rings_and_gradient(void **state)
{
    (void)state;
    const size_t n[3] = {40, 40, 30};
    struct fiber_set f = oblique_fiber(4e-6);
    struct phantom_scan_option o;
    struct volume v;
    phantom_scan_option_default(&o);
    o.snr = 0.0;
    o.ring_amplitude = 0.1;
    assert_int_equal(phantom_scan(&f, n, &o, NULL, NULL, &v, NULL), STATUS_OK);
    double square = 0;
    for (size_t k = 0; k < 1600; k++) {
        assert_true(v.density[k] == v.density[k + 1600 * 29]); /* the same in every empty slice */
        square += pow((double)v.density[k], 2);
    }
    assert_true(sqrt(square / 1600) > 0.05 && sqrt(square / 1600) < 0.15);
    volume_release(&v);
    o.ring_amplitude = 0.0;
    o.gradient = 0.5;
    o.blur_sd_voxel = 0.0;
    assert_int_equal(phantom_scan(&f, n, &o, NULL, NULL, &v, NULL), STATUS_OK);
    double highest = 0;
    for (size_t k = 0; k < volume_n_voxel(n); k++) highest = fmax(highest, (double)v.density[k]);
    assert_true(highest > 1.4 && highest < 1.5);
    volume_release(&v);
    o.blur_sd_voxel = -1.0;
    struct error err;
    assert_int_equal(phantom_scan(&f, n, &o, NULL, NULL, &v, &err), STATUS_INVALID);
    assert_string_equal(err.field, "blur_sd_voxel");
    fiber_set_release(&f);
}

static struct volume ramp_volume(void)
{
    const size_t n[3] = {5, 4, 3};
    const double size[3] = {2e-6, 2e-6, 2.5e-6};
    struct volume v;
    assert_int_equal(volume_init(&v, n, size, NULL), STATUS_OK);
    for (size_t k = 0; k < 60; k++) v.density[k] = ((float)k - 10.0f) / 20.0f; /* -0.5 .. 2.45 */
    return v;
}

static double coded(double signal, const struct phantom_file_option *o)
{
    double top = o->bits == 8 ? 255 : 65535;
    return fmin(top, fmax(0, round(o->void_value + (double)(float)signal * (o->fiber_value - o->void_value))));
}

static void test_tiff_pages(void **state)
{
    struct volume v = ramp_volume();
    const char *path = scratch_path(state, "v.tif");
    for (int bits = 8; bits <= 16; bits += 8)
        for (int deflate = 0; deflate < 2; deflate++) {
            const struct phantom_file_option o = {bits, bits == 8 ? 50 : 10000, bits == 8 ? 170 : 40000, deflate == 1};
            assert_int_equal(phantom_write_tiff(&v, &o, path, NULL), STATUS_OK);
            TIFF *t = TIFFOpen(path, "r");
            assert_non_null(t);
            assert_int_equal(TIFFNumberOfDirectories(t), 3);
            for (size_t k = 0; k < 3; k++) {
                uint8_t row[16];
                uint32_t width = 0, height = 0;
                assert_int_equal(TIFFSetDirectory(t, (tdir_t)k), 1);
                TIFFGetField(t, TIFFTAG_IMAGEWIDTH, &width);
                TIFFGetField(t, TIFFTAG_IMAGELENGTH, &height);
                assert_true(width == 5 && height == 4);
                for (uint32_t j = 0; j < 4; j++) {
                    assert_int_equal(TIFFReadScanline(t, row, j, 0), 1);
                    for (size_t i = 0; i < 5; i++) {
                        uint16_t wide;
                        memcpy(&wide, row + 2 * i, 2);
                        double got = bits == 8 ? row[i] : wide;
                        assert_true(got == coded(((double)volume_index(v.n, i, j, k) - 10.0) / 20.0, &o));
                    }
                }
            }
            TIFFClose(t);
        }
    struct error err;
    struct phantom_file_option o;
    phantom_file_option_default(&o);
    assert_int_equal(phantom_write_tiff(&v, &o, scratch_path(state, "none/v.tif"), &err), STATUS_IO);
    o.bits = 12;
    assert_int_equal(phantom_write_tiff(&v, &o, path, &err), STATUS_INVALID);
    volume_release(&v);
}

static void test_metaimage(void **state)
{
    struct volume v = ramp_volume();
    struct phantom_file_option o;
    size_t n;
    uint16_t value[60];
    phantom_file_option_default(&o);
    assert_int_equal(phantom_write_metaimage(&v, &o, scratch_path(state, "w.mhd"), NULL), STATUS_OK);
    char *header = scratch_read(scratch_path(state, "w.mhd"), NULL),
         *data = scratch_read(scratch_path(state, "w.raw"), &n);
    assert_non_null(strstr(
        header,
        "DimSize = 5 4 3\nElementSpacing = 0.002 0.002 0.0025\nElementType = MET_USHORT\nElementDataFile = w.raw\n"));
    assert_int_equal(n, sizeof value);
    memcpy(value, data, sizeof value);
    for (size_t k = 0; k < 60; k++) assert_true(value[k] == coded(((double)k - 10.0) / 20.0, &o));
    free(header);
    free(data);
    struct error err;
    assert_int_equal(phantom_write_metaimage(&v, &o, scratch_path(state, "w.tif"), &err), STATUS_INVALID);
    volume_release(&v);
}

static const char yarn_text[] = "ply_num: 3\nfiber_num: 12\naabb_min: [-1,-1,-1]\n\nyarn_clock_wise: "
                                "0\nfiber_clock_wise: 1\nyarn_alpha: 0.45\nalpha: 0.36\n"
                                "yarn_radius: 0.038\nellipse_long: 0.026\nellipse_short: 0.02\nepsilon: 0.1\nbeta: "
                                "0.2\nR_max: 1\nuse_migration: 1\ns_i: 1\n"
                                "rho_min: 0.85\nrho_max: 1\nuse_flyaways: 1\nflyaway_hair_density: "
                                "30\nflyaway_hair_ze: 0.002 0.06\nflyaway_hair_r0: 0.02 0.005\n"
                                "flyaway_hair_re: 0.016 0.009\nflyaway_hair_pe: 0.39 0.34\nflyaway_loop_density: "
                                "19\nflyaway_loop_r1: 0.025 0.005\n";

/* A yarn file to a tile: every weave of yarns, twists that close it, a seam that every cut fiber crosses. */
static void test_plied_yarns(void **state)
{
    static const enum phantom_weave weave[] = {PHANTOM_PLAIN, PHANTOM_KNIT};
    const char *path = scratch_path(state, "yarn.txt");
    scratch_write(path, yarn_text, sizeof yarn_text - 1);
    for (size_t w = 0; w < 2; w++) {
        struct phantom_option o;
        struct phantom_report r;
        struct fiber_set f;
        phantom_option_default(&o, weave[w]);
        o.flatness = 1.0;
        o.packing = 0.4;
        o.n_relax = 40;
        assert_int_equal(phantom_yarn_read(path, &o.yarn, NULL), STATUS_OK);
        assert_true(o.yarn.n_ply == 3 && o.yarn.n_fiber == 12 && o.yarn.fiber_pitch_m < 0.0 &&
                    fabs(o.yarn.ellipse_m[1] - 2e-4) < 1e-12);
        make(&o, 2, &f, &r);
        assert_int_equal(r.n_fiber_per_yarn, 36);
        assert_true(r.plied.n_hair > 0 && r.plied.n_loop > 0);
        double turns = r.plied.ply_turns[0]; /* thirds, within a sixth of the yarn's own */
        assert_true(fabs(3.0 * turns - round(3.0 * turns)) < 1e-9 &&
                    fabs(turns - r.plied.wanted_ply_turns[0]) < 1.0 / 6.0 + 1e-9);
        assert_true(turns * r.plied.fiber_turns[0] <= 0.0); /* opposite senses */
        size_t n_end[2] = {0, 0};                           /* of weft fibers at x = 0 and at x = tile */
        for (size_t i = 0; i < f.n_fiber; i++)
            for (int e = 0; e < 2; e++) {
                size_t k = e == 0 ? f.first_vertex[i] : f.first_vertex[i + 1] - 1;
                double x = (double)f.position_m[3 * k];
                n_end[0] += fabs(x) < 1e-9;
                n_end[1] += fabs(x - f.tile_size_m[0]) < 1e-9;
            }
        assert_int_equal(n_end[0], n_end[1]);
        if (weave[w] == PHANTOM_PLAIN) assert_true(n_end[0] >= o.n_yarn[0] * 36 && n_end[0] >= 72);
        assert_true(r.overlap_mean < 0.12);
        fiber_set_release(&f);
    }
}

/* Mean squared distance of the warp's fibers from the middle of their yarn, where they are cut by the face at y = 0. */
static double spread_m2(const struct fiber_set *f, double spacing_m)
{
    enum { YARN = 2 };
    double sum[YARN][2] = {{0}}, square = 0.0, count[YARN] = {0};
    for (int pass = 0; pass < 2; pass++)
        for (size_t i = 0; i < f->n_fiber; i++)
            for (int e = 0; e < 2; e++) {
                const float *p = f->position_m + 3 * (e == 0 ? f->first_vertex[i] : f->first_vertex[i + 1] - 1);
                if (f->axis_class[i] != 1 || fabs((double)p[1]) > 1e-9) continue;
                size_t yarn = (double)p[0] < spacing_m ? 0u : 1u;
                double at[2] = {(double)p[0], (double)p[2]};
                count[yarn] += pass == 0 ? 1.0 : 0.0;
                for (size_t a = 0; a < 2; a++) {
                    if (pass == 0)
                        sum[yarn][a] += at[a];
                    else
                        square += pow(at[a] - sum[yarn][a] / count[yarn], 2.0);
                }
            }
    return square / (count[0] + count[1]);
}

/* The four measured yarns, true to the file's lengths or scaled, have the designed share of fiber: that of a ply's section, in the
 * material of the tile and in how far its fibers lie apart. As designed, before fibers push each other apart. */
static void test_real_yarn_files(void **state)
{
    static const char *const name[] = {"cotton1", "polyester1", "rayon1", "silk1"};
    const char *data = getenv("SELVEDGE_DATA");
    (void)state;
    for (size_t i = 0; i < 4; i++) {
        char path[1024];
        struct phantom_yarn_law y;
        struct error err = {0};
        double packed[2];
        snprintf(path, sizeof path, "%s/yarns/%s.txt", data != NULL ? data : "../shared/data", name[i]);
        status s = phantom_yarn_read(path, &y, &err);
        if (s == STATUS_IO || s == STATUS_NOT_FOUND) {
            print_message("real data absent: %s (set SELVEDGE_DATA)\n", path);
            skip();
        }
        if (s != STATUS_OK) fail_msg("%s", err.text);
        assert_true(y.n_ply >= 2 && y.n_fiber >= 33 && y.hair_per_m > 0.0);
        y.hair_per_m = y.loop_per_m = 0.0;
        for (int true_size = 0; true_size < 2; true_size++) {
            struct phantom_option o;
            struct phantom_report r;
            struct fiber_set f;
            const double radius_m = 14e-6;
            phantom_option_default(&o, PHANTOM_PLAIN);
            for (int a = 0; a < 3; a++) o.fiber_radius_m[a] = radius_m;
            o.flatness = 1.0;
            o.packing = 0.5;
            o.n_relax = 0;
            o.vertex_spacing_m = 6e-5;
            o.yarn = y;
            o.yarn_true_size = true_size == 1;
            make(&o, 2, &f, &r);
            double section_m2 = M_PI * y.ellipse_m[0] * y.ellipse_m[1] * r.plied.scale * r.plied.scale,
                   fiber_m2 = M_PI * radius_m * radius_m;
            double design = true_size ? (double)y.n_fiber * fiber_m2 / section_m2 : o.packing, plies_m = 0.0;
            for (int a = 0; a < 2; a++)
                plies_m += 2.0 * (double)y.n_ply * r.plied.wanted_ply_turns[a] * y.ply_pitch_m * r.plied.scale;
            double share = fiber_m2 * fiber_set_length_m(&f) / (plies_m * section_m2);
            packed[true_size] =
                (double)(y.n_ply * y.n_fiber) * fiber_m2 / (M_PI * spread_m2(&f, r.yarn_spacing_m[0])) / design;
            print_message("%s%s: %.3f of a ply is fiber, designed %.3f; packed %.3f\n", name[i],
                          true_size ? ", true size" : "", share, design, packed[true_size]);
            assert_true(true_size ? r.plied.scale == 1.0 : r.plied.scale < 0.8);
            double winding = hypot(1.0, 2.0 * M_PI * y.ply_distance_m / y.ply_pitch_m * r.plied.ply_turns[0] /
                                            r.plied.wanted_ply_turns[0]);
            double excess =
                share / (design * winding); /* fibers are longer than their ply, which is longer than the yarn */
            assert_true(excess > 1.0 && excess < 1.15);
            fiber_set_release(&f);
        }
        assert_true(fabs(packed[1] / packed[0] - 1.0) <
                    0.1); /* fibers that keep a diameter from each other spread a little more */
    }
}

static void test_wrong_yarn_files(void **state)
{
    static const struct {
        const char *from, *to, *part;
    } change[] = {
        {"ply_num: 3", "ply_num: 0", "line 1: out of range: 'ply_num'"},
        {"alpha: 0.36", "alfa: 0.36", "unknown key 'alfa'"},
        {"alpha: 0.36", "", "'alpha' is missing"},
        {"beta: 0.2", "beta: nan", "a number is missing after 'beta'"},
        {"R_max: 1", "R_max: 1 2", "more than a value after 'R_max'"},
        {"0.016 0.009", "0.016 -1", "negative: 'flyaway_hair_re'"},
        {"epsilon: 0.1", "epsilon 0.1", "not 'key: value'"},
    };
    const char *path = scratch_path(state, "wrong.txt");
    for (size_t i = 0; i < sizeof change / sizeof *change; i++) {
        char text[2048];
        struct phantom_yarn_law y;
        struct error err = {0};
        const char *at = strstr(yarn_text, change[i].from);
        while (strcmp(change[i].from, "alpha: 0.36") == 0 && at[-1] != '\n') at = strstr(at + 1, change[i].from);
        int n = snprintf(text, sizeof text, "%.*s%s%s", (int)(at - yarn_text), yarn_text, change[i].to,
                         at + strlen(change[i].from));
        scratch_write(path, text, (size_t)n);
        assert_int_equal(phantom_yarn_read(path, &y, &err), STATUS_FORMAT);
        if (strstr(err.text, change[i].part) == NULL) fail_msg("'%s' is not in '%s'", change[i].part, err.text);
    }
    struct phantom_option o;
    struct phantom_report r;
    struct fiber_set f;
    struct error err = {0};
    phantom_option_default(&o, PHANTOM_FELT);
    o.yarn.n_ply = 2;
    fiber_set_init(&f);
    assert_int_equal(phantom_generate(&o, NULL, NULL, &f, &r, &err), STATUS_INVALID);
    assert_string_equal(err.field, "yarn");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_every_weave_is_a_valid_tile),
        cmocka_unit_test(test_plied_yarns),
        cmocka_unit_test(test_real_yarn_files),
        cmocka_unit_test(test_wrong_yarn_files),
        cmocka_unit_test(test_same_fibers_for_any_number_of_threads),
        cmocka_unit_test(test_no_fiber_is_bent_until_it_breaks),
        cmocka_unit_test(test_twill_has_no_seam),
        cmocka_unit_test(test_wrong_options_are_named),
        cmocka_unit_test(test_volume_holds_the_material),
        cmocka_unit_test(test_noise_is_as_asked),
        cmocka_unit_test(test_rings_and_gradient),
        cmocka_unit_test(test_tiff_pages),
        cmocka_unit_test(test_metaimage),
    };
    return cmocka_run_group_tests(tests, scratch_folder_setup, scratch_folder_teardown);
}
