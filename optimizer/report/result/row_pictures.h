/* The part of result.json about the pictures of rows: of photographs their crops and renderings, of a table the spheres
 * and lobes (table_lobes.h). */
#ifndef SELVEDGE_OPTIMIZER_ROW_PICTURES_H
#define SELVEDGE_OPTIMIZER_ROW_PICTURES_H

#include "optimizer/report/findings/report.h"

#include <jansson.h>

/* Returns the row whose picture shows row i: itself, or of a table the first row with the same lamp. */
size_t row_pictures_shown(const struct report *report, size_t i);
/* Adds the paths of the pictures of a row to its entry, and what the rendering shows. rendering, photograph: names of
 * the pictures. */
void row_pictures_put(const struct report *report, const char *rendering, const char *photograph, json_t *row);
/* Adds "lobes" to result.json: null until they are there. */
void row_pictures_put_lobes(const struct report *report, json_t *json);

#endif
