/* Detection of a weave in drawn pictures with known drafts, of the averaged repeat's lattice, and of the lack of
 * one. */
#include "geometry/weave/weave_detect.h"
#include "tests/support/weave/drawn_weave.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static const struct drawn_weave base = {.rows = "#./.#",
                                        .spacing_px = {9.0, 7.5},
                                        .cover = 0.9,
                                        .warp_rgb = {0.6, 0.5, 0.4},
                                        .weft_rgb = {0.3, 0.3, 0.35},
                                        .unevenness = 0.05,
                                        .noise = 0.1,
                                        .gradient = 1.0,
                                        .seed = 1,
                                        .edge_px = 256};

static void detect(const struct drawn_weave *w, struct weave_guess *g)
{
    struct error err = {0};
    float *rgb = drawn_weave_picture(w);
    const struct weave_picture picture = {rgb, w->edge_px, w->edge_px};
    status s = weave_detect(&picture, g, &err);
    free(rgb);
    assert_string_equal(err.text, "");
    assert_int_equal(s, STATUS_OK);
}

static struct weave_draft draft_of(const char *rows)
{
    struct weave_draft d = {.score = 0.0};
    size_t size[2];
    drawn_weave_size(rows, size);
    d.n_warp = size[0];
    d.n_weft = size[1];
    for (size_t j = 0; j < size[1]; j++)
        for (size_t i = 0; i < size[0]; i++) d.warp_on_top[j * size[0] + i] = rows[j * (size[0] + 1) + i] == '#';
    return d;
}

static void assert_detected(const struct drawn_weave *w, const char *name)
{
    struct weave_guess g;
    struct weave_draft truth = draft_of(w->rows);
    char found[32];
    detect(w, &g);
    weave_draft_name(&g.draft, found, sizeof found);
    assert_string_equal(found, name);
    assert_true(weave_draft_same(&g.draft, &truth));
    for (int a = 0; a < 2; a++) assert_true(fabs(g.spacing_px[a] / w->spacing_px[a] - 1.0) < 0.02);
    assert_true(fabs(g.direction_deg[0] - 90.0 - w->rotation_deg) < 1.0);
    assert_true(fabs(g.direction_deg[1] - w->rotation_deg) < 1.0);
    assert_true(g.yarns_confidence > 0.5 && g.yarns_confidence <= 1.0);
    assert_true(g.draft_confidence > 0.5 && g.draft_confidence <= g.yarns_confidence);
}

static void drafts_are_found(void **state)
{
    (void)state;
    static const struct {
        const char *rows, *name;
    } weave[] = {{"#./.#", "plain"},
                 {"##../.##./..##/#..#", "twill 2/2"},
                 {"###./##.#/#.##/.###", "twill 3/1"},
                 {"#../.#./..#", "twill 1/2"},
                 {"####./##.##/.####/###.#/#.###", "satin 5"},
                 {"##../##../..##/..##", "basket 2/2"}};
    for (size_t i = 0; i < sizeof weave / sizeof *weave; i++) {
        struct drawn_weave w = base;
        w.rows = weave[i].rows;
        w.seed = i + 1;
        assert_detected(&w, weave[i].name);
    }
}

static void turned_cloth_is_found(void **state)
{
    (void)state;
    struct drawn_weave w = base;
    w.rows = "###./.###/#.##/##.#";
    for (w.rotation_deg = -30.0; w.rotation_deg < 40.0; w.rotation_deg += 22.0) assert_detected(&w, "twill 3/1");
}

/* A lamp at one side, an object in the corner, noise of a third of the brightness: and the draft comes out the same. */
static void bad_light_does_no_harm(void **state)
{
    (void)state;
    struct drawn_weave w = base;
    w.rows = "##../.##./..##/#..#";
    w.gradient = 5.0;
    w.noise = 0.3;
    w.dark_corner_px = 60.0;
    assert_detected(&w, "twill 2/2");
}

static void large_photographs_are_shrunk(void **state)
{
    (void)state;
    struct drawn_weave w = base;
    w.edge_px = 1100;
    w.spacing_px[0] = 50.0;
    w.spacing_px[1] = 42.0;
    assert_detected(&w, "plain");
}

static void colors_and_width_are_found(void **state)
{
    (void)state;
    struct weave_guess g;
    struct drawn_weave w = base;
    w.spacing_px[0] = 14.0;
    w.spacing_px[1] = 16.0;
    w.gradient = 0.0;
    w.edge_px = 512;
    w.rows = "#../.#./..#";
    detect(&w, &g);
    assert_true(g.color_confidence > 0.8 && g.cover_confidence > 0.5);
    for (int c = 0; c < 3; c++) {
        double wanted = w.warp_rgb[c] / w.weft_rgb[c], found = g.warp.rgb[c] / g.weft.rgb[c];
        assert_true(fabs(found / wanted - 1.0) < 0.15);
    }
    w.rows = "#./.#";
    for (w.cover = 0.65; w.cover < 1.0; w.cover += 0.25) {
        detect(&w, &g);
        for (int a = 0; a < 2; a++) assert_true(fabs(g.cover[a] - w.cover) < 0.15);
    }
}

static void fill_noise(float *rgb, size_t n, uint64_t seed)
{
    for (size_t i = 0; i < n; i++) {
        seed = seed * 6364136223846793005u + 1442695040888963407u;
        float v = (float)(seed >> 40) / 16777216.0f;
        for (size_t c = 0; c < 3; c++) rgb[3 * i + c] = 0.5f + 0.3f * v;
    }
}

static void assert_no_weave(const float *rgb, size_t edge_px, const char *text)
{
    struct error err = {0};
    struct weave_guess g;
    const struct weave_picture picture = {rgb, edge_px, edge_px};
    assert_int_equal(weave_detect(&picture, &g, &err), STATUS_NOT_FOUND);
    assert_non_null(strstr(err.text, text));
}

static void pictures_without_texture_are_named(void **state)
{
    (void)state;
    enum { EDGE = 256, N = EDGE * EDGE };
    static float rgb[3 * N];
    for (uint64_t seed = 1; seed < 6; seed++) {
        fill_noise(rgb, N, seed);
        assert_no_weave(rgb, EDGE, "no texture that repeats in two directions");
    }
    for (size_t i = 0; i < 3 * N; i++) rgb[i] = 0.4f; /* one color */
    assert_no_weave(rgb, EDGE, "no texture");
    fill_noise(rgb, N, 7); /* stripes repeat in one direction only */
    for (size_t i = 0; i < 3 * N; i++) rgb[i] *= 1.0f + 0.5f * sinf((float)(i / 3 % EDGE) * 0.7f);
    assert_no_weave(rgb, EDGE, "no texture that repeats in two directions");
}

/* A picture that repeats but is no cloth: spots at random places of a tile of 24 x 20 pixels. */
static void fill_spots(float *rgb, size_t edge_px, uint64_t seed)
{
    enum { WIDE = 24, HIGH = 20, SPOTS = 7 };
    double at[SPOTS][2];
    for (size_t s = 0; s < SPOTS; s++)
        for (size_t a = 0; a < 2; a++) {
            seed = seed * 6364136223846793005u + 1442695040888963407u;
            at[s][a] = (double)(seed >> 40) / 16777216.0 * (a == 0 ? WIDE : HIGH);
        }
    for (size_t i = 0; i < edge_px * edge_px; i++) {
        double light = 0.2;
        for (size_t s = 0; s < SPOTS; s++) {
            double x = remainder((double)(i % edge_px) - at[s][0], WIDE);
            double y = remainder((double)(i / edge_px) - at[s][1], HIGH);
            light += 0.5 * exp(-0.5 * (x * x + y * y) / 4.0);
        }
        for (size_t c = 0; c < 3; c++) rgb[3 * i + c] = (float)light;
    }
}

/* Some draft is the best for any texture that repeats. If its drawing does not resemble the picture, it is no certain
 * one. */
static void what_is_no_cloth_is_not_certain(void **state)
{
    (void)state;
    enum { EDGE = 256 };
    static float rgb[3 * EDGE * EDGE];
    const struct weave_picture picture = {rgb, EDGE, EDGE};
    size_t n_found = 0;
    for (uint64_t seed = 1; seed <= 4; seed++) {
        struct weave_guess g;
        fill_spots(rgb, EDGE, seed);
        if (weave_detect(&picture, &g, NULL) != STATUS_OK) continue;
        n_found++;
        print_message("%g %g residual %g\n", g.yarns_confidence, g.draft_confidence, g.draft.residual);
        assert_true(g.draft_confidence < 0.7);
    }
    assert_true(n_found >= 3);
}

static void small_pictures_are_refused(void **state)
{
    (void)state;
    static float rgb[3 * 63 * 100];
    struct error err = {0};
    struct weave_guess g;
    const struct weave_picture picture = {rgb, 100, 63};
    assert_int_equal(weave_detect(&picture, &g, &err), STATUS_INVALID);
    assert_non_null(strstr(err.text, "100 x 63"));
}

/* Peaks of a known lattice with another peak that does not belong to it. */
static void lattice_follows_from_peaks(void **state)
{
    (void)state;
    static const double a[2] = {0.11, 0.02}, b[2] = {-0.03, 0.16};
    struct weave_peak peak[8];
    struct weave_lattice lattice[WEAVE_LATTICE_MAX];
    struct error err = {0};
    size_t n = 0, n_lattice;
    for (int i = 0; i < 3; i++)
        for (int k = i == 0 ? 1 : 0; k < 3; k++, n += n < 8)
            if (n < 7)
                peak[n] =
                    (struct weave_peak){.f = {i * a[0] + k * b[0], i * a[1] + k * b[1]}, .power = 100.0 / (i + k)};
    peak[7] = (struct weave_peak){.f = {0.213, 0.077}, .power = 20.0};
    assert_int_equal(weave_find_lattices(peak, 8, 1.0 / 512, lattice, &n_lattice, &err), STATUS_OK);
    assert_int_equal(lattice[0].n_peak, 7);
    assert_true(fabs(fabs(lattice[0].f[0][0]) - a[0]) < 1e-3 && fabs(fabs(lattice[0].f[0][1]) - a[1]) < 1e-3);
    for (int i = 0; i < 2; i++)
        for (int k = 0; k < 2; k++) {
            const double *f = lattice[0].f[i], *shift = lattice[0].shift_px[k];
            assert_true(fabs(f[0] * shift[0] + f[1] * shift[1] - (i == k)) < 1e-9);
        }
    assert_int_equal(weave_find_lattices(peak, 1, 1.0 / 512, lattice, &n_lattice, &err), STATUS_NOT_FOUND);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(drafts_are_found),
        cmocka_unit_test(turned_cloth_is_found),
        cmocka_unit_test(bad_light_does_no_harm),
        cmocka_unit_test(large_photographs_are_shrunk),
        cmocka_unit_test(colors_and_width_are_found),
        cmocka_unit_test(pictures_without_texture_are_named),
        cmocka_unit_test(what_is_no_cloth_is_not_certain),
        cmocka_unit_test(small_pictures_are_refused),
        cmocka_unit_test(lattice_follows_from_peaks),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
