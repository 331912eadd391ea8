#include "optimizer/photographs/camera/marker_board.h"

static void add_corner(struct marker_board *b, size_t x, size_t y, const double upper_left_mm[2],
                       size_t (*marker_of)[MARKER_MAX_CORNER + 2])
{
    size_t found = 0;
    for (size_t k = 0; k < 4; k++) {
        size_t m = marker_of[y - k / 2][x - k % 2];
        if (m != MARKER_MAX) b->corner_marker[b->n_corner][found++] = m;
    }
    b->corner_mm[b->n_corner][0] = upper_left_mm[0] + (double)x * b->square_mm;
    b->corner_mm[b->n_corner][1] = upper_left_mm[1] - (double)y * b->square_mm;
    b->n_corner++;
}

bool marker_board_fill(struct marker_board *b, const size_t squares[2], const double upper_left_mm[2], bool black_first)
{
    size_t marker_of[MARKER_MAX_CORNER + 2][MARKER_MAX_CORNER + 2], n_x = squares[0], n_y = squares[1];
    if (n_x < 3 || n_y < 3 || n_x > MARKER_MAX_CORNER || n_y > MARKER_MAX_CORNER ||
        (n_x - 1) * (n_y - 1) > MARKER_MAX_CORNER || (n_x * n_y + 1) / 2 > MARKER_MAX)
        return false;
    b->n = b->n_corner = 0;
    for (size_t y = 0; y < n_y; y++)
        for (size_t x = 0; x < n_x; x++) {
            bool black = ((x + y) % 2 == 0) == black_first;
            marker_of[y][x] = black ? MARKER_MAX : b->n;
            if (black) continue;
            b->id[b->n] = (int)b->n;
            b->center_mm[b->n][0] = upper_left_mm[0] + ((double)x + 0.5) * b->square_mm;
            b->center_mm[b->n][1] = upper_left_mm[1] - ((double)y + 0.5) * b->square_mm;
            b->n++;
        }
    for (size_t y = 1; y < n_y; y++)
        for (size_t x = 1; x < n_x; x++) add_corner(b, x, y, upper_left_mm, marker_of);
    return true;
}
