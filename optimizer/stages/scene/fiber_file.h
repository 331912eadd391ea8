/* The fiber file of a job: read with the tile of the document, and compared with usual fibers of cloth. */
#ifndef SELVEDGE_OPTIMIZER_FIBER_FILE_H
#define SELVEDGE_OPTIMIZER_FIBER_FILE_H

#include "base/warning.h"
#include "geometry/fibers/fiber_set.h"
#include "optimizer/job/document/job_cloth.h"

#include <jansson.h>

/* Diameters of textile fibers: microfibers have 2 um, coarse wool and horsehair 100. */
#define FIBER_LEAST_DIAMETER_UM 1.0
#define FIBER_MOST_DIAMETER_UM 100.0

/* Reads the file into f (initialised), as fiber_import does. Fields OPTION_FIBER_FILE, OPTION_FIBER_RADIUS,
 * OPTION_TILE. STATUS_INVALID for a missing tile or radius, for a radius that
 * file and job both state, and for fibers as wide as the tile. */
status fiber_file_read(const char *path, const struct job_cloth *cloth, struct fiber_set *f, struct error *err);
/* Adds the statements of the file to the ledgers `files` (base/files/file_ledger_json.h), from its head alone. */
void fiber_file_note(const char *path, const struct job_cloth *cloth, json_t *files);
/* Warns of fibers that are thinner or thicker than fibers of cloth, and of a tile that the fibers do not fill or leave
 * far behind: a length in a wrong unit makes both. */
void fiber_file_warn(const struct fiber_set *f, const struct job_cloth *cloth, const struct warning_sink *warn);
/* Warns of a mean diameter in metres that no textile fiber has. option: the option that states the lengths. */
void fiber_file_warn_diameter(double diameter_m, const char *option, const struct warning_sink *warn);

#endif
