/* Light as a linear function of guides in square windows around each pixel (guided filter of He, Sun and Tang 2010,
 * with several guides), for a tile of a picture. Windows of more than 9 pixels are made of cells of several pixels, and
 * there is one in each cell, between which functions are linear. */
#ifndef SELVEDGE_RENDERER_WINDOW_REGRESSION_H
#define SELVEDGE_RENDERER_WINDOW_REGRESSION_H

#include <stdbool.h>
#include <stddef.h>

enum { REGRESSION_GUIDE = 14, REGRESSION_VALUE = 6, REGRESSION_TILE = 128, REGRESSION_REACH = 4 };

/* A picture in planes: pixel i of plane k is plane[k][i], row by row. */
struct regression_input {
    size_t width, height;
    float *guide[REGRESSION_GUIDE]; /* of about unit variance over the picture */
    float *value[REGRESSION_VALUE];
};

/* Room for one thread: floats. */
size_t regression_scratch(void);
/* Writes to out[REGRESSION_VALUE] planes of the whole picture, in the tile of REGRESSION_TILE cells a side that begins
 * at pixel (x0, y0), a multiple of these: of each value the mean of the functions fitted in all windows that hold the
 * pixel. A cell is so many pixels a side, and a window reaches REGRESSION_REACH cells to each side of one. */
void regression_tile(const struct regression_input *in, size_t cell, size_t x0, size_t y0, float *scratch,
                     float *const *out);
/* plane[i] becomes the mean over the pixels of its window; temporary: width x height. */
void regression_box(float *plane, size_t width, size_t height, size_t reach, float *temporary);

#endif
