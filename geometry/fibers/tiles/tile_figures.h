/* Figures of a large tile (fiber_tiles.h). */
#ifndef SELVEDGE_GEOMETRY_TILE_FIGURES_H
#define SELVEDGE_GEOMETRY_TILE_FIGURES_H

#include <stddef.h>

struct fiber_tiles {
    size_t n_move;    /* moves that look alike, with none at all: 1: the tile shows no repeat, and stays as it is */
    size_t n_cut_end; /* ends that the cuts have made, without those that meet as they are */
    size_t n_free;    /* ends of these without a partner: they end within the cloth */
    double move_m;    /* mean distance by which joined ends were moved; NaN without any */
};

#endif
