/* The pictures of the documentation, rendered from a phantom twill.
 *
 *   documentation_pictures twill FILE.png [samples [width]]
 *       docs/images/twill.png: warp and weft of different colours (material groups) under a lamp and a soft sky.
 *   documentation_pictures derivatives FILE.png [samples]
 *       docs/images/derivatives.png, after figure 5.5 of the fabric thesis. The rows are two configurations. The
 *       columns are the rendering and its derivatives by C_R, C_TT, beta_R, beta_TT, gamma_TT, as means of the
 *       channels. For a colour, each channel is differentiated by its own component. White is 0. The scale of a
 *       column ends at the value below which 97 % of its pixels lie.
 */
#include "base/angle.h"
#include "geometry/phantom/phantom.h"
#include "renderer/estimate/render.h"
#include "tests/support/tiny_text.h"
#include "tests/support/tracer/trace_input.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

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
        memcpy(f.group, f.axis_class, f.n_fiber);
        st = scene_new(&f, &(struct scene_option){.black_sheet = true}, scene, err);
    }
    fiber_set_release(&f);
    return st;
}

static status make_twill(struct thread_pool *pool, const struct scene *scene, size_t n_sample, size_t width,
                         const char *path, struct error *err)
{
    static const double param[3][9] = {
        {0.10, 0.09, 0.07, 0.95, 0.87, 0.70, 6 * RAD_PER_DEG, 16 * RAD_PER_DEG, 30 * RAD_PER_DEG}, /* weft: undyed */
        {0.06, 0.08, 0.11, 0.18, 0.40, 0.76, 6 * RAD_PER_DEG, 16 * RAD_PER_DEG, 30 * RAD_PER_DEG}, /* warp: blue */
        {0.10, 0.09, 0.07, 0.95, 0.87, 0.70, 6 * RAD_PER_DEG, 16 * RAD_PER_DEG, 30 * RAD_PER_DEG}, /* upright fibers */
    };
    const struct configuration c = {.light_theta_rad = 52 * RAD_PER_DEG,
                                    .light_phi_rad = 205 * RAD_PER_DEG,
                                    .camera_theta_rad = 52 * RAD_PER_DEG,
                                    .camera_phi_rad = 0,
                                    .cloth_rotation_rad = 28 * RAD_PER_DEG,
                                    .light_distance_m = 0.61,
                                    .lamp_side_m = 0.6,
                                    .camera_distance_m = 0.008,
                                    .crop_m = 0.0034,
                                    .crop_aspect = 1.5,
                                    .environment_rgb = {0.12, 0.14, 0.17}};
    struct appearance model;
    struct render_request q = {.input = trace_input_surface(scene, scattering_find("two_lobe.v1"), param[0], &model),
                               .configuration = &c,
                               .width = width,
                               .height = width * 2 / 3,
                               .n_sample = n_sample,
                               .seed = 7};
    q.input.n_set = 3;
    struct image im;
    status st = render_run(&q, pool, NULL, &im, err);
    if (st == STATUS_OK) st = image_write_png(&im, 1.9, path, err);
    image_release(&im);
    return st;
}

enum {
    PANEL = 128,
    GAP = 8,
    N_COLUMN = 6,
    N_ROW = 2,
    TITLE = 24, /* height of the names above the panels and of the scales below */
    SCALE_BAR = 8,
    WIDTH = N_COLUMN * (PANEL + GAP) - GAP,
    BELOW = TITLE + N_ROW * (PANEL + GAP),
    HEIGHT = BELOW + SCALE_BAR + 24
};

static const struct {
    const char *name, *unit;
    size_t first_param;
    bool colour;
} column_of[N_COLUMN] = {{"rendering", "", 0, true},   {"C_R", "", 0, true},          {"C_TT", "", 3, true},
                         {"beta_R", "/deg", 6, false}, {"beta_TT", "/deg", 7, false}, {"gamma_TT", "/deg", 8, false}};

static int by_size(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* The value of a pixel in a column of derivatives, in file units. */
static double derivative(const struct image *im, size_t pixel, size_t column)
{
    double sum = 0;
    for (size_t c = 0; c < 3; c++) {
        size_t p = column_of[column].first_param + (column_of[column].colour ? c : 0);
        sum += (double)im->pixel[pixel * im->n_channel + 6 + 3 * p + c];
    }
    return sum / 3 * (column_of[column].colour ? 1 : RAD_PER_DEG);
}

/* The absolute value below which 97 % of the values of a column lie, rounded up to two digits. */
static double scale_of(const struct image im[N_ROW], size_t column)
{
    static double size[N_ROW * PANEL * PANEL];
    size_t n = 0;
    for (size_t r = 0; r < N_ROW; r++)
        for (size_t i = 0; i < PANEL * PANEL; i++) size[n++] = fabs(derivative(&im[r], i, column));
    qsort(size, n, sizeof *size, by_size);
    double digit = pow(10, floor(log10(size[n - n * 3 / 100])) - 1);
    return ceil(size[n - n * 3 / 100] / digit) * digit;
}

/* Maps -1 to blue, 0 to white and 1 to red. */
static void paint(double value, uint8_t *rgb)
{
    static const double end[2][3] = {{0.02, 0.19, 0.38}, {0.40, 0.0, 0.12}},
                        middle[2][3] = {{0.26, 0.58, 0.76}, {0.84, 0.38, 0.30}};
    double v = fmin(1, fabs(value)), t = v < 0.5 ? 2 * v : 2 * v - 1;
    for (int k = 0; k < 3; k++) {
        double far = end[value > 0][k], half = middle[value > 0][k];
        rgb[k] = (uint8_t)lround(255 * (v < 0.5 ? 1 + t * (half - 1) : half + t * (far - half)));
    }
}

static void draw_scale(uint8_t *rgb, size_t x0, double scale, const char *unit)
{
    char text[3][32];
    for (size_t y = BELOW; y < BELOW + SCALE_BAR; y++)
        for (size_t x = 0; x < PANEL; x++) paint(2.0 * (double)x / (PANEL - 1) - 1, rgb + 3 * (y * WIDTH + x0 + x));
    snprintf(text[0], sizeof text[0], "-%.2g", scale);
    snprintf(text[1], sizeof text[1], "0");
    snprintf(text[2], sizeof text[2], "%.2g", scale);
    for (size_t k = 0; k < 3; k++)
        tiny_text_draw(rgb, WIDTH, HEIGHT, x0 + k * (PANEL - tiny_text_width(text[k], 1)) / 2, BELOW + SCALE_BAR + 4, 1,
                       text[k]);
    tiny_text_draw(rgb, WIDTH, HEIGHT, x0 + (PANEL - tiny_text_width(unit, 1)) / 2, BELOW + SCALE_BAR + 15, 1, unit);
}

static void draw_column(uint8_t *rgb, const struct image im[N_ROW], size_t column)
{
    size_t x0 = column * (PANEL + GAP);
    const char *name = column_of[column].name;
    double scale = column > 0 ? scale_of(im, column) : 1;
    tiny_text_draw(rgb, WIDTH, HEIGHT, x0 + (PANEL - tiny_text_width(name, 2)) / 2, 4, 2, name);
    for (size_t r = 0; r < N_ROW; r++)
        for (size_t i = 0; i < PANEL * PANEL; i++) {
            uint8_t *out = rgb + 3 * ((TITLE + r * (PANEL + GAP) + i / PANEL) * WIDTH + x0 + i % PANEL);
            const float *radiance = im[r].pixel + i * im[r].n_channel;
            for (size_t k = 0; k < 3 && column == 0; k++)
                out[k] = (uint8_t)lround(255 * pow(fmin(1, 1.8 * fmax(0, (double)radiance[k])), 1 / 2.2));
            if (column > 0) paint(derivative(&im[r], i, column) / scale, out);
        }
    if (column > 0) draw_scale(rgb, x0, scale, column_of[column].unit);
}

static status make_derivatives(struct thread_pool *pool, const struct scene *scene, size_t n_sample, size_t width,
                               const char *path, struct error *err)
{
    static const double param[9] = {
        0.25, 0.15, 0.10, 0.75, 0.55, 0.35, 8 * RAD_PER_DEG, 22 * RAD_PER_DEG, 30 * RAD_PER_DEG};
    const struct configuration c[N_ROW] = {
        {.light_theta_rad = 35 * RAD_PER_DEG,
         .light_phi_rad = 180 * RAD_PER_DEG,
         .camera_theta_rad = 20 * RAD_PER_DEG,
         .light_distance_m = 0.61,
         .lamp_side_m = 0.1,
         .camera_distance_m = 1,
         .crop_m = 0.0014},
        {.light_theta_rad = 60 * RAD_PER_DEG,
         .light_phi_rad = 90 * RAD_PER_DEG,
         .camera_theta_rad = 55 * RAD_PER_DEG,
         .cloth_rotation_rad = 30 * RAD_PER_DEG,
         .light_distance_m = 0.61,
         .lamp_side_m = 0.1,
         .camera_distance_m = 1,
         .crop_m = 0.0014},
    };
    (void)width;
    static uint8_t rgb[HEIGHT * WIDTH * 3];
    struct image im[N_ROW] = {{0}};
    status st = STATUS_OK;
    memset(rgb, 255, sizeof rgb);
    for (size_t r = 0; r < N_ROW && st == STATUS_OK; r++) {
        struct appearance model;
        struct render_request q = {.input = trace_input_surface(scene, scattering_find("two_lobe.v1"), param, &model),
                                   .configuration = &c[r],
                                   .width = PANEL,
                                   .height = PANEL,
                                   .n_sample = n_sample,
                                   .seed = 8,
                                   .stream = (uint32_t)r};
        q.input.want_derivative = true;
        st = render_run(&q, pool, NULL, &im[r], err);
    }
    for (size_t column = 0; column < N_COLUMN && st == STATUS_OK; column++) draw_column(rgb, im, column);
    if (st == STATUS_OK) st = image_write_png_rgb8(rgb, WIDTH, HEIGHT, path, err);
    for (size_t r = 0; r < N_ROW; r++) image_release(&im[r]);
    return st;
}

int main(int argc, char **argv)
{
    bool twill = argc >= 3 && strcmp(argv[1], "twill") == 0,
         derivatives = argc >= 3 && strcmp(argv[1], "derivatives") == 0;
    if (!twill && !derivatives) {
        fprintf(stderr, "documentation_pictures twill|derivatives FILE.png [samples]\n");
        return 2;
    }
    size_t n_sample = argc > 3 ? strtoul(argv[3], NULL, 10) : 256;
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
