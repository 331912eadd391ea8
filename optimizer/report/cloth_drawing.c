#include "optimizer/report/cloth_drawing.h"
#include "geometry/fibers/fiber_view.h"

#include <math.h>
#include <stdlib.h>

enum { DRAWING_WIDTH = 1050, DRAWING_HEIGHT = 700 };

/* Linear value of the brightest channel on the top of the cloth, and the share of light in its depth. */
static const double bright_level = 0.62, deep_share = 0.12;
/* Change of the shade for one level of height a pixel, and its bounds. */
static const double shade_of_slope = 0.11, least_shade = 0.55, most_shade = 1.35;

struct relief {
    const uint8_t *level; /* n[0] * n[1] heights, 0: no fiber; row 0 at y = 0; periodic */
    size_t n[2];
};

static double level_at(const struct relief *r, long x, long y)
{
    const long nx = (long)r->n[0], ny = (long)r->n[1];
    return r->level[(size_t)((y % ny + ny) % ny) * r->n[0] + (size_t)((x % nx + nx) % nx)];
}

/* The mean over 3 x 3 pixels: heights are whole levels, whose steps would be seen as edges. */
static double smooth_level(const struct relief *r, long x, long y)
{
    double sum = 0.0;
    for (long b = -1; b <= 1; b++)
        for (long a = -1; a <= 1; a++) sum += level_at(r, x + a, y + b);
    return sum / 9.0;
}

/* Returns the brightness at a pixel: less in the depth of the cloth, more on slopes towards the upper left. */
static double brightness(const struct relief *r, long x, long y)
{
    const double height = smooth_level(r, x, y) / 255.0,
                 slope = (smooth_level(r, x + 1, y) - smooth_level(r, x - 1, y) - smooth_level(r, x, y + 1) +
                          smooth_level(r, x, y - 1)) /
                         4.0,
                 shade = fmin(fmax(1.0 + shade_of_slope * slope, least_shade), most_shade);
    return (deep_share + (1.0 - deep_share) * height * height) * shade;
}

static uint8_t srgb_byte(double linear)
{
    const double v = fmin(fmax(linear, 0.0), 1.0);
    return (uint8_t)lround(255.0 * (v <= 0.0031308 ? 12.92 * v : 1.055 * pow(v, 1.0 / 2.4) - 0.055));
}

status cloth_drawing(const struct report *report, const double color[3], uint8_t **rgb, size_t *width, size_t *height,
                     struct error *err)
{
    const struct fiber_set *f = &report->in.made->fiber;
    const double brightest = fmax(fmax(color[0], color[1]), fmax(color[2], 1e-9));
    struct relief r;
    uint8_t *level = NULL;
    double cover;
    status s = fiber_top_view(f, fmax(f->tile_size_m[0], f->tile_size_m[1]) / DRAWING_HEIGHT, r.n, &level, &cover, err);
    if (s != STATUS_OK) return s;
    r.level = level;
    *width = DRAWING_WIDTH;
    *height = DRAWING_HEIGHT;
    *rgb = malloc((size_t)3 * DRAWING_WIDTH * DRAWING_HEIGHT);
    if (*rgb == NULL) {
        free(level);
        return error_set(err, STATUS_NO_MEMORY, "cannot draw the cloth: out of memory");
    }
    for (long y = 0; y < DRAWING_HEIGHT; y++)
        for (long x = 0; x < DRAWING_WIDTH; x++) {
            const double light = brightness(&r, x, DRAWING_HEIGHT - 1 - y) * bright_level / brightest;
            for (int c = 0; c < 3; c++) (*rgb)[3 * (y * DRAWING_WIDTH + x) + c] = srgb_byte(light * color[c]);
        }
    free(level);
    return STATUS_OK;
}
