#include "renderer/scattering/models/fur/medulla_walk.h"

#include <math.h>

/* Distance to a collision that is certain to lie within `way`; u in [0, 1). */
static double forced_flight(double depth, double way, double u) { return -log1p(u * expm1(-depth * way)) / depth; }

/* Turns d by a random angle: tan of its half is (1 - g) / (1 + g) times tan of half of a uniform angle. */
static void scatter(const struct medulla_medium *m, struct rng *r, double d[2])
{
    double t = (1 - m->g) / (1 + m->g) * tan(M_PI * ((double)rng_float(r) + 0x1p-25 - 0.5));
    double c = (1 - t * t) / (1 + t * t), s = 2 * t / (1 + t * t), x = d[0];
    d[0] = c * x - s * d[1];
    d[1] = s * x + c * d[1];
}

static double flight(const struct medulla_medium *m, struct rng *r) { return -log1p(-(double)rng_float(r)) / m->depth; }

void medulla_walk_round(const struct medulla_medium *m, double offset, int n_walk, struct rng *r, int n_turn,
                        double *turn)
{
    const double half = sqrt(1 - offset * offset);
    for (int i = 0; i < n_walk; i++) {
        double first = forced_flight(m->depth, 2 * half, (i + rng_double(r)) / n_walk);
        double p[2] = {half - first, -offset}, d[2] = {-1, 0}, way, step;
        for (;;) {
            scatter(m, r, d);
            double b = p[0] * d[0] + p[1] * d[1];
            way = -b + sqrt(fmax(b * b + 1 - p[0] * p[0] - p[1] * p[1], 0));
            step = flight(m, r);
            if (step >= way) break;
            p[0] += step * d[0];
            p[1] += step * d[1];
        }
        int bin = (int)floor(atan2(d[1], d[0]) * n_turn / (2 * M_PI) + 0.5);
        turn[(bin + n_turn) % n_turn]++;
    }
}

void medulla_walk_slab(const struct medulla_medium *m, double theta_i, int n_walk, struct rng *r, int n_theta,
                       double *half[2])
{
    const double c = cos(theta_i), s = sin(theta_i);
    for (int i = 0; i < n_walk; i++) {
        double deep = c * forced_flight(m->depth, 2 / c, (i + rng_double(r)) / n_walk);
        double d[2] = {c, -s}; /* into the slab, and along the fiber */
        for (;;) {
            scatter(m, r, d);
            deep += flight(m, r) * d[0];
            if (deep <= 0 || deep >= 2) break;
        }
        int bin = (int)((asin(fmax(-1, fmin(1, d[1]))) / M_PI + 0.5) * n_theta);
        half[deep >= 2][bin < n_theta ? bin : n_theta - 1]++;
    }
}
