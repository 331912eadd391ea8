/* docs/images/speckle.png: fibers of a silk twill under a small lamp, without and with speckle, at the same exposure.
 *
 *   speckle_pictures FILE.png [samples]
 * Prints the mean radiance of both halves.
 */
#include "base/angle.h"
#include "geometry/phantom/phantom.h"
#include "renderer/estimate/render.h"
#include "tests/support/tracer/trace_input.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define EXPOSURE 0.5f

enum { PANEL = 200, GAP = 8, WIDTH = 2 * PANEL + GAP };

static status make_cloth(struct thread_pool *pool, struct scene **scene, struct error *err)
{
    struct phantom_option o;
    struct phantom_report report;
    struct fiber_set f;
    phantom_option_default(&o, PHANTOM_TWILL_2_2);
    o.n_yarn[0] = o.n_yarn[1] = 4;
    o.n_fiber_per_yarn = 61;
    o.fiber_radius_m[0] = o.fiber_radius_m[1] = 4.7e-6;
    o.voxel_size_m = 2e-6;
    o.vertex_spacing_m = 12e-6;
    o.twist_turns = 0.5;
    fiber_set_init(&f);
    status st = phantom_generate(&o, pool, NULL, &f, &report, err);
    if (st == STATUS_OK) st = scene_new(&f, &(struct scene_option){.black_sheet = true}, scene, err);
    fiber_set_release(&f);
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

static status draw(struct thread_pool *pool, const struct scene *scene, size_t n_sample, const char *path,
                   struct error *err)
{
    static const double param[] = {0.9, 0.85, 0.7, 8 * RAD_PER_DEG, 8 * RAD_PER_DEG};
    const struct configuration c = {.light_theta_rad = 50 * RAD_PER_DEG,
                                    .light_phi_rad = 180 * RAD_PER_DEG,
                                    .camera_theta_rad = 50 * RAD_PER_DEG,
                                    .camera_phi_rad = 0,
                                    .cloth_rotation_rad = 30 * RAD_PER_DEG,
                                    .light_distance_m = 0.61,
                                    .lamp_side_m = 0.01,
                                    .camera_distance_m = 0.008,
                                    .crop_m = 0.0008,
                                    .crop_aspect = 1};
    struct appearance model;
    struct image whole;
    status st = image_init(&whole, WIDTH, PANEL, 3, err);
    for (size_t i = 0; i < WIDTH * PANEL * 3 && st == STATUS_OK; i++) whole.pixel[i] = 1 / EXPOSURE;
    for (int half = 0; half < 2 && st == STATUS_OK; half++) {
        struct render_request q = {.input = trace_input_surface(scene, scattering_find("wave_silk.v2"), param, &model),
                                   .configuration = &c,
                                   .width = PANEL,
                                   .height = PANEL,
                                   .n_sample = n_sample,
                                   .seed = 7};
        struct image im;
        q.input.has_speckle = half == 1;
        q.input.speckle_seed = 1;
        st = render_run(&q, pool, NULL, &im, err);
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
    struct scene *scene = NULL;
    struct error err = {0};
    if (argc < 2) {
        fprintf(stderr, "speckle_pictures FILE.png [samples]\n");
        return 2;
    }
    const size_t n_sample = argc > 2 ? strtoul(argv[2], NULL, 10) : 24;
    status st = thread_pool_new(0, &pool, &err);
    if (st == STATUS_OK) st = make_cloth(pool, &scene, &err);
    if (st == STATUS_OK) st = draw(pool, scene, n_sample, argv[1], &err);
    if (st != STATUS_OK) fprintf(stderr, "%s\n", err.text);
    scene_free(scene);
    thread_pool_free(pool);
    return st == STATUS_OK ? 0 : 1;
}
