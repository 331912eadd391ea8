/* Words and numbers in pictures: a 5 x 7 dot font with the few characters that labels of pictures need (parameter
 * names and decimal numbers); others are left blank.
 */
#ifndef SELVEDGE_TESTS_TINY_TEXT_H
#define SELVEDGE_TESTS_TINY_TEXT_H

#include <stddef.h>
#include <stdint.h>

/* Width in pixels at a magnification. */
size_t tiny_text_width(const char *text, size_t scale);
/* Black text into an 8-bit rgb picture, its upper left corner at x, y; what reaches beyond the picture is cut. */
void tiny_text_draw(uint8_t *rgb, size_t width, size_t height, size_t x, size_t y, size_t scale, const char *text);

#endif
