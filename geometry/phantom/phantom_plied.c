/* Yarns of several twisted plies, by the measured laws of Zhao et al. 2016 ("Fitting procedural yarn models for
 * realistic cloth rendering"): plies wind about the yarn, and fibers about their ply in an elliptic section whose
 * short axis points to the centre of the yarn (section 3.1). Fibers are distributed with the radial density p(R) =
 * (1 - 2 eps) ((e - e^R) / (e - 1))^beta + eps (section 3.2), and their R varies between rho_min R and rho_max R
 * (3.3). Hairs and loops stand out (3.4). Differences: twists are rounded so that the tile closes, fibers keep their
 * distance where the density allows, and the yarn may be scaled to the requested packing. */
#include "base/rng.h"
#include "geometry/phantom/phantom_strand.h"

#include <math.h>
#include <stdlib.h>

enum { MAX_TRY = 400, CANDIDATES = 60 };

/* Of the yarn's own lengths. */
static double plied_scale(const struct phantom_option *o, double fiber_radius_m)
{
    const struct phantom_yarn_law *y = &o->yarn;
    if (o->yarn_true_size) return 1.0;
    return fiber_radius_m * sqrt((double)y->n_fiber / (y->ellipse_m[0] * y->ellipse_m[1] * o->packing));
}

double plied_section_radius_m(const struct phantom_option *o, double fiber_radius_m)
{
    const struct phantom_yarn_law *y = &o->yarn;
    double scale = plied_scale(o, fiber_radius_m);
    if (y->n_ply == 1) return scale * sqrt(y->ellipse_m[0] * y->ellipse_m[1]) + fiber_radius_m;
    double corner = sqrt(y->ply_distance_m * y->ply_distance_m + y->ellipse_m[0] * y->ellipse_m[0]);
    return scale * fmax(corner, y->ply_distance_m + y->ellipse_m[1]) + fiber_radius_m;
}

/* A yarn scaled to its tile; lengths in metres. */
struct plied {
    const struct phantom_option *o;
    const struct yarn *path;
    struct yarn_section section;
    double scale, distance_m, ellipse_m[2], ply_turns, fiber_turns; /* ply_turns and fiber_turns per tile */
    size_t n_period;                                                /* tiles after which a ply meets itself */
};

static void lay_out(struct plied *p, const struct phantom_option *o, const struct yarn *path)
{
    const struct phantom_yarn_law *y = &o->yarn;
    *p = (struct plied){.o = o, .path = path, .scale = plied_scale(o, path->radius_m)};
    p->section = (struct yarn_section){
        .wide = sqrt(o->flatness), .high = 1.0 / sqrt(o->flatness), .length_m = yarn_length_m(path)};
    for (int k = 0; k < 2; k++) p->ellipse_m[k] = p->scale * y->ellipse_m[k];
    p->distance_m = y->n_ply > 1 ? p->scale * y->ply_distance_m : 0.0;
    double tile = p->section.length_m / p->scale;                        /* in the lengths of the file */
    long long steps = llround(tile / y->ply_pitch_m * (double)y->n_ply); /* from one ply to the next */
    p->ply_turns = (double)steps / (double)y->n_ply;
    p->n_period = y->n_ply / strand_greatest_divisor(y->n_ply, (size_t)llabs(steps));
    p->fiber_turns = round(tile / y->fiber_pitch_m * (double)p->n_period) / (double)p->n_period;
}

/* Point at distance (R, angle) from the centre of ply i, with R relative to the ellipse, s tiles along the yarn. */
static void ply_point(const struct plied *p, size_t i_ply, double s, double relative, double angle, double out[3])
{
    double ply = 2.0 * M_PI * ((double)i_ply / (double)p->o->yarn.n_ply + p->ply_turns * s);
    double own =
        angle + 2.0 * M_PI * p->fiber_turns * s - ply; /* in the frame of the ellipse, which turns with the ply */
    double inward = p->distance_m + relative * p->ellipse_m[1] * cos(own),
           beside = relative * p->ellipse_m[0] * sin(own);
    yarn_point(p->path, &p->section, s, inward * cos(ply) - beside * sin(ply), inward * sin(ply) + beside * cos(ply),
               out);
}

static double density(const struct phantom_yarn_law *y, double r)
{
    return (1.0 - 2.0 * y->epsilon) * pow(fmax(0.0, (M_E - exp(r)) / (M_E - 1.0)), y->beta) + y->epsilon;
}

/* Draws a point uniformly in the disc, and accepts it with the probability of the law. */
static void draw_place(const struct phantom_yarn_law *y, struct rng *rng, double place[2])
{
    for (int i = 0; i < MAX_TRY; i++) {
        place[0] = y->r_max * sqrt(rng_double(rng));
        place[1] = 2.0 * M_PI * rng_double(rng);
        if (rng_double(rng) * (1.0 - y->epsilon) <= density(y, place[0])) return;
    }
}

/* Of several draws, takes the first that is a diameter away from all others, or else the one farthest from them. */
static void draw_apart(const struct plied *p, double (*place)[2], size_t n, struct rng *rng)
{
    double best = -1.0, want = 2.0 * p->path->radius_m;
    for (int c = 0; c < CANDIDATES && best < want * want; c++) {
        double at[2], least = INFINITY;
        draw_place(&p->o->yarn, rng, at);
        for (size_t i = 0; i < n; i++) {
            double u = p->ellipse_m[0] * (at[0] * cos(at[1]) - place[i][0] * cos(place[i][1]));
            double v = p->ellipse_m[1] * (at[0] * sin(at[1]) - place[i][0] * sin(place[i][1]));
            least = fmin(least, u * u + v * v);
        }
        if (least <= best) continue;
        best = least;
        place[n][0] = at[0];
        place[n][1] = at[1];
    }
}

/* Adds a fiber of plies i, i + steps, ...: R varies with a whole number of waves over its period. loop_m > 0: it
 * stands out to that distance once, over a quarter of a turn. */
static status add_fiber(struct phantom_strands *s, const struct plied *p, size_t i_ply, const double place[2],
                        double loop_m, struct rng *rng, struct error *err)
{
    const struct phantom_yarn_law *y = &p->o->yarn;
    size_t per_tile = (size_t)ceil(p->section.length_m / p->path->radius_m), n = per_tile * p->n_period;
    struct strand like = {.shift = {p->path->shift[0] * (double)p->n_period, p->path->shift[1] * (double)p->n_period},
                          .n_period = p->n_period,
                          .radius_m = p->path->radius_m,
                          .axis_class = p->path->axis_class,
                          .cut = p->path->cut};
    double(*node)[3], phase = 2.0 * M_PI * rng_double(rng), loop_at = rng_double(rng);
    status st = strand_add(&s->set, &like, n, &node, err);
    if (st != STATUS_OK) return st;
    double waves = round(y->migration_waves * fabs(p->fiber_turns) * (double)p->n_period);
    double half = fmin(0.25, 0.25 * fabs(y->fiber_pitch_m) * p->scale / (p->section.length_m * (double)p->n_period));
    for (size_t k = 0; k < n; k++) {
        double w = (double)k / (double)n, r = place[0];
        r *= y->rho_min + 0.5 * (y->rho_max - y->rho_min) * (1.0 + cos(2.0 * M_PI * waves * w + phase));
        double off = (w - loop_at - rint(w - loop_at)) / half;
        double out = loop_m / sqrt(p->ellipse_m[0] * p->ellipse_m[1]);
        if (fabs(off) < 1.0 && out > r) r += (out - r) * 0.5 * (1.0 + cos(M_PI * off));
        ply_point(p, i_ply, w * (double)p->n_period, r, place[1], node[k]);
    }
    return STATUS_OK;
}

static double normal_of(struct rng *rng, const double mean_sd[2])
{
    double z[2];
    rng_normal_pair(rng, z);
    return mean_sd[0] + mean_sd[1] * z[0];
}

/* A hair starts at distance r0 from its ply and ends r0 + re away, ze along the yarn and pe around it. */
static status add_hair(struct phantom_strands *s, const struct plied *p, struct rng *rng, struct error *err)
{
    const struct phantom_yarn_law *y = &p->o->yarn;
    double mean_m = sqrt(p->ellipse_m[0] * p->ellipse_m[1]);
    double start_m = p->scale * fmax(0.0, normal_of(rng, y->hair_start_m)),
           reach_m = p->scale * fmax(0.0, normal_of(rng, y->hair_reach_m));
    double along_m = p->scale * normal_of(rng, y->hair_length_m), turn = normal_of(rng, y->hair_turn_rad);
    double from = rng_double(rng) * (double)p->n_period, angle = 2.0 * M_PI * rng_double(rng);
    size_t i_ply = (size_t)(rng_double(rng) * (double)y->n_ply) % y->n_ply;
    double length_m = sqrt(along_m * along_m + reach_m * reach_m + turn * turn * start_m * start_m);
    if (length_m < 4.0 * p->path->radius_m) return STATUS_OK;
    size_t n = (size_t)ceil(length_m / p->path->radius_m) + 2;
    struct strand like = {.radius_m = p->path->radius_m, .axis_class = p->path->axis_class, .cut = CUT_NONE};
    double(*node)[3];
    status st = strand_add(&s->set, &like, n, &node, err);
    if (st != STATUS_OK) return st;
    for (size_t k = 0; k < n; k++) {
        double w = (double)k / (double)(n - 1), at = from + w * along_m / p->section.length_m;
        ply_point(p, i_ply, at, (start_m + w * reach_m) / mean_m,
                  angle + w * turn - 2.0 * M_PI * p->fiber_turns * (at - from), node[k]);
    }
    s->plied.n_hair++;
    return STATUS_OK;
}

/* The counts follow the densities per ply in the file, scaled with the yarn. */
static size_t count_of(const struct plied *p, double per_m)
{
    return (size_t)llround(per_m * p->section.length_m / p->scale * (double)p->o->yarn.n_ply);
}

status plied_yarn_add(struct phantom_strands *s, const struct phantom_option *o, const struct yarn *path,
                      struct error *err)
{
    const struct phantom_yarn_law *y = &o->yarn;
    const struct rng_key key = {.seed = o->seed, .iteration = STREAM_YARN},
                         fly_key = {.seed = o->seed, .iteration = STREAM_FLYAWAY};
    struct plied p;
    struct rng rng;
    status st = STATUS_OK;
    lay_out(&p, o, path);
    if (!(p.section.length_m / path->radius_m * (double)p.n_period < 1e6))
        return error_set_field(err, STATUS_INVALID, "yarn",
                               "cannot make phantom: a fiber has over a million nodes; take thicker fibers");
    double(*place)[2] = calloc(y->n_fiber, sizeof *place);
    if (place == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot make phantom: out of memory");
    rng_start(&rng, &key, path->number, 0);
    size_t n_start = y->n_ply / p.n_period, n_loop = count_of(&p, y->loop_per_m), n_strand = n_start * y->n_fiber;
    for (size_t i = 0; i < n_start && st == STATUS_OK; i++)
        for (size_t k = 0; k < y->n_fiber && st == STATUS_OK; k++) {
            double loop_m = 0.0;
            size_t i_strand = i * y->n_fiber + k; /* loops are spread over the strands, at most one per strand */
            draw_apart(&p, place, k, &rng);
            if ((i_strand + 1) * n_loop / n_strand > i_strand * n_loop / n_strand) {
                loop_m = p.scale * fmax(0.0, normal_of(&rng, y->loop_radius_m));
                s->plied.n_loop++;
            }
            st = add_fiber(s, &p, i, place[k], loop_m, &rng, err);
        }
    rng_start(&rng, &fly_key, path->number, 0);
    for (size_t i = count_of(&p, y->hair_per_m); i > 0 && st == STATUS_OK; i--) st = add_hair(s, &p, &rng, err);
    free(place);
    s->plied.scale = p.scale;
    s->plied.ply_turns[path->axis_class & 1] = p.ply_turns;
    s->plied.fiber_turns[path->axis_class & 1] = p.fiber_turns;
    s->plied.wanted_ply_turns[path->axis_class & 1] = p.section.length_m / p.scale / y->ply_pitch_m;
    return st;
}
