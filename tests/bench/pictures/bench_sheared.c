/* Sheared filtering of previews: rays that a pixel takes for equal errors, and time. On folds of cloth (a matte
 * appearance, 128 x 128 pixels). Prints one JSON object on each line, and the errors to standard error.
 *
 *   sheared.<effect>.rms         Root mean square error of 3 x 3 rays a pixel in four passes, over the mean.
 *   sheared.<effect>.raw_ratio   Rays of pixels without a filter, and sheared.<effect>.axis_ratio of the axis-aligned
 *                                filter, for the error of four passes with 3 x 3 rays, over 9; 64 / 9 where 8 x 8 rays
 *                                do not reach it.
 *   sheared.passes_speedup       Processor seconds of the whole sum over four passes, both for 4 x 4 rays of the lamp.
 *
 * effect: shadow (radiance of the lamp's light), bounce (irradiance of other folds), lens.
 */
#include "base/process.h"
#include "renderer/preview/proxy/proxy_layers.h"
#include "tests/support/cloth/proxy_cloth.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

enum { EDGE = 128, N = 3 * EDGE * EDGE, TRUTH_SEEDS = 12, MOST_SIDE = 8, N_EFFECT = 3 };
static const char *const effect[N_EFFECT] = {"shadow", "bounce", "lens"};
static float value[N_EFFECT][N], truth[N_EFFECT][N];

static void check(status s, const struct error *err)
{
    if (s == STATUS_OK) return;
    fprintf(stderr, "%s\n", err->text);
    exit(1);
}

static void make_all(const struct proxy_request *q)
{
    struct proxy_surface s;
    struct proxy_layers l;
    struct error err = {0};
    check(proxy_surface_init(&s, q, &err), &err);
    check(proxy_layers_init(&s, NULL, NULL, &l, &err), &err);
    check(proxy_shadow_make(&s, NULL, NULL, &l, &err), &err);
    check(proxy_bounce_make(&s, NULL, NULL, &l, &err), &err);
    check(proxy_lens_make(&s, &l, NULL, NULL, value[2], &err), &err);
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

static double error_of(int k)
{
    double sum = 0, mean = 0;
    for (size_t i = 0; i < N; i++) {
        sum += pow((double)value[k][i] - (double)truth[k][i], 2) / N;
        mean += (double)truth[k][i] / N;
    }
    return sqrt(sum) / mean;
}

/* Rays for an error, between the numbers of rays as powers of it; the most for errors that are not reached. */
static double rays_for(double error, double by_side[MOST_SIDE + 1])
{
    for (int side = 2; side <= MOST_SIDE; side++) {
        if (by_side[side] > error) continue;
        if (by_side[side - 1] <= error) return (side - 1) * (side - 1);
        const double part = log(error / by_side[side - 1]) / log(by_side[side] / by_side[side - 1]);
        return pow(side - 1 + 1e-9, 2) * pow((double)side / (side - 1), 2 * part);
    }
    return MOST_SIDE * MOST_SIDE;
}

static void print(const char *name, const char *what, double v, const char *unit, const char *better)
{
    printf("{\"name\": \"sheared.%s%s\", \"value\": %.4g, \"unit\": \"%s\", \"better\": \"%s\"}\n", name, what, v, unit,
           better);
}

static double seconds_of_shadow(struct proxy_request q, enum ray_filter_way way)
{
    struct proxy_surface s;
    struct proxy_layers l;
    struct error err = {0};
    q.way = way;
    check(proxy_surface_init(&s, &q, &err), &err);
    check(proxy_layers_init(&s, NULL, NULL, &l, &err), &err);
    const double before_s = process_use().cpu_s;
    check(proxy_shadow_make(&s, NULL, NULL, &l, &err), &err);
    proxy_layers_release(&l);
    return process_use().cpu_s - before_s;
}

int main(void)
{
    static const enum ray_filter_way way[3] = {RAY_OWN, RAY_AXIS, RAY_PASSES};
    struct proxy_cloth c;
    double error[3][N_EFFECT][MOST_SIDE + 1];
    proxy_cloth_init(&c, true);
    c.view.aperture_m = 0.02;
    c.q.width = c.q.height = EDGE;
    c.q.n_side = MOST_SIDE;
    c.q.way = RAY_OWN;
    for (int seed = 0; seed < TRUTH_SEEDS; seed++) {
        c.q.seed = 100 + (uint64_t)seed;
        make_all(&c.q);
        for (int k = 0; k < N_EFFECT; k++)
            for (size_t i = 0; i < N; i++) truth[k][i] += value[k][i] / TRUTH_SEEDS;
    }
    c.q.seed = 5;
    for (int w = 0; w < 3; w++)
        for (size_t side = 1; side <= MOST_SIDE; side++) {
            c.q.n_side = side;
            c.q.way = way[w];
            make_all(&c.q);
            for (int k = 0; k < N_EFFECT; k++) error[w][k][side] = error_of(k);
        }
    for (int k = 0; k < N_EFFECT; k++) {
        for (int side = 1; side <= MOST_SIDE; side++)
            fprintf(stderr, "%s %2d rays: own %.4f, by axes %.4f, four passes %.4f\n", effect[k], side * side,
                    error[0][k][side], error[1][k][side], error[2][k][side]);
        print(effect[k], ".rms", error[2][k][3], "relative", "lower");
        print(effect[k], ".raw_ratio", rays_for(error[2][k][3], error[0][k]) / 9, "ratio", "higher");
        print(effect[k], ".axis_ratio", rays_for(error[2][k][3], error[1][k]) / 9, "ratio", "higher");
    }
    c.q.n_side = 4;
    const double own_s = seconds_of_shadow(c.q, RAY_OWN), passes_s = seconds_of_shadow(c.q, RAY_PASSES) - own_s,
                 whole_s = seconds_of_shadow(c.q, RAY_WHOLE) - own_s;
    fprintf(stderr, "seconds: rays %.3f, four passes %.3f, whole sum %.3f, by axes %.3f\n", own_s, passes_s, whole_s,
            seconds_of_shadow(c.q, RAY_AXIS) - own_s);
    print("passes_speedup", "", whole_s / passes_s, "ratio", "higher");
    proxy_cloth_release(&c);
    return 0;
}
