#include "renderer/image/tone_curve.h"

#include <math.h>

void tone_curve_apply(double rgb[3])
{
    const double start = 0.8 - 0.04, desaturation = 0.15, room = 1.0 - start;
    const double least = fmin(rgb[0], fmin(rgb[1], rgb[2]));
    const double glare = least < 0.08 ? least - 6.25 * least * least : 0.04;
    for (int c = 0; c < 3; c++) rgb[c] -= glare;
    const double peak = fmax(rgb[0], fmax(rgb[1], rgb[2]));
    if (!(peak >= start)) return;
    const double lowered = 1.0 - room * room / (peak + room - start);
    const double white = 1.0 - 1.0 / (desaturation * (peak - lowered) + 1.0);
    for (int c = 0; c < 3; c++) rgb[c] = (1.0 - white) * rgb[c] * lowered / peak + white * lowered;
}

static double srgb_of(double linear)
{
    return linear <= 0.0031308 ? 12.92 * linear : 1.055 * pow(linear, 1.0 / 2.4) - 0.055;
}

/* A number in [0, 1) from a place and a channel: the upper bits of a product of odd numbers (Steele et al. 2014). */
static double dither_at(size_t i, size_t c)
{
    uint64_t h = (uint64_t)(3 * i + c + 1) * 0x9e3779b97f4a7c15u;
    h = (h ^ (h >> 30)) * 0xbf58476d1ce4e5b9u;
    h = (h ^ (h >> 27)) * 0x94d049bb133111ebu;
    return (double)((h ^ (h >> 31)) >> 11) * 0x1p-53;
}

void tone_curve_bytes(const struct image *im, double exposure, uint8_t *rgb)
{
    for (size_t i = 0; i < im->width * im->height; i++) {
        double color[3];
        for (size_t c = 0; c < 3; c++) {
            const double v = (double)im->pixel[i * im->n_channel + c] * exposure;
            color[c] = v > 0.0 ? fmin(v, 1e6) : 0.0; /* NaN too */
        }
        tone_curve_apply(color);
        for (size_t c = 0; c < 3; c++) {
            const double byte = 255.0 * srgb_of(fmax(color[c], 0.0)) + dither_at(i, c);
            rgb[3 * i + c] = byte < 255.0 ? (uint8_t)byte : 255;
        }
    }
}
