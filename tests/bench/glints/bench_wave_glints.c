/* Glints by wave optics. Prints one JSON object on each line.
 *
 * bench_wave_glints [PICTURE.png]
 *   glints.wave.mean_error, glints.wave.correlation
 *       Mean over a lobe against the Fourier transform of the whole patch, and correlation of the speckle with it: the
 *       worst of eight wavelengths on bumps of 0.35 um at 8 um.
 *   glints.wave.published_mean_error, glints.wave.published_correlation
 *       The same with the published kernels.
 *   glints.wave.pruning_ratio
 *       Time of the sum over all published kernels of the window over the time of the pruned sum, one wavelength, over
 *       all directions, on a surface of 0.5 um at 20 um; .pruning_ratio_rough: of 0.35 um at 8 um.
 *   glints.wave.color_ratio, glints.wave.color_gain
 *       Time of eight wavelengths over the time of one; time of eight single ones over the time of eight at once.
 *   glints.wave.geometric_ratio
 *       Time of a color over the time of a density of glints by geometric optics.
 *   glints.wave.color_us
 *       Processor time of a color.
 *   PICTURE.png   lobes of bumps, a brushed and a scratched surface on the projected hemisphere (figure 3.23), from
 *                 -0.4 to 0.4, and nothing is measured
 */
#include "base/rng.h"
#include "renderer/glint/glint_surface.h"
#include "renderer/glint/wave_glint.h"
#include "renderer/image/image.h"
#include "tests/support/glint/wave_oracle.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

enum { N_TEXEL = 128, FINE = 8, N_QUERY = 3000, SIDE = 256 };

static void stop(const char *text)
{
    fprintf(stderr, "bench_wave_glints: %s\n", text);
    exit(1);
}

static void figure(const char *name, double value, const char *unit, const char *better)
{
    printf("{\"name\": \"glints.wave.%s\", \"value\": %.6g, \"unit\": \"%s\", \"better\": \"%s\"}\n", name, value, unit,
           better);
    fflush(stdout);
}

static struct wave_glint_option option_of(double rms_um, double length_um, bool is_published)
{
    struct wave_glint_option o = wave_glint_option_usual();
    o.height.rms_um = rms_um;
    o.height.length_um[0] = o.height.length_um[1] = length_um;
    o.is_published = is_published;
    return o;
}

static struct wave_glint *glint_of(const struct wave_glint_option *o)
{
    struct wave_glint *g = NULL;
    struct error err = {0};
    if (wave_glint_new(o, &g, &err) != STATUS_OK) stop(err.text);
    return g;
}

static void unit(float d[3], double x, double y)
{
    d[0] = (float)x;
    d[1] = (float)y;
    d[2] = (float)sqrt(fmax(1 - x * x - y * y, 0));
}

/* Mean and correlation of the lobe of perpendicular light; figure 2.5 of the source gives ohs cos_o / cos_i. */
static void lobe(struct wave_glint_option o, float um, double *mean_error, double *correlation)
{
    o.height.n = N_TEXEL;
    o.model = WAVE_OHS;
    struct wave_height h;
    struct wave_oracle oracle;
    struct error err = {0};
    struct wave_glint *g = glint_of(&o);
    struct wave_glint_query q = {{64, 64}, {0, 0, 1}, {0}};
    const struct wave_oracle_window w = {{64, 64}, o.coherence_um};
    double n = 0, a = 0, b = 0, aa = 0, bb = 0, ab = 0;
    if (wave_height_init(&h, &o.height, &err) != STATUS_OK) stop(err.text);
    wave_oracle_init(&oracle, &h, FINE);
    double *power = malloc(oracle.n * oracle.n * sizeof *power);
    if (power == NULL) stop("out of memory");
    wave_oracle_lobe(&oracle, &w, 2, (double)um, power);
    const double step = (double)um / N_TEXEL, area = M_PI * o.coherence_um * o.coherence_um * (1 - exp(-9));
    const int most = (int)(0.9 / step);
    for (int j = -most; j <= most; j += 4)
        for (int i = -most; i <= most; i += 4) {
            float f;
            if (hypot(i, j) > most) continue;
            unit(q.wo, i * step, j * step);
            wave_glint_value(g, &q, &um, 1, true, &f);
            const size_t at =
                (size_t)(j + (int)oracle.n) % oracle.n * oracle.n + (size_t)(i + (int)oracle.n) % oracle.n;
            const double got = (double)f, want = (double)q.wo[2] / ((double)um * (double)um * area) * power[at];
            n++;
            a += got;
            b += want;
            aa += got * got;
            bb += want * want;
            ab += got * want;
        }
    *mean_error = fabs(a / b - 1);
    *correlation = (ab - a * b / n) / sqrt((aa - a * a / n) * (bb - b * b / n));
    free(power);
    wave_oracle_release(&oracle);
    wave_height_release(&h);
    wave_glint_free(g);
}

static void accuracy(bool is_published)
{
    float um[WAVE_N_COLOR], weight[WAVE_N_COLOR][3];
    double worst = 0, least = 1;
    wave_glint_colors(um, weight);
    for (int i = 0; i < WAVE_N_COLOR; i++) {
        double mean_error, correlation;
        lobe(option_of(0.35, 8, is_published), um[i], &mean_error, &correlation);
        worst = fmax(worst, mean_error);
        least = fmin(least, correlation);
    }
    figure(is_published ? "published_mean_error" : "mean_error", worst, "1", "lower");
    figure(is_published ? "published_correlation" : "correlation", least, "1", "higher");
}

/* Seconds of a query at n wavelengths (0: a color), over directions in the disk of this radius about the mirror's. */
static double seconds(const struct wave_glint *g, const float *um, size_t n, bool is_pruned, double radius)
{
    const struct rng_key key = {3, 0, 0, 0};
    struct rng rng;
    struct wave_glint_query q = {{0}, {0, 0, 1}, {0}};
    rng_start(&rng, &key, 0, 0);
    double sum = 0;
    const clock_t start = clock();
    for (int k = 0; k < N_QUERY; k++) {
        const double r = radius * sqrt(rng_double(&rng)), turn = 2 * M_PI * rng_double(&rng);
        float f[WAVE_N_COLOR];
        for (int d = 0; d < 2; d++) q.center_um[d] = 1000 * rng_double(&rng);
        unit(q.wo, r * cos(turn), r * sin(turn));
        if (n == 0)
            wave_glint_rgb(g, &q, METAL_SILVER, f);
        else
            wave_glint_value(g, &q, um, n, is_pruned, f);
        sum += (double)f[0];
    }
    if (!(sum == sum)) stop("not a number");
    return (double)(clock() - start) / CLOCKS_PER_SEC / N_QUERY;
}

static double pruning_ratio(double rms_um, double length_um)
{
    const struct wave_glint_option ours = option_of(rms_um, length_um, false), all = option_of(rms_um, length_um, true);
    struct wave_glint *a = glint_of(&ours), *b = glint_of(&all);
    const float um = 0.5F;
    const double ratio = seconds(b, &um, 1, false, 1) / seconds(a, &um, 1, true, 1);
    wave_glint_free(a);
    wave_glint_free(b);
    return ratio;
}

/* Seconds of a density by geometric optics, on bumps of the same slope and a footprint as the window. */
static double geometric_seconds(void)
{
    const struct glint_option o = {GLINT_NOISE, .seed = 1, .slope = 2 * 0.35F / 8, .length_um = {8, 8}};
    struct glint_surface *s = NULL;
    struct error err = {0};
    const struct rng_key key = {3, 0, 0, 0};
    struct rng rng;
    double sum = 0;
    if (glint_surface_new(&o, &s, &err) != STATUS_OK) stop(err.text);
    rng_start(&rng, &key, 0, 0);
    const clock_t start = clock();
    for (int k = 0; k < 20 * N_QUERY; k++) {
        const double r = 0.1 * sqrt(rng_double(&rng)), turn = 2 * M_PI * rng_double(&rng);
        const float half[2] = {(float)(r * cos(turn)), (float)(r * sin(turn))};
        const struct glint_footprint at = {{500 * rng_float(&rng), 500 * rng_float(&rng)}, {50, 0, 50}};
        sum += (double)glint_density(s, &at, half);
    }
    if (!(sum > 0)) stop("no density");
    const double s_each = (double)(clock() - start) / CLOCKS_PER_SEC / (20 * N_QUERY);
    glint_surface_free(s);
    return s_each;
}

static void speed(void)
{
    float um[WAVE_N_COLOR], weight[WAVE_N_COLOR][3];
    const struct wave_glint_option o = option_of(0.35, 8, false);
    struct wave_glint *g = glint_of(&o);
    wave_glint_colors(um, weight);
    figure("pruning_ratio", pruning_ratio(0.5, 20), "1", "higher");
    figure("pruning_ratio_rough", pruning_ratio(0.35, 8), "1", "higher");
    double one = 0, singles = 0;
    for (int i = 0; i < WAVE_N_COLOR; i++) singles += seconds(g, um + i, 1, true, 0.2);
    one = singles / WAVE_N_COLOR;
    const double eight = seconds(g, um, WAVE_N_COLOR, true, 0.2), color = seconds(g, NULL, 0, true, 0.2);
    figure("color_ratio", eight / one, "1", "lower");
    figure("color_gain", singles / eight, "1", "higher");
    figure("geometric_ratio", color / geometric_seconds(), "1", "lower");
    figure("color_us", 1e6 * color, "us", "lower");
    wave_glint_free(g);
}

static void picture(const char *path)
{
    struct wave_glint_option o[3] = {option_of(0.35, 8, false), option_of(0.25, 5, false), option_of(0.1, 12, false)};
    struct image im;
    struct error err = {0};
    o[1].height.length_um[1] = 120;
    o[2].height.n_scratch = 400;
    o[2].height.scratch_depth_um = 0.4;
    o[2].height.scratch_width_um = 2;
    if (image_init(&im, (size_t)3 * SIDE, SIDE, 3, &err) != STATUS_OK) stop(err.text);
    for (int s = 0; s < 3; s++) {
        struct wave_glint *g = glint_of(&o[s]);
        struct wave_glint_query q = {{300, 300}, {0, 0, 1}, {0}};
        for (int j = 0; j < SIDE; j++)
            for (int i = 0; i < SIDE; i++) {
                unit(q.wo, 0.4 * (2.0 * i / SIDE - 1), 0.4 * (1 - 2.0 * j / SIDE));
                wave_glint_rgb(g, &q, METAL_ALUMINIUM, im.pixel + 3 * ((size_t)j * 3 * SIDE + (size_t)(s * SIDE + i)));
            }
        wave_glint_free(g);
    }
    if (image_write_png(&im, 0.04, path, &err) != STATUS_OK) stop(err.text);
    image_release(&im);
}

int main(int argc, char **argv)
{
    if (argc > 1) {
        picture(argv[1]);
        return 0;
    }
    accuracy(false);
    accuracy(true);
    speed();
    return 0;
}
