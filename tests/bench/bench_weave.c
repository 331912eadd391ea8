/* The share of drawn weaves with known drafts whose yarns and draft are found: nine drafts, random spacing, rotation,
 * colors, noise, gradient of the light and a dark object in a corner. And how far confidences can be trusted: the share
 * of right drafts among those with a confidence of at least 0.9, and among the others. One JSON object a line.
 *
 *   bench_weave [pictures of each draft, 6]
 */
#include "geometry/weave/weave_detect.h"
#include "tests/support/weave/drawn_weave.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

static const char *const drafts[] = {"#./.#",
                                     "##../.##./..##/#..#",
                                     "##../#..#/..##/.##.",
                                     "###./.###/#.##/##.#",
                                     "##./.##/#.#",
                                     "#../.#./..#",
                                     "####./##.##/.####/###.#/#.###",
                                     "#######./####.###/#.######/######.#/###.####/.#######/#####.##/##.#####",
                                     "##../##../..##/..##"};

static const struct picture_kind {
    const char *name;
    double least_px, most_px, turn_deg, noise, ratio, unevenness;
    bool one_color;
} kinds[] = {{"two_colors", 4.0, 16.0, 30.0, 0.3, 1.8, 0.05, false},
             {"one_color", 4.0, 16.0, 30.0, 0.3, 1.8, 0.05, true},
             {"narrow", 2.0, 4.0, 30.0, 0.2, 1.8, 0.12, false}};

static double uniform(uint64_t *seed)
{
    *seed = *seed * 6364136223846793005u + 1442695040888963407u;
    return (double)(*seed >> 11) / 9007199254740992.0;
}

static struct drawn_weave random_picture(const struct picture_kind *k, const char *rows, uint64_t *seed)
{
    struct drawn_weave w = {.rows = rows, .edge_px = 512, .seed = *seed, .unevenness = k->unevenness};
    double px = k->least_px * pow(k->most_px / k->least_px, uniform(seed));
    double ratio = pow(k->ratio, uniform(seed) - 0.5);
    w.spacing_px[0] = px * ratio;
    w.spacing_px[1] = px / ratio;
    w.rotation_deg = k->turn_deg * (2.0 * uniform(seed) - 1.0);
    w.cover = 0.7 + 0.35 * uniform(seed);
    for (int c = 0; c < 3; c++) {
        w.warp_rgb[c] = 0.1 + 0.8 * uniform(seed);
        w.weft_rgb[c] = k->one_color ? w.warp_rgb[c] : 0.1 + 0.8 * uniform(seed);
    }
    w.noise = k->noise * uniform(seed);
    w.gradient = 2.0 * uniform(seed);
    w.dark_corner_px = 60.0 * uniform(seed);
    return w;
}

static bool yarns_right(const struct drawn_weave *w, const struct weave_guess *g)
{
    for (int a = 0; a < 2; a++) {
        if (fabs(g->spacing_px[a] / w->spacing_px[a] - 1.0) > 0.03) return false;
        if (fabs(g->direction_deg[a] - (a == 0 ? 90.0 : 0.0) - w->rotation_deg) > 2.0) return false;
    }
    return true;
}

static bool draft_right(const struct drawn_weave *w, const struct weave_guess *g)
{
    struct weave_draft truth = {.score = 0.0};
    size_t size[2];
    drawn_weave_size(w->rows, size);
    truth.n_warp = size[0];
    truth.n_weft = size[1];
    for (size_t j = 0; j < size[1]; j++)
        for (size_t i = 0; i < size[0]; i++) truth.warp_on_top[j * size[0] + i] = w->rows[j * (size[0] + 1) + i] == '#';
    return weave_draft_same(&truth, &g->draft);
}

/* Counts of pictures; certain: the confidence of the draft is at least CERTAIN. */
struct tally {
    size_t n_yarns, n_draft; /* right ones */
    size_t n[2], n_right[2]; /* drafts that were found and right drafts, [1]: certain */
};
static const double CERTAIN = 0.9;

static void try_picture(const struct drawn_weave *w, struct tally *t)
{
    struct weave_guess g;
    struct error err = {0};
    float *rgb = drawn_weave_picture(w);
    const struct weave_picture picture = {rgb, w->edge_px, w->edge_px};
    if (weave_detect(&picture, &g, &err) == STATUS_OK) {
        bool yarns = yarns_right(w, &g), draft = yarns && draft_right(w, &g);
        size_t certain = g.draft_confidence >= CERTAIN;
        t->n_yarns += yarns;
        t->n_draft += draft;
        t->n[certain]++;
        t->n_right[certain] += draft;
    }
    free(rgb);
}

static void print_share(const char *kind, const char *what, size_t n_right, size_t n)
{
    printf("{\"name\":\"weave.%s.%s\",\"value\":%.4g,\"unit\":\"1\",\"better\":\"higher\",\"n\":%zu,\"of\":%zu}\n",
           kind, what, (double)n_right / (double)(n > 0 ? n : 1), n_right, n);
}

int main(int argc, char **argv)
{
    size_t n_each = argc > 1 ? strtoul(argv[1], NULL, 10) : 6, n_of = sizeof drafts / sizeof *drafts;
    for (size_t k = 0; k < sizeof kinds / sizeof *kinds; k++) {
        struct tally t = {0};
        uint64_t seed = 1 + k;
        for (size_t i = 0; i < n_each * n_of; i++) {
            const struct drawn_weave w = random_picture(&kinds[k], drafts[i % n_of], &seed);
            try_picture(&w, &t);
        }
        print_share(kinds[k].name, "yarns_right", t.n_yarns, n_each * n_of);
        print_share(kinds[k].name, "draft_right", t.n_draft, n_each * n_of);
        print_share(kinds[k].name, "certain_draft_right", t.n_right[1], t.n[1]);
        print_share(kinds[k].name, "uncertain_draft_right", t.n_right[0], t.n[0]);
        fflush(stdout);
    }
    return 0;
}
