#include "geometry/weave/weave_trial.h"
#include "base/angle.h"

#include <math.h>

/* Blur of the drawing: standard deviation over the mean distance of the yarns. */
static const double BLUR[WEAVE_BLURS] = {0.0, 0.2, 0.4, 0.6, 0.8};
/* A drawing is right to a share of each coefficient, and to a share of the largest one. */
static const double DRAWING_ERROR = 0.2, FLOOR_ERROR = 0.02;
/* Prior of the yarns: their angle, the logarithm of the ratio of their distances, and a cost for yarns that are nearer
 * to each other than two pixels. Yarns farther from these than LARGEST are not tried. */
static const double SKEW_SD_DEG = 4.0, RATIO_SD = 0.7, NARROW_COST = 3.0;
static const double LARGEST_RATIO = 3.2, LARGEST_SKEW_DEG = 15.0;
/* Logarithm of the odds for each unit of a streak across the yarns, up to STREAK_MOST. */
static const double STREAK_GAIN = 10.0, STREAK_MOST = 0.6;
/* Prior of the draft: for each float of a yarn beyond two in a repeat, and for showing the denser yarns. */
static const double FLOAT_COST = 1.0, DENSE_GAIN = 8.0;

static double square(double x) { return x * x; }

static void weigh(struct weave_trial *t, const struct weave_repeat *r)
{
    double largest = 0.0, sum = 0.0, sum_square = 0.0;
    for (size_t k = 0; k < r->n_coefficient; k++) largest = fmax(largest, cabs(r->coefficient[k].value));
    for (size_t k = 0; k < r->n_coefficient; k++) {
        const struct weave_coefficient *c = &r->coefficient[k];
        double size = cabs(c->value);
        t->weight[k] = 1.0 / (square(DRAWING_ERROR * size + FLOOR_ERROR * largest) + square(c->sd));
        sum += t->weight[k] * size * size;
        sum_square += square(t->weight[k] * size * size);
    }
    t->power = sum;
    t->n_effective = sum * sum / sum_square;
}

static void transform(struct weave_trial *t, const struct weave_repeat *r, const int warp[2], const int weft[2])
{
    int det = warp[0] * weft[1] - warp[1] * weft[0];
    double per_px = sqrt(hypot(t->f_warp[0], t->f_warp[1]) * hypot(t->f_weft[0], t->f_weft[1]));
    t->n = r->n_coefficient;
    for (size_t k = 0; k < t->n; k++) {
        const struct weave_coefficient *c = &r->coefficient[k];
        double f = hypot(c->f[0], c->f[1]) / per_px;
        const double ab[2] = {(double)(c->index[0] * weft[1] - c->index[1] * weft[0]) / det,
                              (double)(c->index[1] * warp[0] - c->index[0] * warp[1]) / det};
        weave_strokes_init(&t->stroke[k], &t->cells, ab);
        for (int b = 0; b < WEAVE_BLURS; b++) t->blur[b][k] = exp(-2.0 * square(M_PI * BLUR[b] * f));
        for (int p = 0; p < WEAVE_PLACES * WEAVE_PLACES; p++) {
            double turn = (ab[0] * (p % WEAVE_PLACES) + ab[1] * (p / WEAVE_PLACES)) / WEAVE_PLACES;
            double complex moved = c->value * cexp(2.0 * M_PI * I * turn);
            t->moved_re[k][p] = creal(moved);
            t->moved_im[k][p] = cimag(moved);
        }
    }
    weigh(t, r);
}

/* Yarns lie across the rays of the spectrum. Without rays nothing is known. */
static double streak_prior(const struct weave_trial *t, const struct weave_streaks *s)
{
    double warp = weave_streak_along(s, t->f_warp), weft = weave_streak_along(s, t->f_weft);
    return STREAK_GAIN * (fmin(warp, STREAK_MOST) + fmin(weft, STREAK_MOST));
}

bool weave_trial_init(struct weave_trial *t, const struct weave_lattice *lattice, const struct weave_repeat *repeat,
                      const struct weave_streaks *streaks, const int warp[2], const int weft[2])
{
    if (!weave_cells_init(&t->cells, warp, weft)) return false;
    for (int a = 0; a < 2; a++) {
        t->f_warp[a] = warp[0] * lattice->f[0][a] + warp[1] * lattice->f[1][a];
        t->f_weft[a] = weft[0] * lattice->f[0][a] + weft[1] * lattice->f[1][a];
    }
    double p = hypot(t->f_warp[0], t->f_warp[1]), q = hypot(t->f_weft[0], t->f_weft[1]);
    if (t->f_warp[0] <= 0.0 || t->f_weft[1] <= 0.0 || p > 1.0 || q > 1.0) return false;
    if (fabs(t->f_warp[0]) / p < fabs(t->f_weft[0]) / q) return false;
    double cosine = (t->f_warp[0] * t->f_weft[0] + t->f_warp[1] * t->f_weft[1]) / (p * q);
    double skew_deg = angle_to_deg(asin(cosine)), ratio = log(p / q);
    if (fabs(skew_deg) > LARGEST_SKEW_DEG || fabs(ratio) > log(LARGEST_RATIO)) return false;
    double narrow = fmax(0.0, log(2.0 * p)) + fmax(0.0, log(2.0 * q));
    t->prior = -0.5 * square(skew_deg / SKEW_SD_DEG) - 0.5 * square(ratio / RATIO_SD) - NARROW_COST * narrow -
               log(2.0) * (double)t->cells.n_cell + streak_prior(t, streaks);
    transform(t, repeat, warp, weft);
    return true;
}

/* Ends of floats in a repeat of a yarn, as mean over all yarns. Most drafts have two: one float above, one below. */
static double float_ends(const struct weave_trial *t, unsigned pattern)
{
    const struct weave_cells *c = &t->cells;
    double n_end = 0.0;
    for (size_t k = 0; k < c->n_cell; k++)
        for (size_t l = 0; l < c->n_cell; l++) {
            size_t next = (l + 1) % c->n_cell;
            n_end += (double)(((pattern >> c->number[k][l] ^ pattern >> c->number[k][next]) & 1u) * c->n_warp);
            n_end += (double)(((pattern >> c->number[l][k] ^ pattern >> c->number[next][k]) & 1u) * c->n_weft);
        }
    return n_end / (double)(2 * c->n_cell * c->n_cell);
}

double weave_trial_draft_prior(const struct weave_trial *t, unsigned pattern)
{
    /* a cloth shows mostly the denser yarns, because floats lie beside each other */
    double denser = log(hypot(t->f_warp[0], t->f_warp[1]) / hypot(t->f_weft[0], t->f_weft[1]));
    double warp_share = (double)__builtin_popcount(pattern) / (double)t->cells.n_cell;
    return DENSE_GAIN * denser * (warp_share - 0.5) - FLOAT_COST * (float_ends(t, pattern) - 2.0);
}
