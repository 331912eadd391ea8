#include "optimizer/tools/phantom/weave_overlay.h"

#include "renderer/image/image.h"

#include <math.h>
#include <stdlib.h>

/* EDGE: of a piece in the picture, in its pixels. */
enum { EDGE = 720, GAP = 16, LEAST_LINE_DISTANCE = 12 };
static const double REPEATS = 5.0, LINE_WIDTH = 1.0, MARK_RADIUS = 0.28, SPREAD = 2.5;

struct overlay {
    const struct weave_picture *picture;
    const struct weave_guess *guess;
    double enlarge, corner_px[2];     /* of the piece, in the photograph */
    double mean_rgb[3], sd;           /* of the piece */
    bool rarer_is_warp, draw_line[2]; /* [0] through warps, [1] through wefts */
};

static void pixel(const struct overlay *o, double x_px, double y_px, double rgb[3])
{
    const struct weave_picture *p = o->picture;
    double at[2] = {fmin(fmax(x_px - 0.5, 0.0), (double)p->width - 1.001),
                    fmin(fmax(y_px - 0.5, 0.0), (double)p->height - 1.001)};
    size_t x = (size_t)at[0], y = (size_t)at[1];
    double u = at[0] - (double)x, v = at[1] - (double)y;
    for (size_t c = 0; c < 3; c++) {
        const float *q = p->rgb + (y * p->width + x) * 3 + c;
        rgb[c] = (1.0 - v) * ((1.0 - u) * (double)q[0] + u * (double)q[3]) +
                 v * ((1.0 - u) * (double)q[3 * p->width] + u * (double)q[3 * p->width + 3]);
    }
}

static void overlay_init(struct overlay *o, const struct weave_picture *picture, const struct weave_guess *g)
{
    double longest_px = fmax(g->spacing_px[0] * (double)g->draft.n_warp, g->spacing_px[1] * (double)g->draft.n_weft);
    double square = 0.0, grey_mean = 0.0;
    size_t n_up = 0, n = g->draft.n_warp * g->draft.n_weft;
    for (size_t k = 0; k < n; k++) n_up += g->draft.warp_on_top[k];
    *o = (struct overlay){.picture = picture, .guess = g, .rarer_is_warp = 2 * n_up < n};
    o->enlarge = EDGE / fmin(REPEATS * longest_px, fmin((double)picture->width, (double)picture->height));
    for (int a = 0; a < 2; a++) {
        o->corner_px[a] = g->middle_px[a] - 0.5 * EDGE / o->enlarge;
        o->draw_line[a] = g->spacing_px[a] * o->enlarge > LEAST_LINE_DISTANCE;
    }
    for (int k = 0; k < EDGE * EDGE; k++) {
        double rgb[3];
        pixel(o, o->corner_px[0] + (k % EDGE) / o->enlarge, o->corner_px[1] + (k / EDGE) / o->enlarge, rgb);
        double grey = (rgb[0] + rgb[1] + rgb[2]) / 3.0;
        for (int c = 0; c < 3; c++) o->mean_rgb[c] += rgb[c] / (EDGE * EDGE);
        grey_mean += grey / (EDGE * EDGE);
        square += grey * grey / (EDGE * EDGE);
    }
    o->sd = sqrt(fmax(square - grey_mean * grey_mean, 1e-20));
}

/* Distance of v from the nearest whole number. */
static double off_whole(double v) { return fabs(v - round(v)); }

/* Draws lines and marks over the color of a place. */
static void draw_weave(const struct overlay *o, double x_px, double y_px, double rgb[3])
{
    static const double line[3] = {1.0, 1.0, 1.0}, warp[3] = {1.0, 0.45, 0.0}, weft[3] = {0.1, 0.45, 1.0};
    const struct weave_draft *d = &o->guess->draft;
    double p[2] = {x_px - o->guess->middle_px[0], y_px - o->guess->middle_px[1]};
    double u = d->f_warp[0] * p[0] + d->f_warp[1] * p[1], v = d->f_weft[0] * p[0] + d->f_weft[1] * p[1];
    double distance[2] = {off_whole(u) * o->guess->spacing_px[0] * o->enlarge,
                          off_whole(v) * o->guess->spacing_px[1] * o->enlarge};
    const double *color = NULL;
    double share = 0.5;
    for (int a = 0; a < 2; a++)
        if (o->draw_line[a] && distance[a] < LINE_WIDTH) color = line;
    long i = lround(u), j = lround(v), n_warp = (long)d->n_warp, n_weft = (long)d->n_weft;
    bool up = d->warp_on_top[((j % n_weft + n_weft) % n_weft) * n_warp + (i % n_warp + n_warp) % n_warp] != 0;
    double radius = MARK_RADIUS * o->enlarge * fmax(o->guess->spacing_px[0], o->guess->spacing_px[1]);
    if (up == o->rarer_is_warp && fabs(hypot(distance[0], distance[1]) - radius) < LINE_WIDTH + 0.5) {
        color = up ? warp : weft;
        share = 0.8;
    }
    for (int c = 0; color != NULL && c < 3; c++) rgb[c] = (1.0 - share) * rgb[c] + share * color[c];
}

static void draw_piece(const struct overlay *o, bool with_weave, struct image *im, size_t x0)
{
    for (size_t y = 0; y < EDGE; y++)
        for (size_t x = 0; x < EDGE; x++) {
            double at_px[2] = {o->corner_px[0] + (double)x / o->enlarge, o->corner_px[1] + (double)y / o->enlarge};
            double rgb[3], shown[3];
            pixel(o, at_px[0], at_px[1], rgb);
            double grey = (rgb[0] + rgb[1] + rgb[2] - o->mean_rgb[0] - o->mean_rgb[1] - o->mean_rgb[2]) / 3.0;
            double light = 0.25 * (1.0 + fmin(fmax(grey / (SPREAD * o->sd), -0.95), 1.5));
            double mean = (o->mean_rgb[0] + o->mean_rgb[1] + o->mean_rgb[2]) / 3.0;
            for (int c = 0; c < 3; c++) shown[c] = light * o->mean_rgb[c] / fmax(mean, 1e-20);
            if (with_weave) draw_weave(o, at_px[0], at_px[1], shown);
            for (size_t c = 0; c < 3; c++) im->pixel[(y * im->width + x0 + x) * 3 + c] = (float)shown[c];
        }
}

status weave_overlay_write(const struct weave_picture *picture, const struct weave_guess *guess, const char *path,
                           struct error *err)
{
    struct overlay o;
    struct image im;
    overlay_init(&o, picture, guess);
    status s = image_init(&im, 2 * EDGE + GAP, EDGE, 3, err);
    if (s != STATUS_OK) return s;
    for (size_t i = 0; i < 3 * im.width * im.height; i++) im.pixel[i] = 1.0f;
    draw_piece(&o, false, &im, 0);
    draw_piece(&o, true, &im, EDGE + GAP);
    s = image_write_png(&im, 1.0, path, err);
    image_release(&im);
    return s;
}
