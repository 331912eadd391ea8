#include "geometry/fibers/slices/pixel_bits.h"

#include <string.h>

/* The same along the row only. */
static void widen_row(const uint8_t *bits, size_t n_byte, unsigned reach, uint8_t *wide)
{
    for (size_t b = 0; b < n_byte; b++) {
        const uint32_t before = b > 0 ? bits[b - 1] : 0, after = b + 1 < n_byte ? bits[b + 1] : 0;
        const uint32_t around = before | (uint32_t)bits[b] << 8 | after << 16;
        uint32_t near = around;
        for (unsigned t = 1; t <= reach && around != 0; t++) near |= around << t | around >> t;
        wide[b] = (uint8_t)(near >> 8);
    }
}

static void add_row(uint8_t *restrict to, const uint8_t *restrict from, size_t n_byte)
{
    for (size_t b = 0; b < n_byte; b++) to[b] |= from[b];
}

void pixel_bits_near(const uint8_t *bits, size_t pitch, size_t n_byte, size_t height, unsigned reach, uint8_t *work,
                     uint8_t *near)
{
    for (size_t v = 0; v < height; v++) widen_row(bits + v * pitch, n_byte, reach, work + v * n_byte);
    memset(near, 0, n_byte * height);
    for (size_t v = 0; v < height; v++)
        for (size_t r = v > reach ? v - reach : 0; r <= v + reach && r < height; r++)
            add_row(near + v * n_byte, work + r * n_byte, n_byte);
}
