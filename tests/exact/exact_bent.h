/* The shell of a bent cloth by definition (renderer/mesh/shell.h says which map it is): prisms between the mesh
 * moved up and down along its normals, each cut into three tetrahedra, in which the map to the flat cloth is affine.
 * Every ray is clipped at every tetrahedron. Millimetres.
 */
#ifndef SELVEDGE_TESTS_EXACT_BENT_H
#define SELVEDGE_TESTS_EXACT_BENT_H

#include "renderer/mesh/mesh.h"
#include "tests/exact/capsule_cloth.h"

struct exact_cell {
    double plane[4][4];    /* barycentric coordinate k of x: plane[k] . x + plane[k][3] */
    double to_cloth[3][4]; /* place in the flat cloth */
    double to_world[3][3]; /* of directions in the flat cloth */
    double scale;          /* length here over length there, the mean over directions */
    bool bottom[4];        /* face k is a part of the lower side */
};

struct exact_bent {
    size_t n_cell;
    struct exact_cell *cell;
    double low_mm[3], high_mm[3];
};

/* False: out of memory, or the mesh has no normals. Release in any case. */
bool exact_bent_init(struct exact_bent *b, const struct mesh *m, double up_mm, double down_mm);
void exact_bent_release(struct exact_bent *b);

enum exact_end { EXACT_LEFT, EXACT_MET, EXACT_ON_SHEET };

/* The next entrance of a ray. sheet: rays end at the lower side. */
enum exact_end exact_bent_walk(const struct exact_bent *b, const struct capsule_cloth *c, struct capsule_walk *w,
                               const double o[3], const double d[3], bool sheet, struct capsule_entrance *entrance,
                               uint32_t *i_cell);
/* The cell that a point lies in, or is nearest to. */
uint32_t exact_bent_cell(const struct exact_bent *b, const double x[3]);
/* The place of a point in the flat cloth by the map of a cell, and back. */
void exact_cell_to_cloth(const struct exact_cell *c, const double x[3], double flat[3]);
void exact_cell_move(const struct exact_cell *c, const double flat_way[3], double x[3]);

#endif
