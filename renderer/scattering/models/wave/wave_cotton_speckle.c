/* Made by speckle-tables (`make speckle-tables`), not by hand; speckle.h defines it. */
#include "renderer/scattering/models/wave/speckle_tables.h"

/* clang-format off */
const struct speckle_table wave_cotton_speckle = {
{2.6742F,2.77576F,2.94869F,}, {0.880871F,0.000000F,0.000000F,0.473356F,}};
/* clang-format on */
