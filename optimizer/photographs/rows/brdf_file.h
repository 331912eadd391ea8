/* The table of measured BRDFs in the formats of public databases, and how rows of measurements are made of them. A new
 * format is one file and one row of BRDF_READERS.
 *
 * Rows have the values that a photograph would give: the mean over the lamp of pi f cos theta_l, over the mean of the
 * lamp's own cosine, so that a perfect white diffuser that faces the lamp is 1. The document's lamp is sampled at 8 x 8
 * points. The document may list the rows (measurements.configurations). The default has BRDF_FIT_ROWS and
 * BRDF_HELD_OUT_ROWS, which spread over lamp, camera and azimuth; for formats that list their measurements it chooses
 * among these. An isotropic BRDF gives means over all rotations of the cloth. Of an anisotropic one x runs along the
 * weft, and default rows alternate between rotations 0 and 90 degrees, or are at rotation 0 where the file lists its
 * azimuths. */
#ifndef SELVEDGE_OPTIMIZER_BRDF_FILE_H
#define SELVEDGE_OPTIMIZER_BRDF_FILE_H

#include "base/warning.h"
#include "optimizer/job/document/picture_words.h"
#include "optimizer/photographs/rows/observation.h"

#include <stdbool.h>

struct job_measured_row;
struct job_rows;

enum { BRDF_FIT_ROWS = 16, BRDF_HELD_OUT_ROWS = 24 };

typedef struct brdf_reader {
    const char *id, *title;
    const char *suffix; /* of its files, by which it is recognised: ".binary" */
    /* symmetry: the symmetry by the job document. STATUS_FORMAT, STATUS_INVALID (the file has another symmetry),
     * STATUS_IO, STATUS_NO_MEMORY, STATUS_NOT_FOUND with a text that names the file. */
    status (*open)(const char *path, enum job_symmetry symmetry, void **handle, struct error *err);
    bool (*isotropic)(const void *handle);
    /* f per steradian of unit vectors towards lamp and camera, z along the normal. False where nothing was measured. */
    bool (*eval)(const void *handle, const double light[3], const double camera[3], double f_rgb[3]);
    /* The angles of row i of the default: every 5 rows the first and third are fitted. False beyond the last one. NULL
     * for formats that cover all directions. */
    bool (*measured)(const void *handle, size_t i, struct job_measured_row *row);
    void (*close)(void *handle);
} brdf_reader;

#define BRDF_READERS(READER) READER(merl_brdf_reader) READER(rgl_brdf_reader) READER(astm_brdf_reader)
#define BRDF_READER_DECLARATION(name) extern const brdf_reader name;
BRDF_READERS(BRDF_READER_DECLARATION)

/* The reader of a file name; NULL for a table. */
const brdf_reader *brdf_reader_of_name(const char *name);
/* Appends the rows. A held-out row where nothing was measured is left out with a warning, and so is a fitted one of the
 * default; a fitted one of the document is STATUS_INVALID, as is a file without any fitted row. err->field is
 * OPTION_MEASUREMENT_FILE. */
status brdf_file_read(const brdf_reader *reader, const char *path, const struct job_setup *setup,
                      const struct job_rows *rows, const struct warning_sink *warn, struct observation_set *o,
                      struct error *err);

#endif
