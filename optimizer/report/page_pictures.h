/* Pictures of the report inside the page: photograph, rendering and their difference of every row. */
#ifndef SELVEDGE_OPTIMIZER_PAGE_PICTURES_H
#define SELVEDGE_OPTIMIZER_PAGE_PICTURES_H

#include "optimizer/report/findings/report.h"

#include <jansson.h>
#include <stdio.h>

/* rows: the rows of result.json. Each row has an exposure of its own for photograph and rendering, which brings the
 * brightest twentieth of the photograph's pixels (of a table: of the rendering's) to white, and one for the difference
 * (rendering minus photograph about grey). Pictures that cannot be read are left out. STATUS_NO_MEMORY, STATUS_IO. */
status page_pictures(const struct report *report, const json_t *rows, FILE *out, struct error *err);

/* list: "pictures" of result.json, the cloth on surfaces. Errors as above. */
status page_surface_pictures(const struct report *report, const json_t *list, FILE *out, struct error *err);

#endif
