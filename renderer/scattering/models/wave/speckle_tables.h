/* Tables of speckle for the models of waves. They are checked in as source, and made by a program of the tree (`make
 * speckle-tables`). */
#ifndef SELVEDGE_RENDERER_SPECKLE_TABLES_H
#define SELVEDGE_RENDERER_SPECKLE_TABLES_H

#include "renderer/scattering/speckle.h"

extern const struct speckle_table wave_silk_speckle, wave_trilobal_speckle, wave_cotton_speckle;

#endif
