/* Glints by geometric optics: Gaussian elements against a histogram of samples and against triangles. Prints one JSON
 * object on each line. Times are processor seconds of one thread for a picture of D with SIDE x SIDE normals, under a
 * footprint of 4 texels a standard deviation on noise of 12 texels, sigma_r 0.005. Errors are root mean squares over
 * the picture's, against 32 triangles a texel.
 *
 * bench_glint_elements [PICTURE.png]
 *   glints.error_at_equal_time   error of elements (half a texel) over the noise of a histogram made in the same time
 *   glints.binning_ratio         time of a histogram with the error of the elements over the time of the elements
 *   glints.element_error, glints.element_error_texel, glints.two_triangle_error
 *       error of elements at half a texel and at one texel, and of 2 triangles a texel
 *   glints.triangle_ratio, glints.two_triangle_ratio
 *       time of 32 and of 2 triangles a texel over the time of elements (published, figure 3.13: 130 and 12)
 *   glints.picture_ratio         the same of 32 triangles for a picture of a lit cylinder (published, figure 3.14: 32)
 *   glints.density_us.{small,medium,large}, glints.sample_us
 *       time of one density under footprints of 2, 12 and 100 texels at other places each, and of a sample under 12
 *   PICTURE.png   D of six surfaces under three footprints, and nothing is measured
 */
#include "base/rng.h"
#include "renderer/glint/glint_surface.h"
#include "renderer/glint/glint_triangles.h"
#include "renderer/image/image.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

enum { SIDE = 48, N_VALUE = SIDE * SIDE, CYLINDER = 24 };
#define EDGE 0.2 /* the picture shows normals of [-EDGE, EDGE]^2 */

static const struct glint_option surface_option = {.seed = 1, .n_texel = 256, .step_texel = 0.5F};
static const struct glint_footprint footprint = {{100, 60}, {16, 0, 16}};

static double now_s(void)
{
    struct timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static void stop(const char *text)
{
    fprintf(stderr, "bench_glint_elements: %s\n", text);
    exit(1);
}

static void figure(const char *name, double value, const char *unit, const char *better)
{
    printf("{\"name\": \"glints.%s\", \"value\": %.6g, \"unit\": \"%s\", \"better\": \"%s\"}\n", name, value, unit,
           better);
    fflush(stdout);
}

static struct glint_surface *surface_of(const struct glint_option *o)
{
    struct glint_surface *s = NULL;
    struct error err;
    if (glint_surface_new(o, &s, &err) != STATUS_OK) stop(err.text);
    return s;
}

static void normal_of(int k, float half[2])
{
    half[0] = (float)((k % SIDE + 0.5) / SIDE * 2 * EDGE - EDGE);
    half[1] = (float)((k / SIDE + 0.5) / SIDE * 2 * EDGE - EDGE);
}

/* Pictures of D; return processor seconds. */
static double element_picture(const struct glint_surface *s, double value[N_VALUE])
{
    const int n_pass = 20;
    const double start = now_s();
    for (int pass = 0; pass < n_pass; pass++)
        for (int k = 0; k < N_VALUE; k++) {
            float half[2];
            normal_of(k, half);
            value[k] = (double)glint_density(s, &footprint, half);
        }
    return (now_s() - start) / n_pass;
}

static double triangle_picture(const struct glint_triangles *t, double value[N_VALUE])
{
    const double start = now_s();
    for (int k = 0; k < N_VALUE; k++) {
        float half[2];
        normal_of(k, half);
        value[k] = glint_triangles_density(t, &footprint, half);
    }
    return now_s() - start;
}

/* Densities in the picture's pixels, from n samples of the map. */
static double histogram_picture(const struct glint_map *m, double roughness, int n, uint32_t seed,
                                double value[N_VALUE])
{
    const struct rng_key key = {.seed = seed};
    const double start = now_s(), width = 2 * EDGE / SIDE;
    struct rng r;
    rng_start(&r, &key, 0, 0);
    memset(value, 0, N_VALUE * sizeof *value);
    for (int i = 0; i < n; i++) {
        double z[2], noise[2], place[2];
        float normal[2];
        int at[2];
        rng_normal_pair(&r, z);
        rng_normal_pair(&r, noise);
        for (int a = 0; a < 2; a++)
            place[a] = (double)footprint.center_um[a] + sqrt((double)footprint.covariance_um2[2 * a]) * z[a];
        glint_map_at(m, place, normal, NULL);
        for (int a = 0; a < 2; a++) at[a] = (int)floor(((double)normal[a] + roughness * noise[a] + EDGE) / width);
        if (at[0] >= 0 && at[1] >= 0 && at[0] < SIDE && at[1] < SIDE) value[at[1] * SIDE + at[0]]++;
    }
    for (int k = 0; k < N_VALUE; k++) value[k] /= n * width * width;
    return now_s() - start;
}

static double difference(const double a[N_VALUE], const double b[N_VALUE])
{
    double square = 0;
    for (int k = 0; k < N_VALUE; k++) square += (a[k] - b[k]) * (a[k] - b[k]) / N_VALUE;
    return sqrt(square);
}

/* A cylinder of 24 x 24 pixels of 8 um under one lamp: at each pixel, one footprint and one half vector. */
static void cylinder_pixel(int k, struct glint_footprint *f, float half[2])
{
    *f = (struct glint_footprint){{(float)(k % CYLINDER) * 8, (float)(k / CYLINDER) * 8}, {16, 0, 16}};
    half[0] = ((float)(k % CYLINDER) / CYLINDER - 0.5F) * 0.4F;
    half[1] = 0.02F;
}

static double picture_ratio(const struct glint_surface *s, const struct glint_triangles *t)
{
    struct glint_footprint f;
    float half[2];
    double sum = 0, start = now_s();
    for (int k = 0; k < CYLINDER * CYLINDER; k++) {
        cylinder_pixel(k, &f, half);
        sum += glint_triangles_density(t, &f, half);
    }
    const double triangles_s = now_s() - start;
    start = now_s();
    for (int k = 0; k < 50 * CYLINDER * CYLINDER; k++) {
        cylinder_pixel(k % (CYLINDER * CYLINDER), &f, half);
        sum += (double)glint_density(s, &f, half);
    }
    if (!(sum > 0)) stop("the cylinder is black");
    return triangles_s / ((now_s() - start) / 50);
}

static void bench_speed(void)
{
    static const char *const name[] = {"density_us.small", "density_us.medium", "density_us.large"};
    static const float sigma_um[] = {2, 12, 100};
    const struct glint_option o = {.seed = 1};
    struct glint_surface *s = surface_of(&o);
    const struct rng_key key = {.seed = 5};
    struct rng r;
    float half[2], u[GLINT_N_NUMBER];
    double sum = 0;
    const int n = 20000;
    rng_start(&r, &key, 0, 0);
    for (int k = 0; k < 4; k++) {
        const float sigma = sigma_um[k < 3 ? k : 1];
        const double start = now_s();
        for (int i = 0; i < n; i++) {
            const struct glint_footprint f = {{512 * rng_float(&r), 512 * rng_float(&r)},
                                              {sigma * sigma, 0, sigma * sigma}};
            for (int c = 0; c < GLINT_N_NUMBER; c++) u[c] = rng_float(&r);
            half[0] = 0.2F * (u[0] - 0.5F);
            half[1] = 0.2F * (u[1] - 0.5F);
            if (k < 3)
                sum += (double)glint_density(s, &f, half);
            else
                glint_sample(s, &f, u, half);
            sum += (double)half[0];
        }
        figure(k < 3 ? name[k] : "sample_us", 1e6 * (now_s() - start) / n, "us", "lower");
    }
    if (!isfinite(sum)) stop("a density is not finite");
    glint_surface_free(s);
}

static void bench_errors(void)
{
    static double right[N_VALUE], coarse[N_VALUE], elements[N_VALUE], texel[N_VALUE], bins[2][N_VALUE];
    static const double zero[N_VALUE];
    struct glint_option o;
    struct glint_map m;
    struct glint_triangles fine, two;
    if (glint_option_complete(&surface_option, &o, NULL) != STATUS_OK || glint_map_make(&o, &m, NULL) != STATUS_OK ||
        glint_triangles_make(&m, 4, o.roughness, &fine, NULL) != STATUS_OK ||
        glint_triangles_make(&m, 1, o.roughness, &two, NULL) != STATUS_OK)
        stop("out of memory");
    struct glint_surface *s = surface_of(&o);
    struct glint_option whole = o;
    whole.step_texel = 1;
    struct glint_surface *t = surface_of(&whole);
    const double fine_s = triangle_picture(&fine, right), two_s = triangle_picture(&two, coarse);
    const double elements_s = element_picture(s, elements), texel_s = element_picture(t, texel);
    const int n = 400000;
    const double bins_s = (histogram_picture(&m, (double)o.roughness, n, 1, bins[0]) +
                           histogram_picture(&m, (double)o.roughness, n, 2, bins[1])) /
                          2;
    const double unit = difference(right, zero), error = difference(elements, right) / unit;
    /* two histograms differ by sqrt(2) of the noise of one, which falls with the root of the time */
    const double noise = difference(bins[0], bins[1]) / M_SQRT2 / unit, equal_time = noise * sqrt(bins_s / elements_s);
    fprintf(
        stderr,
        "elements %.2f ms (one a texel: %.2f ms), 32 triangles %.2f s, 2 triangles %.2f s, histogram of %d %.2f s\n",
        1e3 * elements_s, 1e3 * texel_s, fine_s, two_s, n, bins_s);
    figure("error_at_equal_time", error / equal_time, "1", "lower");
    figure("binning_ratio", (equal_time / error) * (equal_time / error), "1", "higher");
    figure("element_error", error, "1", "lower");
    figure("element_error_texel", difference(texel, right) / unit, "1", "lower");
    figure("two_triangle_error", difference(coarse, right) / unit, "1", "lower");
    figure("triangle_ratio", fine_s / elements_s, "1", "higher");
    figure("two_triangle_ratio", two_s / elements_s, "1", "higher");
    figure("picture_ratio", picture_ratio(s, &fine), "1", "higher");
    glint_surface_free(s);
    glint_surface_free(t);
    glint_triangles_release(&fine);
    glint_triangles_release(&two);
    glint_map_release(&m);
}

/* D over [-0.4, 0.4]^2: a row a footprint, a column a surface. */
static void draw(const char *path)
{
    static const struct glint_option option[] = {
        {.kind = GLINT_NOISE, .step_texel = 0.5F},     {.kind = GLINT_NOISE, .length_um = {200, 6}, .step_texel = 0.5F},
        {.kind = GLINT_SCRATCHES, .step_texel = 0.5F}, {.kind = GLINT_FLAKES},
        {.kind = GLINT_NOISE, .is_plain = true},       {.kind = GLINT_NOISE, .step_texel = 2},
    };
    static const float sigma_um[] = {3, 7, 30};
    enum { N_COLUMN = sizeof option / sizeof option[0], PX = 192 };
    struct image im;
    if (image_init(&im, (size_t)N_COLUMN * PX, (size_t)3 * PX, 3, NULL) != STATUS_OK) stop("out of memory");
    for (int c = 0; c < N_COLUMN; c++) {
        struct glint_surface *s = surface_of(&option[c]);
        for (int k = 0; k < 3 * PX * PX; k++) {
            const float sigma = sigma_um[k / (PX * PX)];
            const struct glint_footprint f = {{256, 256}, {sigma * sigma, 0, sigma * sigma}};
            const float half[2] = {((float)(k % PX) / PX - 0.5F) * 0.8F, ((float)(k / PX % PX) / PX - 0.5F) * 0.8F};
            float *p = im.pixel + (size_t)(k / PX * N_COLUMN * PX + c * PX + k % PX) * 3;
            p[0] = p[1] = p[2] = 0.02F * glint_density(s, &f, half);
        }
        glint_surface_free(s);
    }
    if (image_write_png(&im, 1, path, NULL) != STATUS_OK) stop("cannot write the picture");
    image_release(&im);
}

int main(int argc, char **argv)
{
    if (argc > 1) {
        draw(argv[1]);
        return 0;
    }
    bench_errors();
    bench_speed();
    return 0;
}
