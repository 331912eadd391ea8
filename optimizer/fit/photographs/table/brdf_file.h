/* The table of measured BRDFs in the formats of public databases, and how rows of measurements are made of them. A new
 * format is one file and one row of BRDF_READERS.
 *
 * Rows are what a photograph would give: the mean over the lamp of pi f cos theta_l, over the mean of the lamp's own
 * cosine, so that a perfect white diffuser that faces the lamp is 1. The lamp is that of the document, sampled at 8 x 8
 * points. Which rows: those of the document (measurements.configurations), or BRDF_FIT_ROWS and BRDF_HELD_OUT_ROWS of
 * the default, which spread over lamp, camera and azimuth. An isotropic BRDF gives means over all rotations of the
 * cloth.
 */
#ifndef SELVEDGE_OPTIMIZER_BRDF_FILE_H
#define SELVEDGE_OPTIMIZER_BRDF_FILE_H

#include "base/warning.h"
#include "optimizer/fit/photographs/observation.h"

#include <stdbool.h>

enum { BRDF_FIT_ROWS = 16, BRDF_HELD_OUT_ROWS = 24 };

typedef struct brdf_reader {
    const char *id, *title;
    const char *suffix; /* of its files, by which it is recognised: ".binary" */
    bool isotropic;
    /* STATUS_FORMAT, STATUS_IO, STATUS_NO_MEMORY, STATUS_NOT_FOUND with a text that names the file. */
    status (*open)(const char *path, void **handle, struct error *err);
    /* f per steradian of unit vectors towards lamp and camera, z along the normal. False where nothing was measured. */
    bool (*eval)(const void *handle, const double light[3], const double camera[3], double f_rgb[3]);
    void (*close)(void *handle);
} brdf_reader;

#define BRDF_READERS(READER) READER(merl_brdf_reader)
#define BRDF_READER_DECLARATION(name) extern const brdf_reader name;
BRDF_READERS(BRDF_READER_DECLARATION)

/* The reader of a file name; NULL for a table. */
const brdf_reader *brdf_reader_of_name(const char *name);
/* Appends the rows. A held-out row where nothing was measured is left out with a warning; a fitted one is
 * STATUS_INVALID. err->field is OPTION_MEASUREMENT_FILE. */
status brdf_file_read(const brdf_reader *reader, const char *path, const struct job_document *doc,
                      const struct warning_sink *warn, struct observation_set *o, struct error *err);

#endif
