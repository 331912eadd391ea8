#include "geometry/weave/weave_draft.h"

#include "base/small_matrix.h"
#include "geometry/weave/weave_trial.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { CONTRASTS = 5, INDEX_REACH = 8, PLACES = WEAVE_PLACES * WEAVE_PLACES, SIDE = 2 * INDEX_REACH + 1 };
/* Prior of the brightnesses: standard deviation of each shape over the contrast of the cloth, and the contrasts
 * tried. */
static const double SHAPE_SD[WEAVE_SHAPES] = {1.0, 0.4, 0.4, 0.2, 0.2, 0.2, 0.2};
static const double CONTRAST[CONTRASTS] = {0.7, 1.5, 3.0, 6.0, 12.0};
/* No drawing is better than this share of the power. */
static const double LEAST_RESIDUAL = 0.01;

static double square(double x) { return x * x; }

/* The least-squares problem of a drawing at one blur: normal equations, whose right side depends on the place. */
struct problem {
    double normal[WEAVE_SHAPES * WEAVE_SHAPES]; /* lower triangle */
    double right[WEAVE_SHAPES][PLACES];
};

/* A drawing fitted to the repeat. */
struct fitted {
    double residual; /* share of the repeat's weighted power that is left */
    double cost;     /* logarithm of how much freer the brightnesses were before than they are now */
    int place;
};

static void problem_set(struct problem *q, const struct weave_trial *t, double complex (*drawn)[WEAVE_SHAPES], int blur)
{
    memset(q, 0, sizeof *q);
    for (size_t k = 0; k < t->n; k++) {
        double b = t->blur[blur][k], w = t->weight[k] * b;
        for (int i = 0; i < WEAVE_SHAPES; i++) {
            double re = w * creal(drawn[k][i]), im = w * cimag(drawn[k][i]);
            for (int j = 0; j <= i; j++)
                q->normal[i * WEAVE_SHAPES + j] += b * (re * creal(drawn[k][j]) + im * cimag(drawn[k][j]));
            for (int p = 0; p < PLACES; p++) q->right[i][p] += re * t->moved_re[k][p] + im * t->moved_im[k][p];
        }
    }
}

/* Fits the brightnesses under their Gaussian prior at every place and finds the best place. */
static bool problem_solve(const struct problem *q, const struct weave_trial *t, double contrast, struct fitted *fit)
{
    double normal[WEAVE_SHAPES * WEAVE_SHAPES], best = -1.0;
    memcpy(normal, q->normal, sizeof normal);
    for (int i = 0; i < WEAVE_SHAPES; i++) normal[i * (WEAVE_SHAPES + 1)] += 1.0 / square(contrast * SHAPE_SD[i]);
    if (!small_factor(normal, WEAVE_SHAPES, 0.0)) return false;
    fit->cost = 0.0;
    for (int i = 0; i < WEAVE_SHAPES; i++) fit->cost += log(normal[i * (WEAVE_SHAPES + 1)] * contrast * SHAPE_SD[i]);
    /* with the factor L of the normal equations, the power explained is |L^-1 right|^2 */
    double solved[WEAVE_SHAPES][PLACES], explained[PLACES] = {0};
    for (int i = 0; i < WEAVE_SHAPES; i++) {
        memcpy(solved[i], q->right[i], sizeof solved[i]);
        for (int j = 0; j < i; j++)
            for (int p = 0; p < PLACES; p++) solved[i][p] -= normal[i * WEAVE_SHAPES + j] * solved[j][p];
        for (int p = 0; p < PLACES; p++) {
            solved[i][p] /= normal[i * (WEAVE_SHAPES + 1)];
            explained[p] += square(solved[i][p]);
        }
    }
    for (int p = 0; p < PLACES; p++)
        if (explained[p] > best) {
            best = explained[p];
            fit->place = p;
        }
    fit->residual = 1.0 - best / t->power;
    return true;
}

/* A draft as weave_search_draft returns it, with its place but without scores. */
static struct weave_draft make_draft(const struct weave_trial *t, unsigned pattern, int place)
{
    struct weave_draft d = {.n_warp = t->cells.n_warp, .n_weft = t->cells.n_weft};
    double f[2][2] = {{t->f_warp[0], t->f_warp[1]}, {t->f_weft[0], t->f_weft[1]}}, step[2][2];
    weave_dual_basis(f, step);
    for (int a = 0; a < 2; a++) {
        d.f_warp[a] = t->f_warp[a];
        d.f_weft[a] = t->f_weft[a];
        d.step_warp_px[a] = step[0][a];
        d.step_weft_px[a] = step[1][a];
        d.origin_px[a] = (step[0][a] * (place % WEAVE_PLACES) + step[1][a] * (place / WEAVE_PLACES)) / WEAVE_PLACES;
    }
    for (size_t j = 0; j < d.n_weft; j++)
        for (size_t i = 0; i < d.n_warp; i++)
            d.warp_on_top[j * d.n_warp + i] = (uint8_t)(pattern >> t->cells.number[j][i] & 1u);
    return d;
}

bool weave_draft_same(const struct weave_draft *a, const struct weave_draft *b)
{
    if (a->n_warp != b->n_warp || a->n_weft != b->n_weft) return false;
    for (size_t shift = 0; shift < a->n_warp * a->n_weft; shift++) {
        bool same = true;
        for (size_t k = 0; same && k < a->n_warp * a->n_weft; k++) {
            size_t i = (k + shift) % a->n_warp, j = (k / a->n_warp + shift / a->n_warp) % a->n_weft;
            same = a->warp_on_top[k] == b->warp_on_top[j * a->n_warp + i];
        }
        if (same) return true;
    }
    return false;
}

static bool yarns_same(const struct weave_draft *a, const struct weave_draft *b)
{
    double apart_warp = hypot(a->f_warp[0] - b->f_warp[0], a->f_warp[1] - b->f_warp[1]);
    double apart_weft = hypot(a->f_weft[0] - b->f_weft[0], a->f_weft[1] - b->f_weft[1]);
    return apart_warp < 0.05 * hypot(a->f_warp[0], a->f_warp[1]) &&
           apart_weft < 0.05 * hypot(a->f_weft[0], a->f_weft[1]);
}

/* Takes a draft with its score into the account of the best and of the best others. */
static void compare(struct weave_draft *best, struct weave_draft *d)
{
    d->score_exchanged = best->score_exchanged;
    d->score_other_draft = best->score_other_draft;
    d->score_other_yarns = best->score_other_yarns;
    struct weave_draft *winner = d->score > best->score ? d : best, *other = d->score > best->score ? best : d;
    if (other->n_warp > 0 && !yarns_same(winner, other)) {
        if (winner == d) winner->score_other_draft = winner->score_exchanged = -INFINITY; /* they were of other yarns */
        winner->score_other_yarns = fmax(winner->score_other_yarns, other->score);
    } else if (other->n_warp > 0 && !weave_draft_same(winner, other))
        winner->score_other_draft = fmax(winner->score_other_draft, other->score);
    else if (other->n_warp == 2 && other->n_weft == 2 && winner->warp_on_top[0] != other->warp_on_top[0])
        winner->score_exchanged = other->score;
    if (winner == d) *best = *d;
}

/* Finds the best blur and contrast of a pattern. */
static void try_pattern(const struct weave_trial *t, unsigned pattern, double bonus, struct weave_draft *best)
{
    double complex drawn[WEAVE_COEFFICIENT_MAX][WEAVE_SHAPES];
    struct problem problem;
    double score = -INFINITY, residual = 1.0, prior = t->prior + weave_trial_draft_prior(t, pattern) + bonus;
    int place = 0;
    weave_draw(&t->cells, pattern, t->stroke, t->n, drawn);
    for (int b = 0; b < WEAVE_BLURS; b++) {
        problem_set(&problem, t, drawn, b);
        for (int c = 0; c < CONTRASTS; c++) {
            struct fitted fit = {.place = 0};
            if (!problem_solve(&problem, t, CONTRAST[c], &fit)) continue;
            double own = -t->n_effective * log(fit.residual + LEAST_RESIDUAL) - fit.cost + prior;
            if (own <= score) continue;
            score = own;
            residual = fit.residual;
            place = fit.place;
        }
    }
    struct weave_draft d = make_draft(t, pattern, place);
    d.score = score;
    d.residual = residual;
    compare(best, &d);
}

status weave_search_draft(const struct weave_lattice *lattice, const struct weave_repeat *repeat,
                          const struct weave_streaks *streaks, double bonus, struct weave_draft *draft,
                          struct error *err)
{
    struct weave_trial *t = malloc(sizeof *t);
    if (t == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot analyse texture: out of memory");
    if (draft->score == -INFINITY)
        *draft = (struct weave_draft){.score = -INFINITY,
                                      .score_other_draft = -INFINITY,
                                      .score_other_yarns = -INFINITY,
                                      .score_exchanged = -INFINITY};
    for (int i = 0; i < SIDE * SIDE; i++)
        for (int k = 0; k < SIDE * SIDE; k++) {
            int warp[2] = {i % SIDE - INDEX_REACH, i / SIDE - INDEX_REACH};
            int weft[2] = {k % SIDE - INDEX_REACH, k / SIDE - INDEX_REACH};
            if (!weave_trial_init(t, lattice, repeat, streaks, warp, weft)) continue;
            for (unsigned pattern = 1; pattern + 1 < 1u << t->cells.n_cell; pattern++)
                if (weave_pattern_holds(&t->cells, pattern)) try_pattern(t, pattern, bonus, draft);
        }
    free(t);
    return STATUS_OK;
}
