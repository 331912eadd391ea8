/* Fibers without yarns: felt and the pile of a velvet. */
#include "base/rng.h"
#include "geometry/phantom/phantom_strand.h"

#include <math.h>
#include <stdlib.h>

enum { PILE_TUFT = 13, N_WINDING = 8 };

/* Number of times that a felt fiber goes around the tile in x and y before it closes: eight directions in the plane. */
static const int winding[N_WINDING][2] = {{1, 0}, {0, 1}, {1, 1}, {1, -1}, {2, 1}, {1, 2}, {2, -1}, {1, -2}};

static status add_felt_fiber(struct strand_set *s, const struct phantom_option *o, size_t i, struct error *err)
{
    const struct rng_key key = {.seed = o->seed, .iteration = STREAM_FELT};
    struct rng rng;
    rng_start(&rng, &key, (uint32_t)i, 0);
    const int *turns = winding[rng_u32(&rng) % N_WINDING];
    double r = o->fiber_radius_m[0], depth = fmax(0.0, 0.5 * o->felt_thickness_m - r);
    struct strand like = {
        .n_period = 1, .radius_m = r, .cut = CUT_FACE_XY, .axis_class = abs(turns[1]) > abs(turns[0]) ? 1 : 0};
    for (int a = 0; a < 2; a++) like.shift[a] = turns[a] * s->tile_m[a];
    double length = hypot(like.shift[0], like.shift[1]), at[2],
           side[2] = {-like.shift[1] / length, like.shift[0] / length};
    for (int a = 0; a < 2; a++) at[a] = rng_double(&rng) * s->tile_m[a];
    double level = depth * (2.0 * rng_double(&rng) - 1.0), wave[4], phase[4];
    for (int k = 0; k < 4; k++) {
        phase[k] = 2.0 * M_PI * rng_double(&rng);
        wave[k] = (k < 2 ? 0.06 * s->tile_m[0] : 0.4 * depth) * rng_double(&rng) / (1.0 + k % 2);
    }
    double(*node)[3];
    size_t n = (size_t)ceil(1.05 * length / r);
    status st = strand_add(s, &like, n, &node, err);
    if (st != STATUS_OK) return st;
    for (size_t k = 0; k < n; k++) {
        double w = (double)k / (double)n, turn = 2.0 * M_PI * w;
        double lateral = wave[0] * sin(turn + phase[0]) + wave[1] * sin(2.0 * turn + phase[1]);
        double z = level + wave[2] * sin(turn + phase[2]) + wave[3] * sin(2.0 * turn + phase[3]);
        for (int a = 0; a < 2; a++) node[k][a] = at[a] + w * like.shift[a] + lateral * side[a];
        node[k][2] = fmax(-depth, fmin(depth, z));
    }
    return STATUS_OK;
}

status felt_make(struct strand_set *s, const struct phantom_option *o, struct error *err)
{
    for (int a = 0; a < 2; a++) s->tile_m[a] = fmax(1.0, round(o->felt_tile_m / o->voxel_size_m)) * o->voxel_size_m;
    for (size_t i = 0; i < o->n_fiber_per_yarn; i++) {
        status st = add_felt_fiber(s, o, i, err);
        if (st != STATUS_OK) return st;
    }
    return STATUS_OK;
}

/* Places one tuft in each gap between four ground yarns. Its fibers spread and lean towards +y as they rise, and are
 * cut at the top. */
static status add_tuft(struct strand_set *s, const struct phantom_option *o, const double root[2], uint32_t number,
                       double ground_z_m, struct error *err)
{
    const struct rng_key key = {.seed = o->seed, .iteration = STREAM_PILE};
    struct rng rng;
    rng_start(&rng, &key, number, 0);
    double r = o->fiber_radius_m[2], golden = M_PI * (3.0 - sqrt(5.0)), turn = 2.0 * M_PI * rng_double(&rng);
    for (size_t i = 0; i < PILE_TUFT; i++) {
        double rho = 1.9 * r * sqrt((double)i), angle = turn + golden * (double)i, wobble[2];
        rng_normal_pair(&rng, wobble);
        double height = ground_z_m + o->pile_height_m * (0.9 + 0.1 * rng_double(&rng));
        double lean[2] = {0.12 * wobble[0], 0.25 + 0.12 * wobble[1]}; /* slope at the top */
        struct strand like = {.radius_m = r, .axis_class = 2, .cut = CUT_NONE};
        double(*node)[3];
        size_t n = (size_t)ceil((height + ground_z_m) / r) + 2;
        status st = strand_add(s, &like, n, &node, err);
        if (st != STATUS_OK) return st;
        for (size_t k = 0; k < n; k++) {
            double w = (double)k / (double)(n - 1), rise = w * w * height, spread = rho * (1.0 + 1.5 * w);
            node[k][0] = root[0] + spread * cos(angle) + lean[0] * rise;
            node[k][1] = root[1] + spread * sin(angle) + lean[1] * rise;
            node[k][2] = -ground_z_m + w * (height + ground_z_m);
        }
    }
    return STATUS_OK;
}

status pile_add(struct strand_set *s, const struct phantom_option *o, double ground_z_m, struct error *err)
{
    for (size_t i = 0; i < o->n_yarn[0]; i++)
        for (size_t j = 0; j < o->n_yarn[1]; j++) {
            double root[2] = {s->tile_m[0] * (double)j / (double)o->n_yarn[1],
                              s->tile_m[1] * (double)i / (double)o->n_yarn[0]};
            status st = add_tuft(s, o, root, (uint32_t)(i * o->n_yarn[1] + j), ground_z_m, err);
            if (st != STATUS_OK) return st;
        }
    return STATUS_OK;
}
