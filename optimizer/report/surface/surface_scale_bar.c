#include "optimizer/report/surface/surface_scale_bar.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

enum { LEAST_PX = 128, GLYPH_WIDTH = 5, GLYPH_HEIGHT = 7 };

/* Rows of a letter from above, the left column in bit 4. */
static const struct glyph {
    char letter;
    uint8_t row[GLYPH_HEIGHT];
} glyph[] = {
    {'0', {14, 17, 17, 17, 17, 17, 14}}, {'1', {4, 12, 4, 4, 4, 4, 14}}, {'2', {14, 17, 1, 2, 4, 8, 31}},
    {'5', {31, 16, 30, 1, 1, 17, 14}},   {'.', {0, 0, 0, 0, 0, 12, 12}}, {'m', {0, 0, 26, 21, 21, 21, 21}},
};

struct canvas {
    uint8_t *rgb;
    size_t px;
};

static void fill(const struct canvas *c, size_t x0, size_t y0, size_t width, size_t height, uint8_t value)
{
    for (size_t y = y0; y < y0 + height && y < c->px; y++)
        for (size_t x = x0; x < x0 + width && x < c->px; x++) memset(c->rgb + 3 * (y * c->px + x), value, 3);
}

static void write_text(const struct canvas *c, const char *text, size_t x, size_t y, size_t dot, uint8_t value)
{
    for (; *text != '\0'; text++, x += (GLYPH_WIDTH + 1) * dot)
        for (size_t k = 0; k < sizeof glyph / sizeof *glyph; k++)
            for (size_t row = 0; glyph[k].letter == *text && row < GLYPH_HEIGHT; row++)
                for (size_t column = 0; column < GLYPH_WIDTH; column++)
                    if ((glyph[k].row[row] >> (GLYPH_WIDTH - 1 - column) & 1) != 0)
                        fill(c, x + column * dot, y + row * dot, dot, dot, value);
}

/* The longest of 1, 2 and 5 times a power of ten below `most`. */
static double round_length(double most)
{
    const double ten = pow(10.0, floor(log10(most))), times = most / ten;
    return ten * (times >= 5.0 ? 5.0 : times >= 2.0 ? 2.0 : 1.0);
}

void surface_scale_bar_draw(uint8_t *rgb, size_t px, double width_mm)
{
    if (px < LEAST_PX) return;
    const struct canvas c = {rgb, px};
    const double length_mm = round_length(0.25 * width_mm);
    const size_t length = (size_t)lrint(length_mm / width_mm * (double)px), dot = 1 + px / 512, x = px / 24;
    const size_t text_y = px - px / 24 - GLYPH_HEIGHT * dot, y = text_y - 5 * dot;
    char text[32];
    snprintf(text, sizeof text, "%g mm", length_mm);
    fill(&c, x - dot, y - dot, length + 2 * dot, 4 * dot, 255);
    fill(&c, x, y, length, 2 * dot, 20);
    for (int shift = 0; shift < 4; shift++) /* a light edge all around */
        write_text(&c, text, x + (shift % 2 == 0 ? 0 : 2 * dot) - dot / 2, text_y + (shift / 2 == 0 ? 0 : dot), dot,
                   255);
    write_text(&c, text, x + dot - dot / 2, text_y, dot, 20);
}
