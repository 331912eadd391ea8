/* Drawings of woven cloth in the frequency domain: the appearance of a draft's repeat. A crossing is a unit square in
 * yarn coordinates (warps along x, wefts along y), with either the warp or the weft on top. The drawing is a sum of
 * seven shapes with free brightness:
 *
 *   0     the difference between warp and weft
 *   1, 2  the rounding of a warp and of a weft across, cos(2 pi x)
 *   3, 4  the bow of a float of warp and of weft along, sin(pi t), t from 0 at one end of the float to 1 at the other
 *   5, 6  their slant, sin(2 pi x) cos(pi t): fibers are twisted, and highlights lie aslant
 *
 * The bow spans the whole float; this alone makes a float of three crossings differ from three single ones. */
#ifndef SELVEDGE_GEOMETRY_WEAVE_DRAWING_H
#define SELVEDGE_GEOMETRY_WEAVE_DRAWING_H

#include <complex.h>
#include <stdbool.h>
#include <stddef.h>

enum { WEAVE_CELL_MAX = 8, WEAVE_SHAPES = 7 };

/* The crossings of a weave that differ. i: warp, j: weft; both repeat after n_cell at the latest. */
struct weave_cells {
    size_t n_cell;
    size_t number[WEAVE_CELL_MAX][WEAVE_CELL_MAX]; /* [j][i]: which of the n_cell a crossing is */
    int place[WEAVE_CELL_MAX][2];                  /* one crossing (i, j) of each */
    size_t n_warp, n_weft;                         /* smallest rectangle of yarns that repeats */
};

/* index_warp, index_weft: whole-number combinations of a lattice's basis that are the frequencies of the yarns. Their
 * determinant, positive or negative, is the number of cells. False if that is not 2 to WEAVE_CELL_MAX. */
bool weave_cells_init(struct weave_cells *c, const int index_warp[2], const int index_weft[2]);

/* Whether bit `number` of pattern (1: warp on top) leaves no yarn on one side all along. */
bool weave_pattern_holds(const struct weave_cells *c, unsigned pattern);

/* Parts that make up the shapes of all patterns, at one frequency (a, b) in cycles per yarn. [0]: along x, [1]: along
 * y. Floats are numbered by length, and within a length by the place of the crossing in it. */
enum { WEAVE_FLOATS = WEAVE_CELL_MAX * (WEAVE_CELL_MAX + 1) / 2 };
struct weave_strokes {
    double complex phase[WEAVE_CELL_MAX]; /* of each cell */
    double box[2], rounded[2];
    double complex sloped[2], bow[2][WEAVE_FLOATS], tilt[2][WEAVE_FLOATS];
};
void weave_strokes_init(struct weave_strokes *s, const struct weave_cells *c, const double ab[2]);

/* Fourier coefficients of the seven shapes of a pattern that holds, at n frequencies. */
void weave_draw(const struct weave_cells *c, unsigned pattern, const struct weave_strokes *stroke, size_t n,
                double complex (*shape)[WEAVE_SHAPES]);

#endif
