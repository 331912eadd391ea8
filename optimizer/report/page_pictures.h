/* Pictures in report.html, with all their data in the page. */
#ifndef SELVEDGE_OPTIMIZER_PAGE_PICTURES_H
#define SELVEDGE_OPTIMIZER_PAGE_PICTURES_H

#include "optimizer/report/findings/report.h"

#include <jansson.h>
#include <stdio.h>

/* Writes photograph, rendering and their difference of every row. rows: the rows of result.json. Each row has an
 * exposure of its own for photograph and rendering, which brings the brightest twentieth of the photograph's pixels (of
 * a table: of the rendering's) to white, and one for the difference (rendering minus photograph about grey). Pictures
 * that cannot be read are left out. STATUS_NO_MEMORY, STATUS_IO. */
status page_pictures(const struct report *report, const json_t *rows, FILE *out, struct error *err);

/* list: "pictures" of result.json, the cloth on surfaces. Errors as above. */
status page_surface_pictures(const struct report *report, const json_t *list, FILE *out, struct error *err);

/* One picture as an <img> with all its data; what: its alternative text. Errors as above. */
status page_bytes_image(const struct report *report, const uint8_t *rgb, size_t width, size_t height, const char *what,
                        FILE *out, struct error *err);
/* The PNG file of this name among the results. *written: false if there is none. */
status page_picture_file(const struct report *report, const char *name, const char *what, FILE *out, bool *written,
                         struct error *err);
/* A picture of the cloth on a surface, with its caption, as large as a page; picture: NULL or as in the list above. */
status page_front_surface(const struct report *report, const json_t *picture, FILE *out, bool *written,
                          struct error *err);

#endif
