/* Fibers of one yarn, on a hexagonal lattice in a flattened section, twisted about the path and migrating; and its
 * fly-aways. */
#include "base/rng.h"
#include "geometry/phantom/phantom_strand.h"

#include <math.h>
#include <stdlib.h>

enum { LATTICE_FOLD = 6, LATTICE_REACH = 40, FLYAWAY_NODES_MIN = 6 };

/* Lattice spacing in fiber radii: packing = pi r^2 / (sqrt(3)/2 d^2). */
static double lattice_spacing(double packing) { return sqrt(2.0 * M_PI / (sqrt(3.0) * packing)); }

struct orbit {
    double u, v, rho2;
};

static int by_distance(const void *a, const void *b)
{
    const struct orbit *x = a, *y = b;
    if (x->rho2 != y->rho2) return x->rho2 < y->rho2 ? -1 : 1;
    double ax = atan2(x->v, x->u), ay = atan2(y->v, y->u);
    return ax < ay ? -1 : ax > ay;
}

/* Finds the n orbits nearest to the centre of the lattice with spacing 1, with one representative of each in the
 * sector 0 <= angle < 60 degrees; the others follow by rotation. Returns the number found (n unless n is extremely
 * large). */
static size_t lattice_orbits(struct orbit *orbit, size_t n)
{
    static const double half_sqrt3 = 0.86602540378443865;
    struct orbit all[LATTICE_REACH * (LATTICE_REACH + 1) / 2 + LATTICE_REACH];
    size_t count = 0;
    for (int i = 1; i <= LATTICE_REACH; i++)
        for (int j = 0; i + j <= LATTICE_REACH; j++) {
            double u = i + 0.5 * j, v = half_sqrt3 * j;
            all[count++] = (struct orbit){u, v, round(1e6 * (u * u + v * v)) * 1e-6};
        }
    qsort(all, count, sizeof *all, by_distance);
    if (n > count) n = count;
    for (size_t i = 0; i < n; i++) orbit[i] = all[i];
    return n;
}

static size_t n_orbit_of(const struct phantom_option *o)
{
    return (o->n_fiber_per_yarn + LATTICE_FOLD - 2) / LATTICE_FOLD;
}

double yarn_section_radius_m(const struct phantom_option *o, double fiber_radius_m)
{
    if (o->yarn.n_ply > 0) return plied_section_radius_m(o, fiber_radius_m);
    size_t n = n_orbit_of(o);
    if (n == 0) return fiber_radius_m;
    struct orbit *orbit = calloc(n, sizeof *orbit);
    if (orbit == NULL) return NAN;
    size_t found = lattice_orbits(orbit, n);
    double rho = found > 0 ? sqrt(orbit[found - 1].rho2) : 0.0;
    free(orbit);
    return fiber_radius_m * (1.0 + rho * lattice_spacing(o->packing));
}

/* Point at lattice position (rho_m, angle) of the section, s tiles along the yarn. */
static void section_point(const struct yarn *y, const struct yarn_section *c, double s, double rho_m, double angle,
                          double out[3])
{
    double turned = angle + 2.0 * M_PI * c->twist_turns * s;
    yarn_point(y, c, s, rho_m * cos(turned), rho_m * sin(turned), out);
}

/* Adds the strands of one orbit of lattice points. With a rotation by k sixths per tile a fiber meets itself after 6
 * / gcd(k, 6) tiles. */
static status add_orbit(struct phantom_strands *s, const struct phantom_option *o, const struct yarn *y,
                        const struct yarn_section *c, double rho_m, double angle, struct rng *rng, struct error *err)
{
    size_t fold = rho_m > 0.0 ? LATTICE_FOLD : 1;
    size_t sixths = (size_t)llabs(llround(LATTICE_FOLD * c->twist_turns));
    size_t n_period = fold / strand_greatest_divisor(fold, sixths);
    size_t per_tile = (size_t)ceil(c->length_m / y->radius_m);
    struct strand like = {.shift = {y->shift[0] * (double)n_period, y->shift[1] * (double)n_period},
                          .n_period = n_period,
                          .radius_m = y->radius_m,
                          .axis_class = y->axis_class,
                          .cut = y->cut};
    for (size_t i = 0; i < fold / n_period; i++) {
        double(*node)[3];
        status st = strand_add(&s->set, &like, per_tile * n_period, &node, err);
        if (st != STATUS_OK) return st;
        double phase = 2.0 * M_PI * rng_double(rng);
        double waves = (double)(n_period + 1) / (double)n_period;
        for (size_t k = 0; k < per_tile * n_period; k++) {
            double at = (double)k / (double)per_tile;
            double rho = rho_m * (1.0 + o->migration * cos(2.0 * M_PI * waves * at + phase));
            section_point(y, c, at, rho, angle + 2.0 * M_PI * (double)i / LATTICE_FOLD, node[k]);
        }
    }
    return STATUS_OK;
}

/* Adds a hair that leaves the surface of the yarn and bends away from it. Its lengths relative to the yarn follow
 * the fits in Zhao et al. 2016: its reach is about half a yarn radius, with a wide spread. */
static status add_flyaway(struct phantom_strands *s, const struct yarn *y, const struct yarn_section *c,
                          double section_radius_m, struct rng *rng, struct error *err)
{
    double normal[2];
    rng_normal_pair(rng, normal);
    double reach = section_radius_m * fmax(0.25, 0.5 + 0.3 * normal[0]);
    double along = fmax(2.0, 3.0 + normal[1]) * section_radius_m / c->length_m;
    double from = rng_double(rng), angle = 2.0 * M_PI * rng_double(rng), curl = 1.5 * (rng_double(rng) - 0.5);
    double side = rng_double(rng) < 0.5 ? -1.0 : 1.0;
    size_t n = (size_t)ceil(fabs(along) * c->length_m / y->radius_m) + FLYAWAY_NODES_MIN;
    struct strand like = {.radius_m = y->radius_m, .axis_class = y->axis_class, .cut = CUT_NONE};
    double(*node)[3];
    status st = strand_add(&s->set, &like, n, &node, err);
    if (st != STATUS_OK) return st;
    for (size_t k = 0; k < n; k++) {
        double w = (double)k / (double)(n - 1);
        section_point(y, c, from + side * along * w, section_radius_m + y->radius_m + reach * w * w, angle + curl * w,
                      node[k]);
    }
    return STATUS_OK;
}

status yarn_add(struct phantom_strands *s, const struct phantom_option *o, const struct yarn *y, struct error *err)
{
    if (o->yarn.n_ply > 0) return plied_yarn_add(s, o, y, err);
    size_t n_orbit = n_orbit_of(o);
    struct orbit *orbit = calloc(n_orbit + 1, sizeof *orbit);
    if (orbit == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot make phantom: out of memory");
    n_orbit = lattice_orbits(orbit, n_orbit);
    struct yarn_section c = {.wide = sqrt(o->flatness),
                             .high = 1.0 / sqrt(o->flatness),
                             .length_m = yarn_length_m(y),
                             .twist_turns = round(LATTICE_FOLD * o->twist_turns) / LATTICE_FOLD};
    const struct rng_key key = {.seed = o->seed, .iteration = STREAM_YARN},
                         fly_key = {.seed = o->seed, .iteration = STREAM_FLYAWAY};
    struct rng rng;
    rng_start(&rng, &key, y->number, 0);
    double turn = 2.0 * M_PI * rng_double(&rng), spacing_m = y->radius_m * lattice_spacing(o->packing);
    status st = add_orbit(s, o, y, &c, 0.0, 0.0, &rng, err);
    for (size_t i = 0; i < n_orbit && st == STATUS_OK; i++)
        st = add_orbit(s, o, y, &c, spacing_m * sqrt(orbit[i].rho2), turn + atan2(orbit[i].v, orbit[i].u), &rng, err);
    rng_start(&rng, &fly_key, y->number, 0);
    for (size_t i = 0; i < o->n_flyaway_per_yarn && st == STATUS_OK; i++)
        st = add_flyaway(s, y, &c, yarn_section_radius_m(o, y->radius_m), &rng, err);
    free(orbit);
    return st;
}
