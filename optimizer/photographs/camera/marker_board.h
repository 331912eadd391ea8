/* Markers around a sample: which ones, how large, and where they lie on the plane of the cloth. A ChArUco board is a
 * chessboard with the markers 0, 1, 2, ... in its white squares, row by row from the upper left; the corners between
 * its squares are found more exactly than the corners of markers. */
#ifndef SELVEDGE_OPTIMIZER_MARKER_BOARD_H
#define SELVEDGE_OPTIMIZER_MARKER_BOARD_H

#include <stdbool.h>
#include <stddef.h>

enum { MARKER_MAX = 64, MARKER_MAX_CORNER = 128 };

struct marker_board {
    size_t n; /* 0: none */
    char dictionary[32];
    double side_mm; /* edge of the black square */
    int id[MARKER_MAX];
    double center_mm[MARKER_MAX][2]; /* from the orbit center; the upper edge of the drawing points to +y, the warp */
    /* of a ChArUco board; else 0 corners */
    double square_mm;
    size_t n_corner;
    double corner_mm[MARKER_MAX_CORNER][2]; /* inner corners of the chessboard */
    size_t corner_marker[MARKER_MAX_CORNER]
                        [2]; /* the two markers (indices of id) in the white squares that meet there */
};

/* Fills in markers and corners of a ChArUco board of squares[0] x squares[1] squares whose upper left outer corner
 * is at upper_left_mm; black_first: the upper left square is black. Returns false, and leaves the board as it is,
 * for boards of fewer than 3 x 3 squares and of more than MARKER_MAX markers or MARKER_MAX_CORNER corners. */
bool marker_board_fill(struct marker_board *b, const size_t squares[2], const double upper_left_mm[2],
                       bool black_first);

#endif
