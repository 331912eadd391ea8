/* Sizes of textures, and the smoothing of a tile: noise, the mean, and what the maps explain. */
#include "base/rng.h"
#include "optimizer/report/textures/texture_smooth.h"
#include "optimizer/report/textures/texture_tile.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>

#include <cmocka.h>

enum { EDGE = 64 };

static void whole_repeats_come_nearest(void **unused)
{
    (void)unused;
    const double tile[2] = {1.4, 0.7};
    struct texture_size s = texture_size_of(tile, 20.0, 2048);
    assert_true(s.repeat[0] == 14 && s.repeat[1] == 29);
    /* the longer side, 20.3 mm, has the pixels: 2048 / 20.3 mm, whole ones on a tile */
    assert_true(s.tile_px[0] == 141 && s.tile_px[1] == 70);
    s = texture_size_of(tile, 200.0, 4096);
    assert_true(s.repeat[0] == 143 && s.repeat[1] == 286 && s.repeat[0] * s.tile_px[0] <= 4096);
    assert_true(s.tile_px[0] == 28 && s.tile_px[1] == 14);
    /* more tiles than pixels: two pixels a tile, and as many tiles as there is room for */
    s = texture_size_of(tile, 200.0, 100);
    assert_true(s.repeat[0] == 50 && s.repeat[1] == 50 && s.tile_px[0] == 2 && s.tile_px[1] == 2);
    /* a tile that is larger than the texture stands alone */
    s = texture_size_of((const double[2]){60.0, 30.0}, 20.0, 4096);
    assert_true(s.repeat[0] == 1 && s.repeat[1] == 1 && s.tile_px[0] == 1024);
}

static void make_maps(struct texture_maps *m)
{
    const size_t n = EDGE * EDGE;
    *m = (struct texture_maps){.width = EDGE, .height = EDGE, .pixel_mm = {0.01, 0.01}, .repeat = {1, 1}};
    m->height_mm = calloc(n, sizeof *m->height_mm);
    m->fiber_normal = calloc(3 * n, sizeof *m->fiber_normal);
    m->cover = calloc(n, sizeof *m->cover);
    assert_true(m->height_mm && m->fiber_normal && m->cover);
    for (size_t i = 0; i < n; i++) {
        m->height_mm[i] = -0.02f + 0.02f * (float)(i % 4 == 0); /* fibers of four pixels along y */
        m->fiber_normal[3 * i + 2] = 1.0f;
        m->cover[i] = 1.0f;
    }
}

/* Light that follows the fibers' heights with a slow change across the tile, and noise of 20 %. */
static void smoothing_takes_the_noise_and_keeps_fibers(void **unused)
{
    (void)unused;
    struct texture_maps m;
    struct image half[2], out;
    double noise_before, noise, off = 0.0, mean = 0.0, brightest = 0.0, darkest = 1.0;
    make_maps(&m);
    assert_int_equal(image_init(&out, EDGE, EDGE, 3, NULL), STATUS_OK);
    for (size_t h = 0; h < 2; h++) {
        struct rng rng;
        assert_int_equal(image_init(&half[h], EDGE, EDGE, 3, NULL), STATUS_OK);
        rng_start(&rng, &(struct rng_key){.seed = 7 + h}, 0, 0);
        for (size_t i = 0; i < 3 * EDGE * EDGE; i++) {
            const double light =
                0.3 + 0.1 * sin(2.0 * M_PI * (double)(i / 3 % EDGE) / EDGE) + 5.0 * (double)m.height_mm[i / 3];
            half[h].pixel[i] = (float)(light + 0.2 * ((double)rng_float(&rng) - 0.5));
        }
    }
    assert_int_equal(texture_smooth(&m, half, 0.0, &out, &noise_before, NULL), STATUS_OK);
    assert_int_equal(texture_smooth(&m, half, 0.04, &out, &noise, NULL), STATUS_OK);
    for (size_t i = 0; i < 3 * EDGE * EDGE; i++) {
        const double light =
            0.3 + 0.1 * sin(2.0 * M_PI * (double)(i / 3 % EDGE) / EDGE) + 5.0 * (double)m.height_mm[i / 3];
        off += pow((double)out.pixel[i] - light, 2.0) / (3.0 * EDGE * EDGE);
        mean += (double)out.pixel[i] / (3.0 * EDGE * EDGE);
    }
    for (size_t x = 0; x < 4; x++) { /* a fiber and its neighbours in the middle of the tile */
        const double value = (double)out.pixel[3 * (EDGE / 2 * EDGE + EDGE / 2 + x)];
        brightest = fmax(brightest, value), darkest = fmin(darkest, value);
    }
    assert_true(noise_before > 0.1 && noise < 0.25 * noise_before);
    assert_true(sqrt(off) < 0.012 && fabs(mean - 0.225) < 0.004);
    assert_true(brightest - darkest > 0.08);
    image_release(&half[0]), image_release(&half[1]), image_release(&out);
    texture_maps_release(&m);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(whole_repeats_come_nearest),
        cmocka_unit_test(smoothing_takes_the_noise_and_keeps_fibers),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
