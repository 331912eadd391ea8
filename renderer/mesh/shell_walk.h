/* A straight ray through a shell, from cell to cell. In each of them it runs straight through the flat cloth, too, and
 * distances along it are the same in both spaces: the map is affine, and the direction goes through it with its length.
 */
#ifndef SELVEDGE_RENDERER_SHELL_WALK_H
#define SELVEDGE_RENDERER_SHELL_WALK_H

#include "renderer/mesh/shell.h"

#include <embree3/rtcore.h>

#define SHELL_OUTSIDE UINT32_MAX
#define SHELL_ON_SHEET (UINT32_MAX - 1)

/* The far end of a cell is taken this much further, so that rounding leaves no gap before the next. */
#define SHELL_OVERLAP_MM 1e-6

/* A shell with its outer faces ready for rays from the open. */
struct shell_space {
    struct shell shell;
    RTCDevice device;
    RTCScene outer; /* the outer faces of the shell, as triangles */
};

/* Errors of shell_new; STATUS_UNSUPPORTED when Embree does not start. Release in any case. */
status shell_space_init(struct shell_space *s, const struct mesh *m, double thickness_mm, double margin_mm,
                        struct error *err);
void shell_space_release(struct shell_space *s);

struct shell_walk {
    const struct shell_space *space;
    bool black_sheet; /* one lies under the cloth: a ray that goes through the lower side ends */
    double origin[3], direction[3];
    double t;        /* how far it has come */
    uint32_t i_cell; /* SHELL_OUTSIDE: in the open; SHELL_ON_SHEET: it has ended on the black sheet */
    int from_face;   /* the face through which it came into the cell; -1: it started there */
};

void shell_walk_point(const struct shell_walk *w, double t, double x[3]);
/* Moves to the cell that holds the start of the ray, which scattering across a fiber may have put beyond a face. Where
 * the start lies outside of the shell, the last cell's map serves. */
void shell_walk_find_start(struct shell_walk *w);
/* From the open to the next outer face that leads into the shell. False: there is none, or the ray ends on the
 * sheet. */
bool shell_walk_enter(struct shell_walk *w);
/* Where the ray leaves its cell, and through which face. */
double shell_walk_exit(const struct shell_walk *w, int *face);
/* Goes on into the neighbouring cell, into the open or onto the black sheet. */
void shell_walk_on(struct shell_walk *w, double t, int face);
/* Place and direction in the flat cloth, where the ray is now. */
void shell_walk_flat(const struct shell_walk *w, double p_mm[3], double d[3]);

#endif
