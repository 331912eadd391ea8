/* Directions of a file's axes in space, as its header states them: the scan is stored turned, mirrored, or oblique. */
#ifndef SELVEDGE_GEOMETRY_AXIS_DIRECTIONS_H
#define SELVEDGE_GEOMETRY_AXIS_DIRECTIONS_H

#include <stdbool.h>

/* Writes the axes of the file that run along x, y and z of space, as option OPTION_AXES has them: "xyz", "xy-z".
 * direction[a]: where axis a of the file points, of any length above 0. Returns false, with axes "", for axes that are
 * oblique: farther than about a twentieth of a degree from the axes of space. */
bool axis_directions_name(double direction[3][3], char axes[8]);

/* Returns whether the axes, text that axis_map_parse accepts, are a mirror image and no turn. */
bool axes_are_mirrored(const char *axes);

#endif
