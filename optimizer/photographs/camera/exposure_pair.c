#include "optimizer/photographs/camera/exposure_pair.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { GRID = 8, GROUPS = GRID * GRID, LEAST_GROUPS = 6, MAX_BLOCK_PX = 8, MARGIN_PX = 2 };
static const double most_share = 0.9;       /* of the full scale, of samples that are compared */
static const double least_determined = 0.2; /* error of ln ratio from which on two exposures are not compared */
static const double black_known_dn = 0.1;   /* error of the level of black beside a record of the noise */
static const double balance_linear = 0.015, balance_srgb = 0.05; /* difference of ln ratio between channels */

/* Sums of the light of two exposures, the shorter and the longer one: for each part of the picture and channel, of both
 * halves of its pixels. */
struct pair_sums {
    double light[GROUPS][3][2][2]; /* [group][channel][half][shorter, longer] */
    double n_dn[3];                /* weights, so that n_dn times a step is the sum's error */
};

/* ---- sums ---- */

struct block {
    size_t x0, y0, x1, y1, c;
};

/* Largest share of the full scale that each half has in and around a block. At the edge of a saturated area a green of
 * two samples, one of them saturated, looks dark. */
static void largest_around(const struct exposure_set *e, const size_t pair[2], const struct block *b, double most[2])
{
    const size_t x0 = b->x0 > MARGIN_PX ? b->x0 - MARGIN_PX : 0, y0 = b->y0 > MARGIN_PX ? b->y0 - MARGIN_PX : 0,
                 x1 = b->x1 + MARGIN_PX < e->width ? b->x1 + MARGIN_PX : e->width,
                 y1 = b->y1 + MARGIN_PX < e->height ? b->y1 + MARGIN_PX : e->height;
    most[0] = most[1] = 0.0;
    for (size_t y = y0; y < y1; y++)
        for (size_t x = x0; x < x1; x++)
            for (size_t j = 0; j < 2; j++) {
                const size_t i = pair[j], half = (x + y) & 1;
                if (e->full_scale[i] == 1.0) continue;
                most[half] = fmax(most[half], (double)e->image[i]->pixel[3 * (y * e->width + x) + b->c]);
            }
}

/* Sums of a block by halves. use: false for a half that the other half excludes, or that has a saturated sample. */
static void sum_block(const struct exposure_set *e, const size_t pair[2], const struct block *b, double sum[2][2],
                      size_t n[2], bool use[2])
{
    const struct noise_channel *k = exposure_noise(e, b->c);
    double most[2];
    memset(sum, 0, 4 * sizeof **sum);
    n[0] = n[1] = 0;
    for (size_t y = b->y0; y < b->y1; y++)
        for (size_t x = b->x0; x < b->x1; x++) {
            const size_t half = (x + y) & 1, p = 3 * (y * e->width + x) + b->c;
            n[half]++;
            for (size_t j = 0; j < 2; j++)
                sum[half][j] += exposure_sample_dn(e, pair[j], p) - k->read_mean - e->t_s[pair[j]] * k->dark_mean;
        }
    largest_around(e, pair, b, most);
    for (size_t half = 0; half < 2; half++)
        use[half] = n[0] > 0 && n[1] > 0 && isfinite(sum[half][0] + sum[half][1]) && most[1 - half] < most_share;
}

/* Weight of a half: light over variance of the shorter exposure, by the light of the other half in the longer one. */
static double weight_of(const struct exposure_set *e, const size_t pair[2], size_t c, double other, size_t n)
{
    const struct noise_channel *k = exposure_noise(e, c);
    const double t_s = e->t_s[pair[0]], light = fmax(0.0, other / (double)n * t_s / e->t_s[pair[1]]);
    if (!(k->read_var + k->dark_var + k->shot_var > 0.0)) return 1.0;
    const double var = k->read_var + k->dark_var * t_s + k->shot_var * light;
    return var > 0.0 ? light / var : 1.0;
}

static size_t block_edge(const struct exposure_set *e)
{
    const size_t edge = (e->width < e->height ? e->width : e->height) / (2 * GRID);
    return edge > MAX_BLOCK_PX ? MAX_BLOCK_PX : edge < 2 ? 2 : edge;
}

static void sum_pair(const struct exposure_set *e, const size_t pair[2], struct pair_sums *s)
{
    const size_t edge = block_edge(e);
    memset(s, 0, sizeof *s);
    for (size_t y = 0; y + edge <= e->height; y += edge)
        for (size_t x = 0; x + edge <= e->width; x += edge)
            for (size_t c = 0; c < 3; c++) {
                const struct block b = {x, y, x + edge, y + edge, c};
                const size_t group = y * GRID / e->height * GRID + x * GRID / e->width;
                double sum[2][2];
                size_t n[2];
                bool use[2];
                sum_block(e, pair, &b, sum, n, use);
                for (size_t half = 0; half < 2; half++) {
                    if (!use[half]) continue;
                    const double w = weight_of(e, pair, c, sum[1 - half][1], n[1 - half]);
                    s->n_dn[c] += w * (double)n[half];
                    for (size_t j = 0; j < 2; j++) s->light[group][c][half][j] += w * sum[half][j];
                }
            }
}

/* ---- one ratio ---- */

/* Change of ln (shorter / longer) of channel c by part g of the picture: its halves alike (half 0), and against each
 * other (half 1). */
static void influence(const struct pair_sums *s, size_t g, size_t c, const double total[2], double of[2])
{
    const double(*a)[2] = s->light[g][c];
    const double one = a[0][0] / total[0] - a[0][1] / total[1], two = a[1][0] / total[0] - a[1][1] / total[1];
    of[0] = one + two;
    of[1] = one - two;
}

/* Step of the file's values at a mean level, over that level. */
static double relative_step(const struct exposure_set *e, size_t i, double level)
{
    double slope = 1.0; /* of linear by encoded values */
    if (e->full_scale[i] == 1.0 || !(level > 0.0)) return level > 0.0 ? 0.0 : INFINITY;
    if (e->srgb) slope = level <= 0.0031308 ? 1.0 / 12.92 : 2.4 / 1.055 * pow(level, 1.4 / 2.4);
    return slope / (e->full_scale[i] * level);
}

/* Errors of ln ratio of a channel by the uncertain level of black of both exposures. */
static void black_error(const struct exposure_set *e, const size_t pair[2], const double total[2], double n,
                        double error[2])
{
    const double black = e->noise != NULL ? black_known_dn : 0.5;
    for (size_t j = 0; j < 2; j++) {
        const size_t i = pair[j];
        error[j] = black * relative_step(e, i, fmin(1.0, total[j] / n / e->full_scale[i]));
    }
}

/* Sums over the groups of products of influences of channels a and b, and errors that the picture's scatter does not
 * show. */
struct scatter {
    double sum[3][3], noise[3][3]; /* of both halves alike, and of one against the other */
    double black[3][2];            /* errors by the level of black of each exposure, common to the channels */
    size_t n;                      /* groups with light */
};

static void scatter_of(const struct pair_sums *s, double (*total)[2], const bool has[3], struct scatter *k)
{
    memset(k, 0, sizeof *k);
    for (size_t g = 0; g < GROUPS; g++) {
        double of[3][2] = {{0}};
        bool any = false;
        for (size_t c = 0; c < 3; c++) {
            if (!has[c]) continue;
            influence(s, g, c, total[c], of[c]);
            any = any || s->light[g][c][0][1] != 0.0 || s->light[g][c][1][1] != 0.0;
        }
        k->n += any;
        for (size_t a = 0; a < 9; a++) {
            k->sum[a / 3][a % 3] += of[a / 3][0] * of[a % 3][0];
            k->noise[a / 3][a % 3] += of[a / 3][1] * of[a % 3][1];
        }
    }
    const double unbiased = k->n > 1 ? (double)k->n / (double)(k->n - 1) : INFINITY;
    for (size_t a = 0; a < 9; a++) k->sum[a / 3][a % 3] *= unbiased;
}

/* Combines the channels, each by its variance. */
static void combine(struct exposure_pair *r, const bool has[3], const struct scatter *k)
{
    double weight[3] = {0}, all = 0.0, noise = 0.0, scatter = 0.0;
    for (size_t c = 0; c < 3; c++) all += weight[c] = has[c] ? 1.0 / fmax(r->channel_var[c], 1e-12) : 0.0;
    r->value = 0.0;
    for (size_t c = 0; c < 3; c++) weight[c] /= all;
    for (size_t a = 0; a < 3; a++) {
        r->value += weight[a] * r->channel[a];
        for (size_t b = 0; b < 3; b++) {
            scatter += weight[a] * weight[b] * k->sum[a][b];
            noise += weight[a] * weight[b] * k->noise[a][b];
        }
    }
    r->var = scatter;
    for (size_t j = 0; j < 2; j++) {
        double black = 0.0;
        for (size_t c = 0; c < 3; c++) black += weight[c] * k->black[c][j];
        r->var += black * black;
    }
    /* n groups of equal light have each the influence (ratio - mean) / n */
    r->uneven = sqrt(fmax(0.0, scatter - noise) * (double)k->n);
}

static status check_balance(const struct exposure_set *e, const struct exposure_pair *r, const bool has[3],
                            const struct scatter *k, struct error *err)
{
    static const char *const channel[3] = {"red", "green", "blue"};
    const double tolerance = e->srgb ? balance_srgb : balance_linear;
    for (size_t a = 0; a < 3; a++)
        for (size_t b = a + 1; b < 3; b++) {
            if (!has[a] || !has[b]) continue;
            const double d = r->channel[a] - r->channel[b];
            double var = k->sum[a][a] + k->sum[b][b] - 2.0 * k->sum[a][b];
            for (size_t j = 0; j < 2; j++) var += pow(k->black[a][j] - k->black[b][j], 2.0);
            if (fabs(d) <= fmax(tolerance, 5.0 * sqrt(fmax(var, 0.0)))) continue;
            return error_set(
                err, STATUS_INVALID,
                "cannot merge the exposures '%s' and '%s' of one view: the ratio of their light is %.3g in "
                "%s and %.3g in %s, so their colors were balanced differently: save all with one white "
                "balance, or give the raw files",
                e->name[r->shorter], e->name[r->longer], exp(r->channel[a]) * e->t_s[r->shorter] / e->t_s[r->longer],
                channel[a], exp(r->channel[b]) * e->t_s[r->shorter] / e->t_s[r->longer], channel[b]);
        }
    return STATUS_OK;
}

static status compare(const struct exposure_set *e, const size_t pair[2], const struct pair_sums *s,
                      struct exposure_pair *r, struct error *err)
{
    double total[3][2] = {{0}};
    bool has[3], any = false;
    struct scatter k;
    *r = (struct exposure_pair){.shorter = pair[0], .longer = pair[1], .var = INFINITY};
    for (size_t g = 0; g < GROUPS; g++)
        for (size_t i = 0; i < 12; i++) total[i / 4][i % 2] += s->light[g][i / 4][i / 2 % 2][i % 2];
    for (size_t c = 0; c < 3; c++) {
        size_t n_group = 0;
        for (size_t g = 0; g < GROUPS; g++) n_group += s->light[g][c][0][1] != 0.0 || s->light[g][c][1][1] != 0.0;
        has[c] = n_group >= LEAST_GROUPS && total[c][0] > 0.0 && total[c][1] > 0.0;
    }
    scatter_of(s, total, has, &k);
    for (size_t c = 0; c < 3; c++) {
        if (!has[c]) continue;
        black_error(e, pair, total[c], s->n_dn[c], k.black[c]);
        r->channel[c] = log(total[c][0] / total[c][1]) - log(e->t_s[pair[0]] / e->t_s[pair[1]]);
        r->channel_var[c] = k.sum[c][c] + k.black[c][0] * k.black[c][0] + k.black[c][1] * k.black[c][1];
        has[c] = r->channel_var[c] < least_determined * least_determined;
        any = any || has[c];
    }
    if (!any) return STATUS_OK;
    combine(r, has, &k);
    return check_balance(e, r, has, &k, err);
}

/* Order of the exposures by stated time. */
static void sort_by_time(const struct exposure_set *e, size_t order[EXPOSURE_MAX])
{
    for (size_t i = 0; i < e->n; i++) {
        size_t at = i;
        for (; at > 0 && e->t_s[order[at - 1]] > e->t_s[i]; at--) order[at] = order[at - 1];
        order[at] = i;
    }
}

status exposure_pairs_compare(const struct exposure_set *e, struct exposure_pair pair[EXPOSURE_MAX], struct error *err)
{
    size_t order[EXPOSURE_MAX];
    struct pair_sums *sums = malloc(sizeof *sums);
    status s = sums != NULL ? STATUS_OK : error_set(err, STATUS_NO_MEMORY, "cannot merge exposures: out of memory");
    if (s == STATUS_OK) sort_by_time(e, order);
    for (size_t i = 0; i + 1 < e->n && s == STATUS_OK; i++) {
        const size_t two[2] = {order[i], order[i + 1]};
        sum_pair(e, two, sums);
        s = compare(e, two, sums, &pair[i], err);
    }
    free(sums);
    return s;
}
