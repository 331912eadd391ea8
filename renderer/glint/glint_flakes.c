/* Flakes: cells of a Voronoi diagram on the torus, each with one normal (000, section 3.7, "Metallic paint"). Their
 * middles are jittered in a square lattice, one in each cell of it, in place of a Poisson disk: then the nearest one
 * lies among 25 cells. */
#include "base/rng.h"
#include "renderer/glint/glint_map.h"

#include <math.h>
#include <stdlib.h>

struct flake {
    double place[2]; /* texels */
    float slope[2];
};

static struct flake flake_draw(struct rng *r, const size_t at[2], double size, double alpha)
{
    struct flake f;
    double pair[2];
    for (int a = 0; a < 2; a++) f.place[a] = ((double)at[a] + 0.1 + 0.8 * rng_double(r)) * size;
    rng_normal_pair(r, pair);
    for (int a = 0; a < 2; a++) f.slope[a] = (float)(pair[a] * alpha * M_SQRT1_2);
    return f;
}

/* Slope of the flake whose middle is nearest to the middle of a texel. */
static const float *nearest_slope(const struct flake *flake, size_t n_flake, double size, const double place[2])
{
    const int n = (int)n_flake, x0 = (int)(place[0] / size), y0 = (int)(place[1] / size);
    const double period = size * (double)n;
    const struct flake *nearest = flake;
    double least = INFINITY;
    for (int y = y0 - 2; y <= y0 + 2; y++)
        for (int x = x0 - 2; x <= x0 + 2; x++) {
            const struct flake *f = &flake[((y + n) % n) * n + (x + n) % n];
            const double du = remainder(f->place[0] - place[0], period), dv = remainder(f->place[1] - place[1], period);
            const double square = du * du + dv * dv;
            if (square >= least) continue;
            least = square;
            nearest = f;
        }
    return nearest->slope;
}

status glint_flake_slopes(const struct glint_option *o, struct glint_map *m, struct error *err)
{
    const double wish = (double)(o->flake_um / o->texel_um);
    const size_t n_flake = (size_t)fmax(4, round((double)m->n / wish));
    const double size = (double)m->n / (double)n_flake;
    const struct rng_key key = {.seed = o->seed, .iteration = 2};
    struct flake *flake = malloc(n_flake * n_flake * sizeof *flake);
    if (flake == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot make flakes: out of memory");
    for (size_t k = 0; k < n_flake * n_flake; k++) {
        const size_t at[2] = {k % n_flake, k / n_flake};
        struct rng r;
        rng_start(&r, &key, (uint32_t)k, 0);
        flake[k] = flake_draw(&r, at, size, (double)o->slope);
    }
    for (size_t j = 0; j < m->n; j++)
        for (size_t i = 0; i < m->n; i++) {
            const double place[2] = {(double)i + 0.5, (double)j + 0.5};
            const float *slope = nearest_slope(flake, n_flake, size, place);
            for (int c = 0; c < 2; c++) m->normal[j * m->n + i][c] = slope[c];
        }
    free(flake);
    return STATUS_OK;
}
