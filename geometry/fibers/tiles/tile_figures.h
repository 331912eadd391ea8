/* Figures of a large tile (fiber_tiles.h). */
#ifndef SELVEDGE_GEOMETRY_TILE_FIGURES_H
#define SELVEDGE_GEOMETRY_TILE_FIGURES_H

#include <stddef.h>

struct fiber_tiles {
    size_t n_move;    /* moves after which the tile looks like itself, the zero move included; 1: it shows no repeat
                         and stays as it is; 0: no large tile was asked for */
    size_t n_cut_end; /* ends that the cuts have made, without those that meet as they are */
    size_t n_free;    /* cut ends without a partner, which end within the cloth */
    double move_m;    /* mean distance by which joined ends were moved; NaN if there are none */
};

#endif
