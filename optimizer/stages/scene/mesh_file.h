/* The mesh that a picture of the fitted cloth lies on. */
#ifndef SELVEDGE_OPTIMIZER_MESH_FILE_H
#define SELVEDGE_OPTIMIZER_MESH_FILE_H

#include "base/status.h"
#include "base/warning.h"
#include "optimizer/job/document/job_results.h"

#include <jansson.h>

/* Reads the mesh file of picture i at `path`, adds its statements to the ledgers `files`
 * (base/files/file_ledger_json.h), and warns where cloth on it would be stretched more than twice, as by texture
 * coordinates from 0 to 1. Errors of mesh_read_obj after the number of the picture, with its field OPTION_MESH_FILE. */
status mesh_file_examine(const char *path, const struct job_surface_picture *picture, size_t i, json_t *files,
                         const struct warning_sink *warn, struct error *err);

#endif
