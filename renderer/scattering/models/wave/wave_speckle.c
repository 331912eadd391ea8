/* Made by speckle-tables (`make speckle-tables`), not by hand; speckle.h defines them. */
#include "renderer/scattering/models/wave/speckle_tables.h"

/* clang-format off */
const struct speckle_table wave_silk_speckle = {
{2.73859F,2.84848F,3.03612F,}, {0.839321F,0.000000F,0.000000F,0.543636F,}};
const struct speckle_table wave_trilobal_speckle = {
{2.62388F,2.75758F,2.98899F,}, {0.694752F,0.364238F,0.000000F,0.620202F,}};
const struct speckle_table wave_cotton_speckle = {
{2.6742F,2.77576F,2.94869F,}, {0.880871F,0.000000F,0.000000F,0.473356F,}};
/* clang-format on */
