#include "optimizer/photographs/reader/photograph_contrast.h"

#include <math.h>
#include <stdlib.h>

/* Share of pixel i that lies between from and to, in pixels. */
static double overlap(double from, double to, size_t i)
{
    return fmax(0.0, fmin(to, (double)i + 1.0) - fmax(from, (double)i));
}

/* Mean of part (ix, iy); pixels on its edge count with the share that lies inside. */
static double part_mean(const struct image *im, size_t channel, size_t n_cell, size_t ix, size_t iy)
{
    double width = (double)im->width / (double)n_cell, height = (double)im->height / (double)n_cell, sum = 0.0;
    double x0 = width * (double)ix, y0 = height * (double)iy;
    for (size_t y = (size_t)y0; y < im->height && (double)y < y0 + height; y++)
        for (size_t x = (size_t)x0; x < im->width && (double)x < x0 + width; x++)
            sum += overlap(x0, x0 + width, x) * overlap(y0, y0 + height, y) *
                   (double)im->pixel[(y * im->width + x) * im->n_channel + channel];
    return sum / (width * height);
}

status image_contrast(const struct image *im, size_t channel, size_t n_cell, double *contrast, double *se,
                      struct error *err)
{
    size_t n = n_cell * n_cell;
    double *part = malloc((n + 1) * sizeof *part), mean = 0.0, scatter = 0.0;
    *contrast = 0.0;
    *se = 1.0; /* the contrast of a black channel is unknown */
    if (part == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot measure contrast: out of memory");
    for (size_t i = 0; i < n; i++) {
        part[i] = part_mean(im, channel, n_cell, i % n_cell, i / n_cell);
        mean += part[i] / (double)n;
    }
    if (mean > 0.0) {
        for (size_t i = 0; i < n; i++) part[i] = part[i] / mean - 1.0;
        for (size_t i = 0; i < n; i++) *contrast += part[i] * part[i] / (double)(n - 1);
        for (size_t i = 0; i < n; i++) {
            double own = part[i] * part[i] - *contrast * (1.0 + 2.0 * part[i]); /* contribution of the part */
            scatter += own * own;
        }
        *se = sqrt(scatter / ((double)n * (double)(n - 1)));
    }
    free(part);
    return STATUS_OK;
}

status photograph_contrast(const struct image *im, const char *name, size_t n_cell, double contrast_rgb[3],
                           double se_rgb[3], struct error *err)
{
    if (im->width < 2 * n_cell || im->height < 2 * n_cell)
        return error_set(err, STATUS_INVALID,
                         "cannot measure the contrast of photograph '%s': its %zu x %zu pixels leave fewer than 2 x 2 "
                         "for each of %zu x %zu parts",
                         name, im->width, im->height, n_cell, n_cell);
    status s = STATUS_OK;
    for (size_t c = 0; c < 3 && s == STATUS_OK; c++)
        s = image_contrast(im, c, n_cell, &contrast_rgb[c], &se_rgb[c], err);
    return s;
}
