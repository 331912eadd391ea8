/* The pictures of the documentation, rendered from a phantom twill.
 *
 *   documentation_pictures twill FILE.png [samples [width]] docs/images/twill.png: a warp and a weft of their own
 *                                                           colours (material groups) under a lamp and a soft sky
 *   documentation_pictures derivatives FILE.png [samples]   docs/images/derivatives.png: after figure 5.5 of the fabric
 *       thesis. Two configurations (rows); the rendering, then the derivatives by C_R, C_TT, beta_R, beta_TT, gamma_TT
 *       (columns). Grey is 0, lighter positive, darker negative; a colour parameter's channels are its own.
 */
#include "geometry/phantom/phantom.h"
#include "renderer/transport/render.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define DEG (M_PI / 180)

static status make_cloth(struct thread_pool *pool, struct scene **scene, struct error *err)
{
    struct phantom_option o;
    struct phantom_report report;
    struct fiber_set f;
    phantom_option_default(&o, PHANTOM_TWILL_2_2);
    o.n_yarn[0] = o.n_yarn[1] = 8;
    o.n_fiber_per_yarn = 61;
    o.fiber_radius_m[0] = o.fiber_radius_m[1] = 9e-6;
    o.voxel_size_m = 4e-6;
    o.vertex_spacing_m = 24e-6;
    o.twist_turns = 2;
    o.n_flyaway_per_yarn = 2;
    fiber_set_init(&f);
    status st = phantom_generate(&o, pool, NULL, &f, &report, err);
    if (st == STATUS_OK) {
        fprintf(stderr, "%zu fibers, tile %.2f mm, yarns every %.3f mm\n", f.n_fiber, 1e3 * f.tile_size_m[0],
                1e3 * report.yarn_spacing_m[0]);
        st = scene_new(&f, &(struct scene_option){.black_sheet = true, .group_by_axis_class = true}, scene, err);
    }
    fiber_set_release(&f);
    return st;
}

static status make_twill(struct thread_pool *pool, const struct scene *scene, size_t n_sample, size_t width,
                         const char *path, struct error *err)
{
    static const double param[3][9] = {
        {0.10, 0.09, 0.07, 0.95, 0.87, 0.70, 6 * DEG, 16 * DEG, 30 * DEG}, /* weft: undyed */
        {0.06, 0.08, 0.11, 0.18, 0.40, 0.76, 6 * DEG, 16 * DEG, 30 * DEG}, /* warp: blue */
        {0.10, 0.09, 0.07, 0.95, 0.87, 0.70, 6 * DEG, 16 * DEG, 30 * DEG}, /* upright fibers */
    };
    const struct configuration c = {.light_theta_rad = 52 * DEG, .light_phi_rad = 205 * DEG, .camera_theta_rad = 52 * DEG,
                                    .camera_phi_rad = 0, .cloth_rotation_rad = 28 * DEG, .light_distance_m = 0.61,
                                    .lamp_side_m = 0.6, .camera_distance_m = 0.008, .crop_m = 0.0034,
                                    .crop_aspect = 1.5, .environment_rgb = {0.12, 0.14, 0.17}};
    const struct render_request q = {.scene = scene, .model = scattering_find("two_lobe.v1"), .param = param[0],
                                     .configuration = &c, .width = width, .height = width * 2 / 3, .n_sample = n_sample, .seed = 7,
                                     .n_set = 3};
    struct image im;
    status st = render_run(&q, pool, NULL, &im, err);
    if (st == STATUS_OK) st = image_write_png(&im, 1.9, path, err);
    image_release(&im);
    return st;
}

enum { PANEL = 116, GAP = 6, N_COLUMN = 6, N_ROW = 2, WIDTH = N_COLUMN * (PANEL + GAP) - GAP, HEIGHT = N_ROW * (PANEL + GAP) - GAP };

static int by_size(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* What a pixel shows in one column, channel c: radiance, or the derivative by the parameter (of that channel). */
static double shown(const struct image *im, size_t pixel, size_t column, size_t c)
{
    static const size_t first_param[N_COLUMN] = {0, 0, 3, 6, 7, 8};
    if (column == 0) return (double)im->pixel[pixel * im->n_channel + c];
    size_t p = first_param[column] + (column <= 2 ? c : 0);
    return (double)im->pixel[pixel * im->n_channel + 6 + 3 * p + c];
}

/* The size that 97 % of the values of a column stay below. */
static double scale_of(const struct image im[N_ROW], size_t column)
{
    static double size[N_ROW * PANEL * PANEL * 3];
    size_t n = 0;
    for (size_t r = 0; r < N_ROW; r++)
        for (size_t i = 0; i < PANEL * PANEL; i++)
            for (size_t c = 0; c < 3; c++) size[n++] = fabs(shown(&im[r], i, column, c));
    qsort(size, n, sizeof *size, by_size);
    return size[n - n * 3 / 100];
}

static uint8_t byte_of(double value, double scale, bool signed_value)
{
    double v = signed_value ? 0.5 + 0.5 * tanh(value / scale) : pow(fmin(1, 0.7 * value / scale), 1 / 2.2);
    return (uint8_t)lround(255 * fmin(1, fmax(0, v)));
}

static status make_derivatives(struct thread_pool *pool, const struct scene *scene, size_t n_sample, size_t width,
                               const char *path, struct error *err)
{
    static const double param[9] = {0.25, 0.15, 0.10, 0.75, 0.55, 0.35, 8 * DEG, 22 * DEG, 30 * DEG};
    const struct configuration c[N_ROW] = {
        {.light_theta_rad = 35 * DEG, .light_phi_rad = 180 * DEG, .camera_theta_rad = 20 * DEG, .light_distance_m = 0.61,
         .lamp_side_m = 0.1, .camera_distance_m = 1, .crop_m = 0.0014},
        {.light_theta_rad = 60 * DEG, .light_phi_rad = 90 * DEG, .camera_theta_rad = 55 * DEG, .cloth_rotation_rad = 30 * DEG,
         .light_distance_m = 0.61, .lamp_side_m = 0.1, .camera_distance_m = 1, .crop_m = 0.0014},
    };
    (void)width;
    static uint8_t rgb[HEIGHT * WIDTH * 3];
    struct image im[N_ROW] = {{0}};
    status st = STATUS_OK;
    memset(rgb, 255, sizeof rgb);
    for (size_t r = 0; r < N_ROW && st == STATUS_OK; r++) {
        const struct render_request q = {.scene = scene, .model = scattering_find("two_lobe.v1"), .param = param,
                                         .configuration = &c[r], .width = PANEL, .height = PANEL, .n_sample = n_sample,
                                         .seed = 8, .stream = (uint32_t)r, .want_derivative = true};
        st = render_run(&q, pool, NULL, &im[r], err);
    }
    for (size_t column = 0; column < N_COLUMN && st == STATUS_OK; column++) {
        double scale = scale_of(im, column);
        for (size_t r = 0; r < N_ROW; r++)
            for (size_t i = 0; i < PANEL * PANEL; i++)
                for (size_t k = 0; k < 3; k++) {
                    size_t y = r * (PANEL + GAP) + i / PANEL, x = column * (PANEL + GAP) + i % PANEL;
                    rgb[3 * (y * WIDTH + x) + k] = byte_of(shown(&im[r], i, column, k), scale, column > 0);
                }
    }
    if (st == STATUS_OK) st = image_write_png_rgb8(rgb, WIDTH, HEIGHT, path, err);
    for (size_t r = 0; r < N_ROW; r++) image_release(&im[r]);
    return st;
}

int main(int argc, char **argv)
{
    bool twill = argc >= 3 && strcmp(argv[1], "twill") == 0, derivatives = argc >= 3 && strcmp(argv[1], "derivatives") == 0;
    if (!twill && !derivatives) {
        fprintf(stderr, "documentation_pictures twill|derivatives FILE.png [samples]\n");
        return 2;
    }
    size_t n_sample = argc > 3 ? strtoul(argv[3], NULL, 10) : twill ? 256 : 512;
    size_t width = argc > 4 ? strtoul(argv[4], NULL, 10) : 600;
    struct thread_pool *pool = NULL;
    struct scene *scene = NULL;
    struct error err = {0};
    status st = thread_pool_new(0, &pool, &err);
    if (st == STATUS_OK) st = make_cloth(pool, &scene, &err);
    if (st == STATUS_OK) st = (twill ? make_twill : make_derivatives)(pool, scene, n_sample, width, argv[2], &err);
    if (st != STATUS_OK) fprintf(stderr, "%s\n", err.text);
    scene_free(scene);
    thread_pool_free(pool);
    return st == STATUS_OK ? 0 : 1;
}
