/* docs/images/wave-lame.jpg: a close view of a lame under a small lamp, its films by geometric optics and by waves.
 *
 *   wave_film_pictures FILE.png [samples]
 * Prints the mean radiance of both halves.
 */
#include "base/angle.h"
#include "geometry/cloth/cloth.h"
#include "geometry/cloth/cloth_film.h"
#include "renderer/estimate/render.h"
#include "tests/support/tracer/trace_input.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define EXPOSURE 0.08f

enum { PANEL = 160, GAP = 8, WIDTH = 2 * PANEL + GAP };

/* Dark warps of fibers over wefts that are films alone, in turn brushed silver and bumpy gold. */
static status make_cloth(enum film_optics optics, struct scene **scene, struct error *err)
{
    struct cloth_description *d = malloc(sizeof *d);
    struct film_groups films;
    struct fiber_set f;
    if (d == NULL) return error_set(err, STATUS_NO_MEMORY, "out of memory");
    fiber_set_init(&f);
    status st = cloth_description_init(d, "twill", err);
    d->n_kind = 3;
    d->kind[0].n_fiber = 9;
    d->kind[1] = d->kind[2] = d->kind[0];
    d->kind[1].film = (struct cloth_film){300, 12, 0, {{0.95f, 0.93f, 0.88f}, 0.2f, 16, FILM_NOISE, (uint32_t)optics}};
    d->kind[2].film =
        (struct cloth_film){300, 12, 0, {{0.95f, 0.75f, 0.35f}, 0.2f, 10, FILM_BRUSHED, (uint32_t)optics}};
    d->kind[1].n_fiber = d->kind[2].n_fiber = 0;
    d->n_order[CLOTH_WEFT] = 2;
    d->order[CLOTH_WEFT][0] = 1;
    d->order[CLOTH_WEFT][1] = 2;
    d->n_yarn[CLOTH_WEFT] = d->n_yarn[CLOTH_WARP] = 8;
    cloth_description_number(d);
    if (st == STATUS_OK) st = cloth_description_check(d, err);
    if (st == STATUS_OK) st = cloth_build(d, NULL, NULL, NULL, &f, NULL, err);
    if (st == STATUS_OK) {
        cloth_film_groups(d, &films);
        st = scene_new(&f, &(struct scene_option){.black_sheet = true, .films = &films}, scene, err);
    }
    fiber_set_release(&f);
    free(d);
    return st;
}

/* Places one half of the picture, and prints its mean. */
static void place(const struct image *from, size_t left, struct image *to)
{
    double sum[3] = {0};
    for (size_t y = 0; y < PANEL; y++)
        for (size_t x = 0; x < PANEL; x++)
            for (size_t c = 0; c < 3; c++) {
                const float v = from->pixel[(y * PANEL + x) * from->n_channel + c];
                to->pixel[(y * WIDTH + left + x) * 3 + c] = v;
                sum[c] += (double)v / (PANEL * PANEL);
            }
    printf("mean radiance %.5f %.5f %.5f\n", sum[0], sum[1], sum[2]);
}

static status draw(struct thread_pool *pool, size_t n_sample, const char *path, struct error *err)
{
    static const double param[] = {
        0.03, 0.02, 0.02, 0.05, 0.03, 0.06, 8 * RAD_PER_DEG, 14 * RAD_PER_DEG, 20 * RAD_PER_DEG};
    const struct configuration c = {.light_theta_rad = 25 * RAD_PER_DEG,
                                    .light_phi_rad = 160 * RAD_PER_DEG,
                                    .camera_theta_rad = 25 * RAD_PER_DEG,
                                    .camera_phi_rad = -10 * RAD_PER_DEG,
                                    .cloth_rotation_rad = 25 * RAD_PER_DEG,
                                    .light_distance_m = 0.61,
                                    .lamp_side_m = 0.01,
                                    .camera_distance_m = 0.05,
                                    .crop_m = 0.0015,
                                    .crop_aspect = 1,
                                    .environment_rgb = {0.02, 0.02, 0.02}};
    struct appearance model;
    struct image whole;
    status st = image_init(&whole, WIDTH, PANEL, 3, err);
    for (size_t i = 0; i < WIDTH * PANEL * 3 && st == STATUS_OK; i++) whole.pixel[i] = 1 / EXPOSURE;
    for (int half = 0; half < 2 && st == STATUS_OK; half++) {
        struct scene *scene = NULL;
        struct image im;
        st = make_cloth(half == 0 ? FILM_RAYS : FILM_R_GHS, &scene, err);
        if (st != STATUS_OK) break;
        struct render_request q = {.input = trace_input_surface(scene, scattering_find("two_lobe.v1"), param, &model),
                                   .configuration = &c,
                                   .width = PANEL,
                                   .height = PANEL,
                                   .n_sample = n_sample,
                                   .seed = 7};
        st = render_run(&q, pool, NULL, &im, err);
        scene_free(scene);
        if (st != STATUS_OK) break;
        place(&im, half == 0 ? 0 : PANEL + GAP, &whole);
        image_release(&im);
    }
    if (st == STATUS_OK) st = image_write_png(&whole, EXPOSURE, path, err);
    image_release(&whole);
    return st;
}

int main(int argc, char **argv)
{
    struct thread_pool *pool = NULL;
    struct error err = {0};
    if (argc < 2) {
        fprintf(stderr, "wave_film_pictures FILE.png [samples]\n");
        return 2;
    }
    const size_t n_sample = argc > 2 ? strtoul(argv[2], NULL, 10) : 4;
    status st = thread_pool_new(0, &pool, &err);
    if (st == STATUS_OK) st = draw(pool, n_sample, argv[1], &err);
    if (st != STATUS_OK) fprintf(stderr, "%s\n", err.text);
    thread_pool_free(pool);
    return st == STATUS_OK ? 0 : 1;
}
