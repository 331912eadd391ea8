/* Markers around a sample: which ones, how large, and where they lie on the plane of the cloth. */
#ifndef SELVEDGE_OPTIMIZER_MARKER_BOARD_H
#define SELVEDGE_OPTIMIZER_MARKER_BOARD_H

#include <stddef.h>

enum { MARKER_MAX = 64 };

struct marker_board {
    size_t n; /* 0: none */
    char dictionary[32];
    double side_mm; /* edge of the black square */
    int id[MARKER_MAX];
    double center_mm[MARKER_MAX][2]; /* from the orbit center; the upper edge of the drawing points to +y, the warp */
};

#endif
