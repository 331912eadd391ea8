/* Made by speckle-tables (`make speckle-tables`), not by hand; speckle.h defines it. */
#include "renderer/scattering/models/wave/speckle_tables.h"

/* clang-format off */
const struct speckle_table wave_silk_speckle = {
{2.73859F,2.84848F,3.03612F,}, {0.839321F,0.000000F,0.000000F,0.543636F,}};
/* clang-format on */
