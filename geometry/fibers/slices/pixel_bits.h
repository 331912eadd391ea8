/* Sets of pixels of a picture, a bit for each: pixel u of a row is bit u % 8 of its byte u / 8. */
#ifndef SELVEDGE_GEOMETRY_PIXEL_BITS_H
#define SELVEDGE_GEOMETRY_PIXEL_BITS_H

#include <stddef.h>
#include <stdint.h>

/* Finds the pixels that have one of a set within `reach` (at most 8) along both axes. bits: rows of n_byte bytes that
 * lie `pitch` bytes apart. work, near: n_byte x height bytes. Bits beyond the end of a row may be set too. */
void pixel_bits_near(const uint8_t *bits, size_t pitch, size_t n_byte, size_t height, unsigned reach, uint8_t *work,
                     uint8_t *near);

#endif
