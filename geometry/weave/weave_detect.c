#include "geometry/weave/weave_detect.h"
#include "base/angle.h"

#include "geometry/vision/vision.h"
#include "geometry/vision/vision_texture.h"
#include "geometry/weave/weave_measure.h"

#include <math.h>
#include <stdlib.h>

/* EDGE_PX: largest edge of the picture that is analysed. FIRST_FLATTEN_PX: reach of the first flattening; the second
 * reach follows from the repeat. LATTICE_GAIN: logarithm of the odds for a nat of a lattice's information, about the
 * number of its peaks. WORTH: share of the best lattice's information from which others are tried, too. */
enum { EDGE_PX = 1024, MULTIPLE_PX = 16 };
static const double FIRST_FLATTEN_PX = 12.0, LATTICE_GAIN = 10.0, WORTH = 0.8;

/* A piece of a photograph in its working size. */
struct piece {
    struct weave_picture picture; /* owns its pixels */
    double px;                    /* pixels of the photograph in one of the piece */
    double corner_px[2];          /* of the piece, in the photograph */
    float *grey, *flat, *power, *background;
};

static void piece_release(struct piece *p)
{
    free((void *)p->picture.rgb);
    free(p->grey);
    free(p->flat);
    free(p->power);
    free(p->background);
}

/* Averages shrink x shrink pixels of the middle of the picture into one. */
static status piece_init(struct piece *p, const struct weave_picture *from, size_t shrink, struct error *err)
{
    size_t width = from->width / shrink, height = from->height / shrink;
    width = (width < EDGE_PX ? width : EDGE_PX) / MULTIPLE_PX * MULTIPLE_PX;
    height = (height < EDGE_PX ? height : EDGE_PX) / MULTIPLE_PX * MULTIPLE_PX;
    size_t n = width * height, x0 = (from->width - width * shrink) / 2, y0 = (from->height - height * shrink) / 2;
    float *rgb = calloc(3 * n, sizeof *rgb);
    *p = (struct piece){.picture = {rgb, width, height}, .px = (double)shrink, .corner_px = {(double)x0, (double)y0}};
    p->grey = calloc(n, sizeof *p->grey);
    p->flat = malloc(n * sizeof *p->flat);
    p->power = malloc(n * sizeof *p->power);
    p->background = malloc(n * sizeof *p->background);
    if (rgb == NULL || p->grey == NULL || p->flat == NULL || p->power == NULL || p->background == NULL)
        return error_set(err, STATUS_NO_MEMORY, "cannot analyse texture: out of memory");
    float share = 1.0f / (float)(shrink * shrink);
    for (size_t y = 0; y < height * shrink; y++)
        for (size_t x = 0; x < width * shrink; x++)
            for (size_t c = 0; c < 3; c++) {
                size_t to = y / shrink * width + x / shrink;
                float v = from->rgb[((y0 + y) * from->width + x0 + x) * 3 + c] * share;
                rgb[3 * to + c] += v;
                p->grey[to] += v / 3.0f;
            }
    return STATUS_OK;
}

/* Results of the search in a piece. */
struct finding {
    struct weave_lattice lattice[WEAVE_LATTICE_MAX];
    size_t n_lattice, i_best; /* i_best: the lattice of the best draft */
    struct weave_streaks streaks;
    struct weave_draft draft;
};

static status find_lattices(struct piece *p, double flatten_px, struct finding *f, struct error *err)
{
    struct weave_peak peak[WEAVE_PEAK_MAX];
    size_t n_peak, width = p->picture.width, height = p->picture.height;
    double resolution = 1.0 / (double)(width < height ? width : height);
    status s = vision_flatten(p->grey, width, height, flatten_px, p->flat, err);
    if (s == STATUS_OK) s = vision_spectrum(p->flat, width, height, p->power, p->background, err);
    if (s == STATUS_OK) s = weave_find_peaks(p->power, p->background, width, height, peak, &n_peak, err);
    if (s == STATUS_OK) s = weave_find_lattices(peak, n_peak, resolution, f->lattice, &f->n_lattice, err);
    if (s == STATUS_OK) weave_measure_streaks(p->power, p->background, width, height, &f->streaks);
    return s;
}

static double longest_shift_px(const struct weave_lattice *l)
{
    return fmax(hypot(l->shift_px[0][0], l->shift_px[0][1]), hypot(l->shift_px[1][0], l->shift_px[1][1]));
}

static status find_draft(const struct piece *p, struct finding *f, struct error *err)
{
    status s = STATUS_OK;
    f->draft.score = -INFINITY;
    for (size_t i = 0; s == STATUS_OK && i < f->n_lattice; i++) {
        if (f->lattice[i].information < WORTH * f->lattice[0].information) continue;
        struct weave_repeat repeat;
        double before = f->draft.score, bonus = LATTICE_GAIN * (f->lattice[i].information - f->lattice[0].information);
        s = weave_average_repeat(p->flat, p->picture.width, p->picture.height, &f->lattice[i], &repeat, err);
        if (s == STATUS_NOT_FOUND) {
            s = STATUS_OK; /* another lattice may do */
            continue;
        }
        if (s == STATUS_OK) s = weave_search_draft(&f->lattice[i], &repeat, &f->streaks, bonus, &f->draft, err);
        if (f->draft.score > before) f->i_best = i;
        weave_repeat_release(&repeat);
    }
    if (s == STATUS_OK && f->draft.score == -INFINITY)
        s = error_set(err, STATUS_NOT_FOUND,
                      "the texture of the photograph is not that of two sets of yarns that cross");
    return s;
}

/* A drawing that explains less than this share of the averaged repeat does not resemble the photograph; that it is
 * better than other drawings then tells less about the yarns, and little about the draft. Drawn pictures keep more,
 * renderings of described cloths 0.02 to 0.4, and most of their drafts come out wrong
 * (docs/weave-detection.md). */
static const double RESEMBLING = 0.5;

static double odds_to_confidence(double score, double other) { return 1.0 / (1.0 + exp(fmin(50.0, other - score))); }

static double modulo_deg(double deg, double from) { return deg - 180.0 * floor((deg - from) / 180.0); }

/* Turns the finding in a piece into pixels of the photograph. */
static void fill_guess(const struct piece *p, const struct finding *f, struct weave_guess *g)
{
    g->draft = f->draft;
    for (int a = 0; a < 2; a++) {
        g->draft.f_warp[a] /= p->px;
        g->draft.f_weft[a] /= p->px;
        g->draft.step_warp_px[a] *= p->px;
        g->draft.step_weft_px[a] *= p->px;
        g->draft.origin_px[a] *= p->px;
    }
    const struct weave_draft *d = &g->draft;
    const double *line = f->lattice[f->i_best].f[0];
    g->spacing_px[0] = 1.0 / hypot(d->f_warp[0], d->f_warp[1]);
    g->spacing_px[1] = 1.0 / hypot(d->f_weft[0], d->f_weft[1]);
    g->direction_deg[0] = modulo_deg(angle_to_deg(atan2(d->step_weft_px[1], d->step_weft_px[0])), -45.0);
    g->direction_deg[1] = modulo_deg(angle_to_deg(atan2(d->step_warp_px[1], d->step_warp_px[0])), -90.0);
    g->texture_period_px = p->px / hypot(line[0], line[1]);
    double explained = fmax(0.0, 1.0 - d->residual), odds = odds_to_confidence(d->score, d->score_other_yarns);
    g->yarns_confidence = odds * fmin(1.0, RESEMBLING + explained);
    g->draft_confidence = odds * odds_to_confidence(d->score, d->score_other_draft) * fmin(1.0, explained / RESEMBLING);
}

/* Where the crossing of warp 0 and weft 0 is in the photograph. A pixel counts at its center. */
static void fill_middle(const struct piece *p, const struct finding *f, const struct weave_repeat *repeat,
                        struct weave_guess *g)
{
    double at_px[2];
    weave_repeat_middle(repeat, &f->lattice[f->i_best], at_px);
    for (int a = 0; a < 2; a++) g->middle_px[a] = p->px * (at_px[a] + f->draft.origin_px[a] + 0.5) + p->corner_px[a];
}

static status detect_in(struct piece *p, struct weave_guess *guess, struct error *err)
{
    struct finding f = {.n_lattice = 0};
    struct weave_repeat repeat;
    status s = find_lattices(p, FIRST_FLATTEN_PX, &f, err);
    if (s != STATUS_OK) return s;
    double reach_px = longest_shift_px(&f.lattice[0]);
    if (reach_px > FIRST_FLATTEN_PX) s = find_lattices(p, reach_px, &f, err);
    if (s == STATUS_OK) s = find_draft(p, &f, err);
    if (s != STATUS_OK) return s;
    s = weave_average_repeat(p->flat, p->picture.width, p->picture.height, &f.lattice[f.i_best], &repeat, err);
    if (s != STATUS_OK) return s;
    fill_guess(p, &f, guess);
    fill_middle(p, &f, &repeat, guess);
    s = weave_measure_yarns(&p->picture, &f.draft, &repeat, guess, err);
    weave_repeat_release(&repeat);
    if (s != STATUS_OK) return s;
    return weave_contrast(p->grey, p->picture.width, p->picture.height, guess->texture_period_px / p->px,
                          guess->contrast, err);
}

static status detect_at(const struct weave_picture *picture, size_t shrink, struct weave_guess *guess,
                        struct error *err)
{
    struct piece p;
    status s = piece_init(&p, picture, shrink, err);
    if (s == STATUS_OK) s = detect_in(&p, guess, err);
    piece_release(&p);
    return s;
}

status weave_detect(const struct weave_picture *picture, struct weave_guess *guess, struct error *err)
{
    size_t longest = picture->width > picture->height ? picture->width : picture->height;
    if (picture->width < 64 || picture->height < 64)
        return error_set(err, STATUS_INVALID, "cannot find a weave in %zu x %zu pixels: it takes 64 x 64",
                         picture->width, picture->height);
    status s = vision_init(err);
    if (s != STATUS_OK) return s;
    s = detect_at(picture, 1, guess, err);
    if (longest <= EDGE_PX || (s != STATUS_OK && s != STATUS_NOT_FOUND)) return s;
    /* yarns of a large photograph may be too wide for a piece at full size */
    struct weave_guess small;
    status t = detect_at(picture, (longest + EDGE_PX - 1) / EDGE_PX, &small, s == STATUS_OK ? NULL : err);
    if (t == STATUS_OK && (s != STATUS_OK || small.draft.score > guess->draft.score)) *guess = small;
    return s == STATUS_OK ? s : t;
}
