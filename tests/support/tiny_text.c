#include "tests/support/tiny_text.h"

#include <string.h>

enum { COLUMNS = 5, ROWS = 7 };

/* Rows from the top, with five dots each; the highest bit is the leftmost dot. */
static const struct {
    char character;
    uint8_t row[ROWS];
} font[] = {
    {'0', {14, 17, 19, 21, 25, 17, 14}}, {'1', {4, 12, 4, 4, 4, 4, 14}},      {'2', {14, 17, 1, 2, 4, 8, 31}},
    {'3', {31, 2, 4, 2, 1, 17, 14}},     {'4', {2, 6, 10, 18, 31, 2, 2}},     {'5', {31, 16, 30, 1, 1, 17, 14}},
    {'6', {6, 8, 16, 30, 17, 17, 14}},   {'7', {31, 1, 2, 4, 8, 8, 8}},       {'8', {14, 17, 17, 14, 17, 17, 14}},
    {'9', {14, 17, 17, 15, 1, 2, 12}},   {'-', {0, 0, 0, 31, 0, 0, 0}},       {'+', {0, 4, 4, 31, 4, 4, 0}},
    {'.', {0, 0, 0, 0, 0, 12, 12}},      {'/', {0, 1, 2, 4, 8, 16, 0}},       {'_', {0, 0, 0, 0, 0, 0, 31}},
    {'C', {14, 17, 16, 16, 16, 17, 14}}, {'R', {30, 17, 17, 30, 20, 18, 17}}, {'T', {31, 4, 4, 4, 4, 4, 4}},
    {'a', {0, 0, 14, 1, 15, 17, 15}},    {'b', {16, 16, 22, 25, 17, 17, 30}}, {'d', {1, 1, 13, 19, 17, 17, 15}},
    {'e', {0, 0, 14, 17, 31, 16, 14}},   {'g', {0, 15, 17, 17, 15, 1, 14}},   {'i', {4, 0, 12, 4, 4, 4, 14}},
    {'m', {0, 0, 26, 21, 21, 17, 17}},   {'n', {0, 0, 22, 25, 17, 17, 17}},   {'r', {0, 0, 22, 25, 16, 16, 16}},
    {'t', {8, 8, 28, 8, 8, 9, 6}},
};

static const uint8_t *rows_of(char c)
{
    for (size_t i = 0; i < sizeof font / sizeof font[0]; i++)
        if (font[i].character == c) return font[i].row;
    return NULL;
}

size_t tiny_text_width(const char *text, size_t scale)
{
    size_t n = strlen(text);
    return n > 0 ? scale * (n * (COLUMNS + 1) - 1) : 0;
}

void tiny_text_draw(uint8_t *rgb, size_t width, size_t height, size_t x, size_t y, size_t scale, const char *text)
{
    for (; *text != '\0'; text++, x += scale * (COLUMNS + 1)) {
        const uint8_t *row = rows_of(*text);
        for (size_t i = 0; row != NULL && i < scale * ROWS; i++)
            for (size_t j = 0; j < scale * COLUMNS; j++)
                if ((row[i / scale] >> (COLUMNS - 1 - j / scale) & 1) != 0 && y + i < height && x + j < width)
                    memset(rgb + 3 * ((y + i) * width + x + j), 0, 3);
    }
}
