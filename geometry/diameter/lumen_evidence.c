#include "geometry/diameter/lumen_evidence.h"
#include "geometry/diameter/lumen_fill.h"
#include "geometry/diameter/scale_space.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

enum { MOST_EDGE = 160, BRICK = SCALE_EDGE, MARGIN = 8, STEP = BRICK - 2 * MARGIN, N_CELL = BRICK * BRICK * BRICK };
/* Scales of a fiber per width of its lumen, for lumens of 0.3 to 0.6 of the fiber's width. */
static const double SCALE_PER_WIDTH[3] = {0.85, 1.05, 1.3};
static const float MIDDLE = 0.3f;          /* response in the middle of a fiber */
static const double LEAST_ENCLOSED = 1e-3; /* share below which there are too few places to look at */
/* Thresholds of middle_share, and of middle_share / enclosed_share, above which lumens are possible, and clear. */
static const double POSSIBLE[2] = {0.001, 0.015}, CLEAR[2] = {0.002, 0.015};
/* Thresholds of hollow_share above which lumens are possible, and clear. */
static const double POSSIBLE_LINES = 0.15, CLEAR_LINES = 0.2;
/* Where lumens show (lumen_evidence_would_show): least diameter in voxels, and largest noise, also where it is
 * correlated by more than LONG_BLUR voxels. */
#define SHOWN_DIAMETER 6.0
#define SHOWN_NOISE 0.36
#define LONG_BLUR 0.6
#define LONG_NOISE 0.13

/* A box in the middle of the scan: as it is, and filled. */
struct evidence_box {
    struct volume scan, filled;
    float *brick[3]; /* a brick, scratch, and the largest response */
};

static status copy_middle(const struct volume *v, struct volume *to, struct error *err)
{
    size_t n[3], from[3];
    for (int a = 0; a < 3; a++) {
        n[a] = v->n[a] < MOST_EDGE ? v->n[a] : MOST_EDGE;
        from[a] = (v->n[a] - n[a]) / 2;
    }
    status s = volume_init_in(to, n, v->voxel_size_m, v->space, err);
    for (size_t k = 0; k < n[2] && s == STATUS_OK; k++)
        for (size_t j = 0; j < n[1]; j++)
            memcpy(to->density + volume_index(n, 0, j, k),
                   v->density + volume_index(v->n, from[0], from[1] + j, from[2] + k), n[0] * sizeof *to->density);
    scratch_keep_within(v->space);
    return s;
}

static bool is_enclosed(const struct evidence_box *b, size_t at)
{
    return b->filled.density[at] == 1.0f && b->scan.density[at] < 1.0f;
}

/* Width of round tubes with as many voxels for each face of a voxel: a tube of width w has pi w^2 / 4 voxels and 4 w
 * faces in a slice. */
static double width_of(const struct evidence_box *b)
{
    const size_t *n = b->scan.n, step[3] = {1, n[0], n[0] * n[1]};
    size_t inside = 0, face = 0;
    for (size_t k = 0; k + 1 < n[2]; k++)
        for (size_t j = 0; j + 1 < n[1]; j++)
            for (size_t i = 0; i + 1 < n[0]; i++) {
                size_t at = volume_index(n, i, j, k);
                bool enclosed = is_enclosed(b, at);
                inside += enclosed;
                for (int a = 0; a < 3; a++) face += enclosed != is_enclosed(b, at + step[a]);
            }
    return face > 0 ? 16.0 / M_PI * (double)inside / (double)face : 0.0;
}

/* Writes the largest response of a brick over the scales into b->brick[2]. */
static void respond(const struct evidence_box *b, const size_t from[3], const size_t n[3], double width)
{
    float *a = b->brick[0], *best = b->brick[2];
    memset(best, 0, N_CELL * sizeof *best);
    for (int c = 0; c < 3; c++) {
        const double sigma = SCALE_PER_WIDTH[c] * width;
        for (size_t k = 0; k < n[2]; k++)
            for (size_t j = 0; j < n[1]; j++)
                memcpy(a + volume_index(n, 0, j, k),
                       b->filled.density + volume_index(b->filled.n, from[0], from[1] + j, from[2] + k),
                       n[0] * sizeof *a);
        scale_blur(a, b->brick[1], n, sigma);
        for (size_t k = MARGIN; k + MARGIN < n[2]; k++)
            for (size_t j = MARGIN; j + MARGIN < n[1]; j++)
                for (size_t i = MARGIN; i + MARGIN < n[0]; i++) {
                    size_t at = volume_index(n, i, j, k);
                    float r = (float)(sigma * sigma) *
                              scale_minus_laplacian(a + at, (ptrdiff_t)n[0], (ptrdiff_t)(n[0] * n[1]));
                    if (r > best[at]) best[at] = r;
                }
    }
}

/* Adds the number of enclosed voxels inside of a brick, and of enclosed voxels in the middle of a fiber. */
static void count_brick(const struct evidence_box *b, const size_t from[3], const size_t n[3], size_t *enclosed,
                        size_t *middle)
{
    for (size_t k = MARGIN; k + MARGIN < n[2]; k++)
        for (size_t j = MARGIN; j + MARGIN < n[1]; j++)
            for (size_t i = MARGIN; i + MARGIN < n[0]; i++) {
                if (!is_enclosed(b, volume_index(b->scan.n, from[0] + i, from[1] + j, from[2] + k))) continue;
                (*enclosed)++;
                *middle += b->brick[2][volume_index(n, i, j, k)] > MIDDLE;
            }
}

/* Share of the enclosed voxels that are in the middle of a fiber. */
static double middle_share(const struct evidence_box *b, double width)
{
    const size_t *all = b->scan.n;
    size_t from[3], n[3], enclosed = 0, middle = 0;
    for (from[2] = 0; from[2] + 2 * MARGIN < all[2]; from[2] += STEP)
        for (from[1] = 0; from[1] + 2 * MARGIN < all[1]; from[1] += STEP)
            for (from[0] = 0; from[0] + 2 * MARGIN < all[0]; from[0] += STEP) {
                for (int a = 0; a < 3; a++) n[a] = all[a] - from[a] < BRICK ? all[a] - from[a] : BRICK;
                respond(b, from, n, width);
                count_brick(b, from, n, &enclosed, &middle);
            }
    return enclosed > 0 ? (double)middle / (double)enclosed : 0.0;
}

enum lumen_verdict lumen_evidence_judge(const struct lumen_evidence *e)
{
    const double middle = e->middle_share, of_enclosed = middle / fmax(e->enclosed_share, 1e-12);
    if (middle < POSSIBLE[0] || of_enclosed < POSSIBLE[1]) return LUMENS_NOT_SEEN;
    if (isfinite(e->hollow_share))
        return e->hollow_share >= CLEAR_LINES      ? LUMENS_CLEAR
               : e->hollow_share >= POSSIBLE_LINES ? LUMENS_POSSIBLE
                                                   : LUMENS_NOT_SEEN;
    return middle >= CLEAR[0] && of_enclosed >= CLEAR[1] ? LUMENS_CLEAR : LUMENS_POSSIBLE;
}

bool lumen_evidence_would_show(double diameter_voxel, double noise_sd, double noise_blur_voxel)
{
    return diameter_voxel >= SHOWN_DIAMETER && noise_sd <= (noise_blur_voxel > LONG_BLUR ? LONG_NOISE : SHOWN_NOISE);
}

status lumen_evidence_measure(const struct volume *v, double noise_sd, struct thread_pool *pool,
                              struct lumen_evidence *e, struct error *err)
{
    struct evidence_box b = {0};
    *e = (struct lumen_evidence){.hollow_share = NAN, .radius_spread = NAN};
    status s = copy_middle(v, &b.scan, err);
    if (s == STATUS_OK) s = copy_middle(v, &b.filled, err);
    if (s == STATUS_OK) s = lumens_fill(&b.filled, noise_sd, pool, &e->enclosed_share, err);
    if (s == STATUS_OK) e->width_voxel = width_of(&b);
    if (s == STATUS_OK && e->enclosed_share > LEAST_ENCLOSED && e->width_voxel > 0.0) {
        for (int i = 0; i < 3; i++) b.brick[i] = malloc(N_CELL * sizeof *b.brick[i]);
        if (b.brick[0] != NULL && b.brick[1] != NULL && b.brick[2] != NULL)
            e->middle_share = e->enclosed_share * middle_share(&b, fmin(e->width_voxel, 8.0));
        else
            s = error_set(err, STATUS_NO_MEMORY, "cannot look for lumens: out of memory");
        for (int i = 0; i < 3; i++) free(b.brick[i]);
    }
    volume_release(&b.scan);
    volume_release(&b.filled);
    return s;
}
