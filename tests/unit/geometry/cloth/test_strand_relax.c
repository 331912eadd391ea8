/* The grid behind strand_relax finds all fibers that a fiber touches: overlaps against those of all pairs of nodes. */
#include "base/rng.h"
#include "geometry/cloth/strand.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>

#include <cmocka.h>

enum { N_STRAND = 60, N_NODE = 12 };
static const double radius_m = 5e-6;

/* Straight strands at random places and in random directions. Some begin outside of the tile, and some are thinner. */
static void scatter(struct strand_set *s, double tile_m, double height_m, uint64_t seed)
{
    const struct rng_key key = {.seed = seed};
    struct rng rng;
    *s = (struct strand_set){.tile_m = {tile_m, 1.3 * tile_m}};
    rng_start(&rng, &key, 0, 0);
    for (size_t i = 0; i < N_STRAND; i++) {
        const struct strand like = {.radius_m = (0.5 + 0.5 * rng_double(&rng)) * radius_m};
        double(*node)[3], turn = 2.0 * M_PI * rng_double(&rng), rise = 0.4 * rng_double(&rng) - 0.2;
        double from[3] = {(3.0 * rng_double(&rng) - 1.0) * tile_m, (3.0 * rng_double(&rng) - 1.0) * tile_m,
                          rng_double(&rng) * height_m};
        assert_int_equal(strand_add(s, &like, N_NODE, &node, NULL), STATUS_OK);
        for (size_t k = 0; k < N_NODE; k++) {
            node[k][0] = from[0] + (double)k * radius_m * cos(turn);
            node[k][1] = from[1] + (double)k * radius_m * sin(turn);
            node[k][2] = from[2] + (double)k * radius_m * rise;
        }
    }
}

/* Deepest overlap of node k with a node of another strand, or of its own beyond its neighbours, over the sum of
 * radii. */
static double deepest(const struct strand_set *s, size_t k)
{
    double most = 0.0, own_m = s->strand[k / N_NODE].radius_m;
    for (size_t j = 0; j < s->n_node; j++) {
        double d2 = 0.0, want_m = own_m + s->strand[j / N_NODE].radius_m;
        if (j / N_NODE == k / N_NODE && labs((long)j - (long)k) < 8) continue;
        for (int a = 0; a < 3; a++) {
            double d = s->start[k][a] - s->start[j][a];
            if (a < 2) d -= s->tile_m[a] * rint(d / s->tile_m[a]);
            d2 += d * d;
        }
        most = fmax(most, (want_m - sqrt(d2)) / want_m);
    }
    return most;
}

/* Tiles of 40, 3, 2 and 1 cells along an edge: with few cells the neighbours of a cell are the same one from both
 * sides. */
static void test_overlaps_are_those_of_all_pairs(void **state)
{
    static const double tile_m[] = {400e-6, 34e-6, 24e-6, 12e-6};
    (void)state;
    for (size_t t = 0; t < 4; t++) {
        struct strand_set s;
        struct strand_fit fit;
        double mean = 0.0, most = 0.0;
        scatter(&s, tile_m[t], t == 0 ? 20e-6 : 200e-6, 5 + t);
        assert_int_equal(strand_relax(&s, &(struct strand_relax_option){.rule = STRAND_SMOOTH}, NULL, NULL, &fit, NULL),
                         STATUS_OK);
        for (size_t k = 0; k < s.n_node; k++) {
            double depth = deepest(&s, k);
            mean += depth / (double)s.n_node;
            most = fmax(most, depth);
        }
        assert_true(most > 0.1);
        assert_true(fabs(fit.overlap_max - most) < 1e-9 && fabs(fit.overlap_mean - mean) < 1e-9);
        strand_set_release(&s);
    }
}

int main(void)
{
    const struct CMUnitTest test[] = {
        cmocka_unit_test(test_overlaps_are_those_of_all_pairs),
    };
    return cmocka_run_group_tests(test, NULL, NULL);
}
