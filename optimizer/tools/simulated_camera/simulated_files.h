/* Inside the simulated camera: the JSON files beside its raw files. */
#ifndef SELVEDGE_OPTIMIZER_SIMULATED_FILES_H
#define SELVEDGE_OPTIMIZER_SIMULATED_FILES_H

#include "optimizer/photographs/camera/lens.h"
#include "optimizer/photographs/camera/marker_board.h"
#include "optimizer/tools/simulated_camera/simulated_option.h"

#include <jansson.h>

enum { SIMULATED_NAME_BYTES = 256 };

/* Name of exposure i of the view whose rendering is `file`: "fit-03.exr" becomes "fit-03-1.dng". */
void simulated_raw_name(const char *file, size_t i, char name[SIMULATED_NAME_BYTES]);
/* Writes rig.json, camera-job.json and truth.json into the camera's folder. view: photographs.json of the source. */
status simulated_files_write(const struct simulated_camera_option *o, const struct lens *lens,
                             const struct marker_board *board, const json_t *view, const json_t *truth,
                             struct error *err);

#endif
