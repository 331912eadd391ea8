/* Sheared filtering of previews: rays and time that other ways take for the same error. On folds of cloth and on a
 * drape over a ball, both with a matte appearance, 128 x 128 pixels. Prints one JSON object on each line, and tables to
 * standard error.
 *
 *   sheared.<effect>.rms         Folds: root mean square error of 3 x 3 rays a pixel in four passes, over the mean.
 *   sheared.<effect>.raw_ratio   Folds: rays of pixels without a filter, and sheared.<effect>.axis_ratio of the
 *                                axis-aligned filter, for the error of four passes with 3 x 3 rays, over 9; the most
 *                                rays that were tried over 9 where they do not reach it.
 *   sheared.time_ratio_<cloth>_<effect>_<way>
 *                                Processor seconds of a way (raw, axis, whole) over the seconds of the four passes with
 *                                3 x 3 rays, at their error. Seconds count the rays and the filter of one effect; where
 *                                the error is not reached, with the most rays that were tried.
 *   sheared.passes_speedup       Folds: processor seconds of the whole sum over the four passes, both for 4 x 4 rays of
 *                                the lamp.
 *
 * effect: shadow (radiance of the lamp's light), bounce (irradiance of other folds), lens.
 *
 * The reference is the mean of TRUTH_SEEDS pictures of 8 x 8 rays without a filter. Their scatter gives its variance,
 * which is taken off squared errors. Where it is not 0, pixels are noisy: penumbrae.
 */
#include "base/process.h"
#include "renderer/mesh/mesh_drape.h"
#include "renderer/preview/proxy/proxy_layers.h"
#include "tests/support/cloth/proxy_cloth.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Without a filter there are means of up to 1 + MOST_RAW pictures of 8 x 8 rays. */
enum { EDGE = 128, N = 3 * EDGE * EDGE, TRUTH_SEEDS = 8, MOST_SIDE = 8, MOST_RAW = 3, N_STEP = MOST_SIDE + MOST_RAW };
enum { N_EFFECT = 3, N_WAY = 4, SIDE = 3, WHOLE_SIDE = 4 };
static const char *const effect[N_EFFECT] = {"shadow", "bounce", "lens"};
static const enum ray_filter_way way[N_WAY] = {RAY_OWN, RAY_AXIS, RAY_WHOLE, RAY_PASSES};
static const char *const way_name[N_WAY] = {"raw", "axis", "whole", "passes"};

struct step {
    double rays, error, inside, outside, seconds;
};

struct measured {
    int n_step;
    struct step step[N_STEP];
};

static float value[N_EFFECT][N], pooled[N_EFFECT][N];
static double truth[N_EFFECT][N], truth_var[N_EFFECT][N];

static void check(status s, const struct error *err)
{
    if (s == STATUS_OK) return;
    fprintf(stderr, "%s\n", err->text);
    exit(1);
}

/* Writes all layers, and adds the processor seconds of each. */
static void make_all(const struct proxy_request *q, double seconds[N_EFFECT])
{
    struct proxy_surface s;
    struct proxy_layers l;
    struct error err = {0};
    double at[N_EFFECT + 1];
    check(proxy_surface_init(&s, q, &err), &err);
    check(proxy_layers_init(&s, NULL, NULL, &l, &err), &err);
    at[0] = process_use().cpu_s;
    check(proxy_shadow_make(&s, NULL, NULL, &l, &err), &err);
    at[1] = process_use().cpu_s;
    check(proxy_bounce_make(&s, NULL, NULL, &l, &err), &err);
    at[2] = process_use().cpu_s;
    check(proxy_lens_make(&s, &l, NULL, NULL, value[2], &err), &err);
    at[3] = process_use().cpu_s;
    for (int k = 0; k < N_EFFECT; k++) seconds[k] += at[k + 1] - at[k];
    for (size_t i = 0; i < N / 3; i++) {
        double direct[3] = {0, 0, 0};
        if (l.receiver[i].used) proxy_surface_direct(&s, &l.place[i], direct);
        for (size_t k = 0; k < 3; k++) {
            value[0][3 * i + k] = l.visible[3 * i + k] * (float)direct[k];
            value[1][3 * i + k] = l.bounce[3 * i + k];
        }
    }
    proxy_layers_release(&l);
}

static void make_truth(struct proxy_request q)
{
    double unused[N_EFFECT] = {0};
    q.n_side = MOST_SIDE;
    q.way = RAY_OWN;
    memset(truth, 0, sizeof truth);
    memset(truth_var, 0, sizeof truth_var);
    for (int seed = 0; seed < TRUTH_SEEDS; seed++) {
        q.seed = 100 + (uint64_t)seed;
        make_all(&q, unused);
        for (int k = 0; k < N_EFFECT; k++)
            for (size_t i = 0; i < N; i++) {
                const double v = (double)value[k][i], from = v - truth[k][i];
                truth[k][i] += from / (seed + 1);
                truth_var[k][i] += from * (v - truth[k][i]);
            }
    }
    for (int k = 0; k < N_EFFECT; k++)
        for (size_t i = 0; i < N; i++) truth_var[k][i] /= (double)TRUTH_SEEDS * (TRUTH_SEEDS - 1);
}

/* Errors over the mean of the picture: of all pixels, of noisy ones, and of the others. */
static void errors_of(int k, const float *v, struct step *to)
{
    double sum[2] = {0, 0}, n[2] = {1e-9, 1e-9}, mean = 0;
    for (size_t i = 0; i < N; i++) mean += truth[k][i] / N;
    for (size_t i = 0; i < N; i++) {
        const int noisy = truth_var[k][i] > 1e-10 * mean * mean;
        sum[noisy] += pow((double)v[i] - truth[k][i], 2) - truth_var[k][i];
        n[noisy]++;
    }
    to->error = sqrt(fmax(sum[0] + sum[1], 0) / N) / mean;
    to->inside = sqrt(fmax(sum[1], 0) / n[1]) / mean;
    to->outside = sqrt(fmax(sum[0], 0) / n[0]) / mean;
}

/* Measures a way with 1 to MOST_SIDE squared rays, and without a filter with means of several pictures, too. */
static void measure(struct proxy_request q, enum ray_filter_way w, int most_side, struct measured m[N_EFFECT])
{
    double pool_s[N_EFFECT] = {0};
    q.way = w;
    for (int step = 0; step < (w == RAY_OWN ? N_STEP : most_side); step++) {
        const int n_pool = step < MOST_SIDE ? 1 : step - MOST_SIDE + 2;
        double seconds[N_EFFECT] = {0};
        q.n_side = step < MOST_SIDE ? (size_t)step + 1 : MOST_SIDE;
        q.seed = 4 + (uint64_t)n_pool;
        make_all(&q, seconds);
        for (int k = 0; k < N_EFFECT; k++) {
            struct step *to = &m[k].step[step];
            pool_s[k] = n_pool == 1 ? seconds[k] : pool_s[k] + seconds[k];
            for (size_t i = 0; i < N; i++)
                pooled[k][i] = n_pool == 1 ? value[k][i] : pooled[k][i] + (value[k][i] - pooled[k][i]) / (float)n_pool;
            *to = (struct step){.rays = (double)(q.n_side * q.n_side) * n_pool, .seconds = pool_s[k]};
            errors_of(k, pooled[k], to);
            m[k].n_step = step + 1;
        }
    }
}

/* Rays and seconds for an error, between the steps as powers of it; of the last step where none reaches it. */
static void reach(const struct measured *m, double error, double *rays, double *seconds)
{
    const struct step *last = &m->step[m->n_step - 1];
    *rays = last->rays;
    *seconds = last->seconds;
    for (int i = 0; i < m->n_step; i++) {
        const struct step *s = &m->step[i];
        if (s->error > error) continue;
        const double part = i > 0 ? log(error / s[-1].error) / log(s->error / s[-1].error) : 1;
        *rays = i > 0 ? s[-1].rays * pow(s->rays / s[-1].rays, part) : s->rays;
        *seconds = i > 0 ? s[-1].seconds * pow(s->seconds / s[-1].seconds, part) : s->seconds;
        return;
    }
}

static void print(const char *name, double v, const char *unit, const char *better)
{
    printf("{\"name\": \"sheared.%s\", \"value\": %.4g, \"unit\": \"%s\", \"better\": \"%s\"}\n", name, v, unit,
           better);
}

static void print_rays(struct measured m[N_WAY][N_EFFECT])
{
    for (int k = 0; k < N_EFFECT; k++) {
        const double error = m[3][k].step[SIDE - 1].error;
        char name[64];
        snprintf(name, sizeof name, "%s.rms", effect[k]);
        print(name, error, "relative", "lower");
        for (int w = 0; w < 2; w++) {
            double rays, seconds;
            reach(&m[w][k], error, &rays, &seconds);
            snprintf(name, sizeof name, "%s.%s_ratio", effect[k], way_name[w]);
            print(name, rays / (SIDE * SIDE), "ratio", "higher");
        }
    }
}

static void print_times(const char *cloth, struct measured m[N_WAY][N_EFFECT])
{
    for (int k = 0; k < N_EFFECT; k++)
        for (int w = 0; w < N_WAY - 1; w++) {
            const struct step *passes = &m[3][k].step[SIDE - 1];
            double rays, seconds;
            char name[64];
            reach(&m[w][k], passes->error, &rays, &seconds);
            snprintf(name, sizeof name, "time_ratio_%s_%s_%s", cloth, effect[k], way_name[w]);
            print(name, seconds / passes->seconds, "ratio", "higher");
        }
}

static void measure_all(const struct proxy_request *q, const char *cloth, struct measured m[N_WAY][N_EFFECT])
{
    memset(m, 0, N_WAY * sizeof *m);
    make_truth(*q);
    for (int w = 0; w < N_WAY; w++) measure(*q, way[w], way[w] == RAY_WHOLE ? WHOLE_SIDE : MOST_SIDE, m[w]);
    for (int k = 0; k < N_EFFECT; k++)
        for (int w = 0; w < N_WAY; w++)
            for (int i = 0; i < m[w][k].n_step; i++) {
                const struct step *s = &m[w][k].step[i];
                fprintf(stderr, "%s %s %-6s %3.0f rays: error %.4f, of noisy pixels %.4f, of others %.4f, %.3f s\n",
                        cloth, effect[k], way_name[w], s->rays, s->error, s->inside, s->outside, s->seconds);
            }
}

static void drape(struct proxy_cloth *c)
{
    struct mesh m = {0};
    struct error err = {0};
    scene_free(c->bent);
    check(mesh_drape(60, 15, NULL, &m, &err), &err);
    check(scene_bend(c->flat.scene, &m, false, &c->bent, &err), &err);
    mesh_release(&m);
    c->q.scene = c->bent;
    c->view.light_theta_rad = c->view.camera_theta_rad = 0.9;
    c->view.light_phi_rad = 2.5;
    c->view.crop_m = 0.065;
}

int main(void)
{
    struct proxy_cloth c;
    static struct measured m[N_WAY][N_EFFECT];
    for (int folds = 0; folds < 2; folds++) {
        proxy_cloth_init(&c, true);
        c.view.aperture_m = 0.02;
        c.q.width = c.q.height = EDGE;
        if (!folds) drape(&c);
        measure_all(&c.q, folds ? "folds" : "drape", m);
        print_times(folds ? "folds" : "drape", m);
        proxy_cloth_release(&c);
    }
    print_rays(m);
    const double rays_s = m[0][0].step[WHOLE_SIDE - 1].seconds;
    print("passes_speedup",
          (m[2][0].step[WHOLE_SIDE - 1].seconds - rays_s) / (m[3][0].step[WHOLE_SIDE - 1].seconds - rays_s), "ratio",
          "higher");
    return 0;
}
