/* results/twin/: the tables from which a page in the browser shows the cloth while it is turned, bent and lit
 * (clients/dashboard/twin). twin.json describes the tables and their error, twin.bin holds them:
 *
 *     drape      unsigned 16-bit [n][n][3]: positions between `low` and `high` of a square piece over a ball, rows
 *                along the warp
 *     textures   half floats [n_basis / 4][height][width][4]: W_4g .. W_4g+3 of appearance_table.h
 *     table      half floats [3 n_basis / 4][rows][columns][4]
 *                layer 3 g + c:  T_4g .. T_4g+3 of channel c, so that the first three layers are a picture already
 *                (selvedge-twin.v1: layer c * n_basis / 4 + g)
 *                row:     (view side * view_edge + view row) * light_edge + light row
 *                column:  (view column * sides + light side) * light_edge + light column
 *     lobes      half floats [sets][azimuth][difference][half][4]: the lobe of near_fibers.h, and 0
 *     fibers     unsigned 32-bit [points][8]: of near_fibers.h, absent in v1 and of cloths with too many:
 *                x | y << 16, z | radius << 16 (between `low` and `high`, and of `radius_mm`, in 65,535 steps),
 *                set | is_last << 31, 0, then `open`, lower half first, above and below
 *
 * one after the other, little-endian, at the offsets that twin.json states. */
#ifndef SELVEDGE_OPTIMIZER_TWIN_RESULT_H
#define SELVEDGE_OPTIMIZER_TWIN_RESULT_H

#include "optimizer/report/findings/report.h"
#include "renderer/preview/appearance_table.h"
#include "renderer/preview/near_fibers.h"

/* The square piece that is draped in the twin, and the ball under it (renderer/mesh/mesh_drape.h). */
enum { TWIN_DRAPE_SIZE_MM = 40, TWIN_DRAPE_RADIUS_MM = 10 };

/* Camera paths that the tables take, 0 without a twin. */
double twin_result_paths(const struct job_results *results);
/* Makes the tables of the best model if the job asks for them and an earlier attempt has not finished them. from, to:
 * the stage's progress before and after. A volume model gives a warning. Errors of appearance_table_make. */
status twin_result_write(struct report *report, double from, double to, struct error *err);

/* For twin_result_write: the block of twin.bin, and the description of its parts for twin.json. The caller frees
 * both. */
status twin_file_make(const struct appearance_table *t, const struct near_fibers *f, const struct progress *progress,
                      char **block, size_t *n_byte, json_t **parts, struct error *err);

#endif
