/* results/export/mitsuba/: the fitted cloth for Mitsuba 3. scene.xml holds the tile of fibers, repeated, with the hair
 * lobes that come nearest to the fitted scattering (hair_fit.h), lamp, camera and black sheet; fibers-<group>.txt the
 * fibers of one group; rows.csv the lamp and the camera of every row with its measured and rendered radiance. Of a
 * scanned cloth also density.vol and direction.vol with float32 samples, as Mitsuba's gridvolume reads them.
 * Millimetres; z = 0 is the highest point of the cloth. */
#ifndef SELVEDGE_OPTIMIZER_EXPORT_MITSUBA_H
#define SELVEDGE_OPTIMIZER_EXPORT_MITSUBA_H

#include "optimizer/worker/pipeline_context.h"

#include <jansson.h>

/* Writes the folder for the best model. *json: what result.json says of it, a new reference. A best model that sees no
 * fibers is STATUS_UNSUPPORTED. */
status export_mitsuba_write(struct pipeline_context *c, json_t **json, struct error *err);

#endif
