/* The path of a yarn over one tile, and the map from points of its section to space. */
#ifndef SELVEDGE_GEOMETRY_YARN_PATH_H
#define SELVEDGE_GEOMETRY_YARN_PATH_H

#include "geometry/cloth/strand.h"

/* A path closed on the torus: n points, and point n = point 0 + shift. It is never vertical. */
struct yarn {
    size_t n;
    double (*point)[3];
    double shift[2];
    double radius_m; /* radius of its fibers */
    uint8_t axis_class;
    enum strand_cut cut;
    uint32_t number; /* selects its random stream */
};

/* The map from a section to space. */
struct yarn_section {
    double wide, high; /* area-preserving flattening */
    double twist_turns, length_m;
};

double yarn_length_m(const struct yarn *y);
/* Computes the point (u, v) of the section before flattening, s tiles along the yarn: u in the plane of the cloth, v
 * upwards. */
void yarn_point(const struct yarn *y, const struct yarn_section *c, double s, double u_m, double v_m, double out[3]);

#endif
