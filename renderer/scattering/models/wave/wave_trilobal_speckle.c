/* Made by speckle-tables (`make speckle-tables`), not by hand; speckle.h defines it. */
#include "renderer/scattering/models/wave/speckle_tables.h"

/* clang-format off */
const struct speckle_table wave_trilobal_speckle = {
{2.62388F,2.75758F,2.98899F,}, {0.694752F,0.364238F,0.000000F,0.620202F,}};
/* clang-format on */
