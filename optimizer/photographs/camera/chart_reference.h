/* The colors of the patches of a ColorChecker Classic, and tables of other charts.
 *
 * The CIE L*a*b* values (D50, 2 degrees, M0) are those that X-Rite published in 2016 ("New color specifications for
 * ColorChecker SG and Classic charts") for charts made before and from November 2014, adapted to D65 by Bradford and
 * expressed as linear sRGB reflectances, 1 for a perfect white. The same numbers are in colour-science 0.4.7
 * ("ColorChecker24 - Before / After November 2014"), except b* of the earlier blue sky, -21.905 there. The white
 * patches of the editions differ by 4 % in luminance, and so does the scale that follows. */
#ifndef SELVEDGE_OPTIMIZER_CHART_REFERENCE_H
#define SELVEDGE_OPTIMIZER_CHART_REFERENCE_H

#include "base/status.h"

#include <stdbool.h>
#include <stddef.h>

enum { COLOR_CHART_PATCHES = 24 };

/* Linear sRGB reflectance of patch i. */
void color_chart_reference(bool from_2014, size_t i, double rgb[3]);
/* Reads the colors of another chart as the same: a table of 24 rows under a line that names the columns L, a, b or X,
 * Y, Z (D50, 2 degrees; 100 is white), in any order, separated by commas, semicolons or tabs. Other columns, empty
 * lines and lines that begin with # are passed over. STATUS_FORMAT, STATUS_INVALID naming file and line; errors of
 * file_read_all. */
status color_chart_reference_read(const char *path, double rgb[COLOR_CHART_PATCHES][3], struct error *err);
/* "dark skin" .. "black", as the maker names them. */
const char *color_chart_patch_name(size_t i);

#endif
