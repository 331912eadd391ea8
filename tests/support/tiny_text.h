/* Text in pictures: a 5 x 7 dot font with the characters of parameter names and decimal numbers. Other characters
 * are drawn as blanks. */
#ifndef SELVEDGE_TESTS_TINY_TEXT_H
#define SELVEDGE_TESTS_TINY_TEXT_H

#include <stddef.h>
#include <stdint.h>

/* Returns the width in pixels at a magnification. */
size_t tiny_text_width(const char *text, size_t scale);
/* Draws black text into an 8-bit RGB picture with its upper left corner at x, y. Text outside of the
 * picture is not drawn. */
void tiny_text_draw(uint8_t *rgb, size_t width, size_t height, size_t x, size_t y, size_t scale, const char *text);

#endif
